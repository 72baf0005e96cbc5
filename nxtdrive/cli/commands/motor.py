"""``nxtdrive motor``: turns a motor from the command line."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument, number, on_brick, warn_of_program
from nxtdrive.cli.output import write_json, write_line
from nxtdrive.ports import MOTOR_PORTS

if TYPE_CHECKING:
    from behaviors.ports import StopReason
    from nxtdrive.brick import Brick
    from nxtdrive.ports import MotorPort

DESCRIPTION = """\
Turn a motor for a time or by an angle, or stop it. A motor that is blocked is
braked and reported (exit code 1). Afterwards the motor is switched off; if this
program or the link dies meanwhile, the brick itself stops it."""
EXAMPLES = """\
  nxtdrive motor run A --speed 360 --seconds 2
  nxtdrive motor run B --power -60
  nxtdrive motor turn A 720
  nxtdrive motor turn C -90 --speed 200 --json
  nxtdrive motor stop --nxt usb://"""

PROGRAM = "and may drive the motors too. `nxtdrive program stop` ends it."
"""The consequence of a program that runs on the brick."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare ``run``, ``turn`` and ``stop`` with their arguments."""
    from nxtdrive.motion.motor import ANGLE_RANGE_DEG, FASTEST_DEG_S

    speed = number("speed", float, -FASTEST_DEG_S, FASTEST_DEG_S)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    run_ = add_action(actions, "run", "turn for a time", on_brick(_run))
    run_.add_argument("port", metavar="PORT", type=str.upper, choices=MOTOR_PORTS, help="A, B or C")
    how = run_.add_mutually_exclusive_group()
    how.add_argument("--speed", metavar="DEG_S", type=speed, default=360.0, help="degrees per second (default: 360)")
    how.add_argument(
        "--power",
        metavar="PERCENT",
        type=number("power", int, -100, 100),
        help="duty cycle, -100..100, instead of a speed",
    )
    run_.add_argument(
        "--seconds", metavar="S", type=number("seconds", float, 0, 3600), default=2.0, help="for how long (default: 2)"
    )
    turn = add_action(actions, "turn", "turn by an angle", on_brick(_turn))
    turn.add_argument("port", metavar="PORT", type=str.upper, choices=MOTOR_PORTS, help="A, B or C")
    turn.add_argument(
        "angle",
        metavar="DEGREES",
        type=number("angle", float, -ANGLE_RANGE_DEG, ANGLE_RANGE_DEG),
        help="how far; negative: backward",
    )
    turn.add_argument("--speed", metavar="DEG_S", type=speed, default=360.0, help="degrees per second (default: 360)")
    stop = add_action(actions, "stop", "brake motors and switch them off", on_brick(_stop))
    stop.add_argument("ports", metavar="PORT", nargs="*", type=str.upper, help="A, B or C (default: all)")
    for action in (run_, turn, stop):
        add_brick_arguments(action)
        add_json_argument(action)


def _run(args: argparse.Namespace, brick: Brick) -> int:
    from behaviors.ports import StopReason
    from nxtdrive.motion.motor import Then

    warn_of_program(brick, PROGRAM)
    motor = brick.motor(args.port)
    before = motor.angle
    if args.power is None:
        stop = motor.run_time(args.speed, args.seconds, Then.BRAKE)
    else:
        motor.dc(args.power)
        brick.sleep(args.seconds)
        stop = StopReason.STALLED if motor.done else StopReason.DONE
        motor.brake()
    return _report(args, brick, before, stop)


def _turn(args: argparse.Namespace, brick: Brick) -> int:
    from nxtdrive.motion.motor import Then

    warn_of_program(brick, PROGRAM)
    motor = brick.motor(args.port)
    before = motor.angle
    return _report(args, brick, before, motor.run_angle(args.speed, args.angle, Then.BRAKE))


def _stop(args: argparse.Namespace, brick: Brick) -> int:
    ports: list[MotorPort] = args.ports or list(MOTOR_PORTS)
    for motor in [brick.motor(port) for port in ports]:  # no motor is braked if a port is wrong
        motor.brake()
    warn_of_program(brick, PROGRAM)
    if args.json:
        write_json({"stopped": ports})
    else:
        write_line(f"stopped {' '.join(ports)}")
    return DONE


def _report(args: argparse.Namespace, brick: Brick, before: float, stop: StopReason) -> int:
    from behaviors.ports import StopReason
    from nxtdrive.motion.brake_predictor import BRAKING_S
    from nxtdrive.motion.motor import SPEED_WINDOW_S

    brick.sleep(SPEED_WINDOW_S + BRAKING_S)
    angle = brick.motor(args.port).angle
    if args.json:
        write_json({"port": args.port, "stop": stop, "turned_deg": angle - before, "angle_deg": angle})
    else:
        write_line(f"motor {args.port} {stop}: turned {angle - before:g} degrees, now at {angle:g}")
    return DONE if stop is StopReason.DONE else NOT_ACHIEVED
