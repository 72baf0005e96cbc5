"""Times of the user interface in ms, which are passes. Source: docs/firmware.md sections 8 and 8.5."""

DISPLAY_OFF_MS = 3
"""Time from the decision to switch off until the display goes off."""

NO_KEYS_MS = 251
"""Time from the command to switch the power off, as the map shows it, until keys count again."""

REPORT_MS = 2625
"""How long the display shows a message of the radio, from its last part on."""

LOGO_MS = 1100
"""How long a start shows the first picture of the logo."""

PICTURE_MS = 100
"""How long it shows each of the others."""

PICTURE_LEAD_MS = 2
"""Time from the end of the last refresh with one picture until the next picture appears."""

EMPTY_MS = 2000
"""How long the start shows an empty battery."""

PLAYING_MS = 125
"""Interval at which the picture of a running file changes."""

MESSAGE_PASSES = 1500
"""The count at which the message about a file's end is over, which the brick's state 14 counts on while it is off."""
MELODY_PASSES = 1000
"""The count of passes at which state 3 ends, which the message about a file's end counts twice in each pass."""
