"""Wheels by ruler: a straight drive and turns on the spot that people measure."""

from __future__ import annotations

import datetime
from collections.abc import Callable
from typing import TYPE_CHECKING

from behaviors.robot_description import RobotFile
from nxtdrive.mission.setup import build_robot

from .course import CalibrationRefused
from .session import Line, Outcome
from .verdict import described, measured

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

STRAIGHT_MM, TURNS = 1000.0, 5
RULER_MM, RULER_DEG = 2.0, 3.0
"""How well people measure: standard errors."""
MOST_OFF = 0.3
"""A larger correction is a slip of the pen, or wheels of another size."""


def by_ruler(
    diameter_mm: float, track_mm: float, driven: tuple[float, float], turned: tuple[float, float]
) -> dict[str, float]:
    """Compute diameter and track.

    Args:
        diameter_mm: The diameter by which odometry counted.
        track_mm: The track by which it did.
        driven: Millimetres driven by odometry, and by ruler.
        turned: Degrees turned by odometry, and really.

    Raises:
        CalibrationRefused: They differ too much.
    """
    longer, turned_more = driven[1] / driven[0], turned[1] / turned[0]
    for name, share in (("way", longer), ("turn", turned_more)):
        if abs(share - 1) > MOST_OFF:
            raise CalibrationRefused(
                f"the {name} you measured is {share:.0%} of what the wheels counted.",
                remedy="Measure again; if it is right, correct the wheels' diameter and track in the robot file first.",
            )
    return {"wheel_diameter_mm": diameter_mm * longer, "axle_track_mm": track_mm * longer / turned_more}


def calibrate_by_ruler(brick: Brick, before: RobotFile, today: datetime.date, ask: Callable[[str], float]) -> Outcome:
    """Drive and turn, ask how far, and return the robot file that follows.

    Args:
        brick: The brick.
        before: What is believed so far.
        today: The date for the file.
        ask: Asks for a number.

    Raises:
        CalibrationRefused: What was measured cannot be, or something stopped the robot.
    """
    robot = before.robot
    rover = build_robot(brick, robot)
    ask("Mark where the wheels stand. It drives one metre ahead, then press Enter")
    straight = rover.straight(STRAIGHT_MM)
    if not straight.done:
        raise CalibrationRefused(f"the drive was ended: {straight.stop}.", remedy="Clear the floor and start again.")
    really_mm = ask("How many millimetres did it drive?")
    ask(f"Mark where it points. It turns {TURNS} times to the right, then press Enter")
    turn = rover.turn(360.0 * TURNS)
    if not turn.done:
        raise CalibrationRefused(f"the turn was ended: {turn.stop}.", remedy="Clear the floor and start again.")
    over_deg = ask(f"By how many degrees did it turn more than {TURNS} full turns (negative: less)?")
    found = by_ruler(
        robot.wheel_diameter_mm,
        robot.axle_track_mm / (1 - robot.turn_slip_percent / 100),
        (straight.distance_mm, really_mm),
        (turn.turned_deg, 360.0 * TURNS + over_deg),
    )
    errors = {
        "wheel_diameter_mm": found["wheel_diameter_mm"] * RULER_MM / STRAIGHT_MM,
        "axle_track_mm": found["axle_track_mm"] * (RULER_MM / STRAIGHT_MM + RULER_DEG / 360 / TURNS),
    }
    values = {
        "wheel_diameter_mm": round(found["wheel_diameter_mm"], 2),
        "axle_track_mm": round(found["axle_track_mm"], 1),
    }
    changes = {**values, "turn_slip_percent": 0.0}
    file = described(before, {"robot": changes, "calibration": {"wheels": measured("ruler", errors, today)}})
    lines = [Line(f"robot.{key}", getattr(robot, key), value, errors[key]) for key, value in values.items()]
    return Outcome(file, lines, None, 0)
