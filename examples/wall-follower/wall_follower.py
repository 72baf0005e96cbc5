"""A robot that follows the wall to its right.

Motors B (left) and C (right) drive it; one ultrasonic sensor looks ahead (port 4), another to the right (port 2), and a
touch sensor is its bumper (port 1).
"""

from nxtdrive import Brick, SafetyLimits, open_brick

SPEED_MM_S = 150
WALL_MM = 250
"""Wanted distance of the right sensor from the wall."""
FAR_MM = 450
"""A wall that is farther away has ended: the robot turns around its corner."""
GAIN = 0.25
"""Degrees a second of steering for each millimetre beside the wanted distance."""
TURN_DEG_S = 28


def follow(brick: Brick, duration_s: float) -> None:
    """Follow the wall for some time and stop."""
    rover = brick.rover(ultrasonic=4, touch=1, safety=SafetyLimits(stop_distance_mm=WALL_MM))
    wall = brick.ultrasonic(2)
    end = brick.now() + duration_s
    while brick.now() < end:
        distance_mm = wall.distance_mm
        if distance_mm is None or distance_mm > FAR_MM:
            steer = TURN_DEG_S  # the wall has ended
        else:
            steer = max(-TURN_DEG_S, min(TURN_DEG_S, GAIN * (distance_mm - WALL_MM)))
        objection = rover.drive(SPEED_MM_S, steer)
        if objection == "contact":
            rover.straight(-80)
        if objection is not None:  # something ahead: an inner corner
            rover.turn(-45)
    rover.stop()


def main() -> None:
    """Follow the wall for a minute with the brick that $NXT names, or the first one on USB."""
    with open_brick() as brick:
        print("Following the wall for a minute.")
        follow(brick, duration_s=60)
        turned = brick.motor("B").angle / 360
    print(f"The left wheel turned {turned:.0f} times.")


if __name__ == "__main__":
    main()
