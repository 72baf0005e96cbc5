"""The simulated world: floor, walls, objects, people, pictures and the robot."""
