"""Driving by hand in a terminal: controls with a dead-man switch, a map from what the robot itself knows."""
