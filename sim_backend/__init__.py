"""The simulator: a brick that behaves like LEGO's firmware, with its robot, world and camera."""
