"""Exercise 3, solved."""


def feel_ahead(rover):
    """Return the distance to the obstacle in mm; end 200 mm before it, turned around."""
    distance_mm = 0
    motion = rover.straight(1000)
    while motion.stop != "contact":
        distance_mm += motion.distance_mm
        motion = rover.straight(1000)
    rover.straight(-200)
    rover.turn(180)
    return distance_mm + motion.distance_mm
