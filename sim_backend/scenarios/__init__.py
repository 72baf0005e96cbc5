"""Rooms and disturbances of test missions, drawn from a class and a seed."""
