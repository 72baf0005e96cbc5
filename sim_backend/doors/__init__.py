"""Doors: ways for other programs to connect to the simulated brick."""
