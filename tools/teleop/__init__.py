"""Driving by hand in a terminal: controls with a dead-man switch, and a map from the robot's own measurements."""
