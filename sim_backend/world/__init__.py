"""Floor, walls, people, pictures and the robot among them."""
