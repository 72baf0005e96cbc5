"""The simulated brick: LEGO's firmware, module by module."""
