"""``nxtdrive monitor``: shows the state of a brick, continuously."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, number
from nxtdrive.cli.pace import in_real_time

if TYPE_CHECKING:
    from rich.table import Table

    from nxtdrive.brick import Brick
    from nxtdrive.sensors import Measuring
    from nxtdrive.tools.monitor import Snapshot

DESCRIPTION = """\
Show motors, input ports, battery and link of a brick until Ctrl-C. Input ports
are read as they are configured; --sensor sets one up and shows its measurements."""
EXAMPLES = """\
  nxtdrive monitor
  nxtdrive monitor --sensor 4=ultrasonic --sensor 1=touch --nxt usb://
  nxtdrive monitor --once --json"""

REDRAWS_PER_S = 8


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_brick_arguments(parser)
    parser.add_argument(
        "--sensor",
        metavar="PORT=KIND",
        action="append",
        default=[],
        help="what is plugged in, kinds as for `nxtdrive sensor`; once per port",
    )
    parser.add_argument(
        "--every",
        metavar="S",
        type=number("seconds", float, 0.01, 3600),
        default=0.25,
        help="time between updates (default: 0.25)",
    )
    parser.add_argument("--once", action="store_true", help="print one snapshot and exit")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Show snapshots until Ctrl-C, or one with --once."""
    from nxtdrive.brick import open_brick
    from nxtdrive.tools.monitor import look, watch

    with open_brick(in_real_time(args.nxt)) as brick:
        sensors = _named(args.sensor, brick)
        for sensor in sensors.values():
            sensor.set_up()
        if args.once:
            snapshot = look(brick, sensors)
            _print(snapshot, as_json=args.json)
        elif args.json:
            for snapshot in watch(brick, sensors, args.every):
                print(json.dumps(asdict(snapshot)), flush=True)
        else:
            _show(watch(brick, sensors, args.every))
    return DONE


def _named(words: list[str], brick: Brick) -> dict[int, Measuring[Any]]:
    from nxtdrive.sensors.kinds import make_sensor

    sensors = {}
    for word in words:
        port, separator, kind = word.partition("=")
        if not separator or port not in ("1", "2", "3", "4"):
            raise ConfigError(f"--sensor {word} is not PORT=KIND.", remedy="Write it as in --sensor 4=ultrasonic.")
        if int(port) in sensors:
            raise ConfigError(f"--sensor names port {port} twice.", remedy="Name each port once.")
        sensors[int(port)] = make_sensor(kind, brick.link, int(port))  # type: ignore[arg-type]  # one of the four
    return sensors


def _print(snapshot: Snapshot, *, as_json: bool) -> None:
    if as_json:
        print(json.dumps(asdict(snapshot), indent=2))
        return
    from rich.console import Console

    Console().print(_table(snapshot))


def _show(snapshots: Iterator[Snapshot]) -> None:
    from rich.live import Live

    with Live(_table(next(snapshots)), refresh_per_second=REDRAWS_PER_S) as live:
        for snapshot in snapshots:
            live.update(_table(snapshot))


def _table(snapshot: Snapshot) -> Table:
    """Make a table with one row per port."""
    from rich.table import Table

    caption = f"battery {snapshot.battery_mv / 1000:.2f} V   link {snapshot.latency_ms:.1f} ms"
    table = Table("port", "what", "raw", "value", caption=caption)
    for motor in snapshot.motors:
        table.add_row(motor.port, f"motor, {motor.state}", f"{motor.power} %", f"{motor.angle_deg}°")
    for sensor in snapshot.sensors:
        table.add_row(str(sensor.port), sensor.type, str(sensor.raw), sensor.text)
    return table
