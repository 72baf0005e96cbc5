"""Times of the user interface in ms, which are passes. Source: docs/firmware.md sections 8 and 8.5."""

DISPLAY_OFF_MS = 3
"""Time from the decision to switch off until the display goes off."""

DEAF_MS = 251
"""Time from the command to switch the power off, as the map shows it, until keys count again."""

EMPTY_FOUND_MS = 2
"""Time from a sample without bars until the start shows an empty battery."""

MESSAGE_MS = 750
"""How long the display shows the end of a program."""

REPORT_MS = 2625
"""How long the display shows a message of the radio, from its last part on."""

LOGO_MS, LOGO_LEAD_MS = 2784, 3
"""The logo ends this number of passes before the end of the first refresh of the screen that ends after this time."""

STARTUP_LEAD_MS = 525
"""Time from the sound of a start to the end of the logo."""

EMPTY_MS = 2000
"""How long the start shows an empty battery."""

PLAYING_MS = 125
"""Interval at which the picture of a running file changes."""
