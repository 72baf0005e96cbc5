"""The other end: a simulated brick that behaves as LEGO's firmware, its robot, its world and its camera."""
