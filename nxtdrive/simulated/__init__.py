"""Missions in random scenarios, and the robot that drives them."""
