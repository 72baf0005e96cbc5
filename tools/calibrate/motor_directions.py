"""Find which way the motors drive, and the least power at which they turn, by the camera and the counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from nxtdrive.motion.outputs import sample
from nxtdrive.motion.wheel_geometry import motor_signs
from nxtdrive.ports import output_port

from .course import CalibrationRefused

if TYPE_CHECKING:
    from behaviors.mission.robot import OutputPort, RobotTable
    from nxtdrive.brick import Brick

TURN_DEG, RATE_DEG_S = 45.0, 90.0
"""How far and how fast each wheel turns."""
MIN_SHARE = 0.02
"""The sheet moves at least this share of the frame's width then."""
POWERS = range(2, 41, 2)
"""Powers that are tried in turn, in percent."""
TRY_S, TURNS_DEG = 0.3, 3
"""How long each power is tried, and the turn from which on the motor counts as turning."""

Column = Callable[[], float]
"""Returns where the middle of the sheet is, as a share of the frame's width, positive right of its middle."""


def is_reversed(brick: Brick, port: OutputPort, sign: int, column: Column) -> bool:
    """Turn one wheel forward and back, and return whether positive power drives it backwards.

    Args:
        brick: The brick.
        port: The wheel's motor.
        sign: 1 for the left wheel, which turns the robot to the right when it drives forward; -1 for the right one.
        column: Says where the sheet is in the frame.

    Raises:
        CalibrationRefused: The sheet did not move in the frame.
    """
    before = column()
    motor = brick.motor(port)
    motor.run_angle(RATE_DEG_S, TURN_DEG)
    moved = column() - before
    motor.run_angle(RATE_DEG_S, -TURN_DEG)
    if abs(moved) < MIN_SHARE:
        raise CalibrationRefused(
            f"the picture did not move when the motor on port {port} turned.",
            remedy="Check that the wheels touch the floor, find the ports with `nxtdrive motor`, and write them to the "
            'robot file: [robot] left = "B", right = "C".',
        )
    return moved * sign > 0


def dead_zone_percent(brick: Brick, robot: RobotTable) -> int:
    """Return the least power at which both wheels turn, unregulated; the robot turns a little and back.

    Raises:
        CalibrationRefused: They did not turn at 40 % of the power.
    """
    ports = [output_port(robot.left), output_port(robot.right)]
    left, right = motor_signs((robot.left_reversed, robot.right_reversed))
    turning = (left, -right)  # the robot turns on the spot
    sign = 1
    motors = [brick.motor(port) for port in (robot.left, robot.right)]
    for power in POWERS:
        before = sample(brick.link, *ports).angles_deg
        for motor, motor_sign in zip(motors, turning, strict=True):
            motor.dc(sign * motor_sign * power)
        brick.sleep(TRY_S)
        after = sample(brick.link, *ports).angles_deg
        for motor in motors:
            motor.brake()
        sign = -sign  # so that the sheet stays in view
        if all(abs(now - then) >= TURNS_DEG for now, then in zip(after, before, strict=True)):
            return power
    raise CalibrationRefused(
        f"the wheels do not turn at {POWERS[-1]} % of the power.", remedy="Charge the battery, and free the wheels."
    )
