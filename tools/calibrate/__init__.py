"""``nxtdrive calibrate``: measures how the robot is built."""
