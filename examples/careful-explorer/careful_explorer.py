"""A robot that wanders about, avoids obstacles that its sonar detects, and backs away from those it touches.

Motors B (left) and C (right) drive it; an ultrasonic sensor (port 4) faces forward, a touch sensor (1) is its bumper.
"""

from dataclasses import dataclass

from nxtdrive import Brick, SafetyLimits, open_brick

LEG_MM = 400
KEEP_CLEAR_MM = 250
BACK_OFF_MM = 150


@dataclass
class Trip:
    """The result of a trip.

    Attributes:
        driven_mm: Total distance driven, millimetres.
        detours: How often an obstacle was in the way.
        bumps: How often the bumper was pressed.
    """

    driven_mm: float = 0.0
    detours: int = 0
    bumps: int = 0


def explore(brick: Brick, duration_s: float) -> Trip:
    """Wander about for some time and stop."""
    rover = brick.rover(left="B", right="C", ultrasonic=4, touch=1, safety=SafetyLimits(stop_distance_mm=KEEP_CLEAR_MM))
    trip = Trip()
    end = brick.now() + duration_s
    while brick.now() < end:
        motion = rover.straight(LEG_MM)
        trip.driven_mm += motion.distance_mm
        if motion.stop == "contact":
            trip.bumps += 1
            rover.straight(-BACK_OFF_MM)
        if not motion.done:
            trip.detours += 1
            rover.turn(100)
    return trip


def main() -> None:
    """Explore for a minute with the brick that $NXT names, or the first one on USB."""
    with open_brick() as brick:
        trip = explore(brick, duration_s=60)
        brick.tone(880, 300)
    print(f"{trip.driven_mm / 1000:.1f} m, {trip.detours} detours, {trip.bumps} bumps")


if __name__ == "__main__":
    main()
