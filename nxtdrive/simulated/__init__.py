"""Missions in drawn scenarios: what they are, and the robot that drives them."""
