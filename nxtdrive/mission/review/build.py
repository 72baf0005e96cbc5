"""Hints at a robot that is not built or connected as the mission says."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

from behaviors.events import Reason
from behaviors.journal import Value
from behaviors.mission.robot import brick_id
from firmware_protocol.errors import NXTError
from nxtdrive.brick import LOW_BATTERY_MV, Brick
from nxtdrive.mission.review.reviewed_run import Hints, ReviewedRun, Transition

WIRING_KEYS = {"left", "right", "left_reversed", "right_reversed"}
BUILD_TOLERANCE = 0.1
"""A robot whose wheels or track differ by more from what its mission says turns and drives too wrongly to arrive."""


def another_build(run: ReviewedRun) -> Hints:
    """Check whether the simulated world's robot is built as the mission says."""
    build, robot = run.truth.build() if run.truth else {}, run.mission.robot
    wrong = {key: fits[0] for key, fits in build.items() if fits and not _describes(getattr(robot, key), fits)}
    if wrong:
        texts = {key: f'"{fits}"' if isinstance(fits, str) else f"{fits:g}" for key, fits in wrong.items()}
        keys = ", ".join(f"{key} = {text}" for key, text in texts.items())
        text = (
            f"The robot of this world is not built as the mission says. Write {keys} into [robot] of the mission "
            "or of its robot file, or change [robot] of the world."
        )
        yield "", text


def _describes(value: str | float, fits: Sequence[str | float]) -> bool:
    """Return whether a key of [robot] describes the robot: a length roughly, a port exactly unless it is 0 for none."""
    if isinstance(value, float):
        return any(isinstance(each, int | float) and abs(value / each - 1) <= BUILD_TOLERANCE for each in fits)
    return value in (0, *fits)


def another_brick(run: ReviewedRun, brick: Brick) -> Hints:
    """Check whether the mission's robot file describes another brick."""
    described = run.mission.calibration
    if not described.brick_id:  # the brick need not be asked
        return
    with suppress(NXTError):  # a lost link is the mission's concern, not a hint's
        address = brick.info().bluetooth_address
        if described.describes_another(address):
            text = (
                f"The robot file describes the brick {described.brick_id}, and this one is {brick_id(address)}. "
                "Name this robot's file with --robot, or make one: nxtdrive calibrate --robot FILE."
            )
            yield "", text


def weak_battery(run: ReviewedRun, battery_mv: Value) -> Hints:
    """Report a weak battery once."""
    if not run.weak_battery and isinstance(battery_mv, int) and battery_mv < LOW_BATTERY_MV:
        run.weak_battery = True
        volts = f"{battery_mv / 1000:.1f} V"
        yield "", f"The battery is weak ({volts}). Charge it: motors are slow, and the brick may switch itself off."


def ports(run: ReviewedRun, transition: Transition) -> Hints:
    """Ask for the ports after a long approach: a robot one wheel of which stands still goes round in circles.

    One whose bumper is pressed stands.
    """
    if transition.reason == Reason.APPROACH_TIMEOUT and transition.evidence.get("touching"):
        port = run.mission.robot.touch
        text = (
            f"{transition.target}: the robot did not arrive because its bumper was pressed. If nothing touched it, the "
            f"bumper on port {port} sticks: `nxtdrive sensor watch {port} touch --nxt ADDRESS` shows whether it is "
            "released."
        )
        yield transition.target, text
    elif transition.reason == Reason.APPROACH_TIMEOUT:
        left, right = run.mission.robot.left, run.mission.robot.right
        text = (
            f"{transition.target}: the robot drove to it for a long time and did not arrive. If it went round in "
            f"circles, is the left wheel's motor on port {left} and the right one's on port {right}? `nxtdrive motor "
            f"turn {left} 360 --nxt ADDRESS` turns the left wheel forwards if it is; other ports are left and right in "
            "[robot]."
        )
        yield transition.target, text


def motors(run: ReviewedRun) -> Hints:
    """Doubt the motors at the end, unless they were measured or are a simulated robot's usual ones."""
    described = run.mission.robot.model_fields_set & WIRING_KEYS
    doubtful = run.mission.calibration.motors is None and (run.truth is None or described)
    if run.seen and not run.arrivals and doubtful:
        text = (
            "The robot saw a target and reached none. If it turned or drove the wrong way, its motors are "
            "exchanged or reversed, and [robot] does not say so: `nxtdrive calibrate motors` finds out."
        )
        yield "", text
