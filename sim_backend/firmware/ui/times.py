"""Times of the user interface in passes, which are ms. Source: docs/firmware.md sections 8 and 8.5."""

NO_KEYS_PASSES = 250
"""The count of passes, from the command to switch the power off on, after which keys count again."""

FIRST_PICTURE_PASSES = 1000
"""How much longer than the others a start shows the first picture of the logo."""

PICTURE_PASSES = 100
"""The count at which the next picture of the logo comes."""

EMPTY_PASSES = 2000
"""The count at which the picture of the empty battery is over."""

MELODY_PASSES = 1000
"""The count at which state 3 ends."""

MESSAGE_PASSES = 1500
"""The count at which the message about a file's end is over."""
