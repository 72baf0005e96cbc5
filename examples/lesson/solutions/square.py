"""Exercise 1, solved."""


def drive_square(rover):
    """Drive the square."""
    for _ in range(4):
        rover.straight(400)
        rover.turn(90)
