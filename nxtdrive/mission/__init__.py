"""Missions on the driver: the adapters that fill the ports of `behaviors`, and what opens them for a mission."""
