"""Scenarios: rooms and disturbances of test missions, generated from a class and a seed."""
