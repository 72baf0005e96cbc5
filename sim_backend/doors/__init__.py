"""Ways for other programs to plug into the simulated brick."""
