"""``nxtdrive calibrate``: measures how the robot is built."""

SHEET_HEIGHT_MM = 200.0
"""The middle of the marker sheet above the floor, unless another height is given."""
