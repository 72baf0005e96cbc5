"""``nxtdrive sensor``: reads a sensor, once or continuously."""

from __future__ import annotations

import argparse
import math
from contextlib import nullcontext
from dataclasses import asdict
from functools import partial
from itertools import islice
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.csv_file import CsvFile, add_csv_argument, column
from nxtdrive.cli.options import add_action, add_brick_arguments, add_json_argument, number, on_brick, warn_of_program
from nxtdrive.cli.output import write_json, write_line
from nxtdrive.ports import SENSOR_PORTS

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.ports import SensorPort
    from nxtdrive.sensors import QuantitySensor, Reading

DESCRIPTION = """\
Read a sensor once (read) or as fast as the link allows (watch), identify digital
sensors (identify), or read their registers (registers). KIND is touch, light (with
its lamp on), ambient (off), sound, sound-dba (all four 0 to 100 %), ultrasonic (0 to
2540 mm), color, temperature, rcx-temperature (°C) or compass (0 to 359°, clockwise from
north); without it, a digital sensor is identified. Each action sets up the ports
that it reads; `nxtdrive monitor` leaves those of a running program as they are."""
EXAMPLES = """\
  nxtdrive sensor read 4 ultrasonic
  nxtdrive sensor watch 1 touch --every 0.1 --count 20
  nxtdrive sensor watch 4 --every 0.5 --csv distances.csv
  nxtdrive sensor watch 4 --json --nxt serial:///dev/rfcomm0
  nxtdrive sensor identify
  nxtdrive sensor registers 4 0x10 8"""

PROGRAM = "and reads the ports that are set up here in another mode."
"""The consequence of a program that runs on the brick."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    from nxtdrive.sensors.i2c import I2C_RECEIVE_LIMIT

    byte = number("byte", lambda text: int(text, 0), 0, 0xFF)
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    read = add_action(actions, "read", "print one value", on_brick(_read))
    watch = add_action(actions, "watch", "print values until Ctrl-C", _watch)
    identify = add_action(actions, "identify", "print which digital sensor is on each port", on_brick(_identify))
    registers = add_action(actions, "registers", "print registers of a digital sensor", on_brick(_registers))
    for action in (read, watch, identify, registers):
        add_brick_arguments(action)
        add_json_argument(action)
    for action in (read, watch):
        action.add_argument("port", metavar="PORT", type=int, choices=SENSOR_PORTS, help="1 to 4")
        action.add_argument(
            "kind", metavar="KIND", nargs="?", help="what is plugged in; digital sensors identify themselves"
        )
    watch.add_argument(
        "--every",
        metavar="S",
        type=number("seconds", float, 0.01, 3600),
        default=0.0,
        help="seconds between values (default: as fast as the link allows)",
    )
    add_csv_argument(watch)
    watch.add_argument("--count", metavar="N", type=number("count", int, 1, math.inf), help="stop after N values")
    registers.add_argument("port", metavar="PORT", type=int, choices=SENSOR_PORTS, help="1 to 4")
    registers.add_argument("register", metavar="REGISTER", type=byte, help="the first register, such as 0x42")
    registers.add_argument(
        "size",
        metavar="SIZE",
        type=number("size", int, 1, I2C_RECEIVE_LIMIT),
        nargs="?",
        default=1,
        help="how many, 1 to 15 (default: 1)",
    )
    registers.add_argument(
        "--address", metavar="A", type=byte, default=0x02, help="8-bit write address of the sensor (default: 0x02)"
    )


def _read(args: argparse.Namespace, brick: Brick) -> None:
    sensor = _sensor(brick, args.port, args.kind)
    sensor.set_up()
    _print(sensor, sensor.measure(), as_json=args.json)


def _watch(args: argparse.Namespace) -> int:
    with CsvFile(args.csv) if args.csv else nullcontext() as table:
        return on_brick(partial(_watch_into, table))(args)


def _watch_into(table: CsvFile | None, args: argparse.Namespace, brick: Brick) -> None:
    from nxtdrive.sensors.kinds import plain

    sensor = _sensor(brick, args.port, args.kind)
    name, begun = column(sensor.quantity, sensor.unit), None
    for reading in islice(sensor.watch(args.every), args.count):
        _print(sensor, reading, as_json=args.json)
        if table:
            begun = reading.time_s if begun is None else begun
            table.write({"time_s": round(reading.time_s - begun, 3), name: plain(reading.value)})


def _sensor(brick: Brick, port: SensorPort, kind: str | None) -> QuantitySensor[Any]:
    from nxtdrive.sensors import identify
    from nxtdrive.sensors.kinds import KINDS, make_sensor

    if kind is not None and kind not in KINDS:
        return make_sensor(kind, brick.link, port)  # which refuses it before the brick is asked
    warn_of_program(brick, PROGRAM)
    identity = identify(brick.link, port)
    found = identity.kind if identity else ""
    if kind is None and found not in KINDS:
        raise ConfigError(
            f"the sensor on port {port} does not identify itself.", remedy=f"Name it: {', '.join(KINDS)}."
        )
    if kind not in (None, found) and identity and found in KINDS:
        raise ConfigError(
            f"port {port} has a sensor of the kind {found} ({identity.vendor} {identity.product}), not {kind}.",
            remedy=f"Name that kind, or the port of the {kind} sensor.",
        )
    return make_sensor(kind or found, brick.link, port)


def _print(sensor: QuantitySensor[Any], reading: Reading[Any], *, as_json: bool) -> None:
    from nxtdrive.sensors.kinds import in_words, plain

    if as_json:
        value = {"quantity": sensor.quantity, "unit": sensor.unit, "value": plain(reading.value)}
        write_json({"time_s": round(reading.time_s, 4), **value}, flush=True)
    else:
        write_line(f"{sensor.quantity}  {in_words(reading.value, sensor.unit)}", flush=True)


def _identify(args: argparse.Namespace, brick: Brick) -> None:
    from nxtdrive.sensors import identify

    warn_of_program(brick, PROGRAM)
    found = {port: identify(brick.link, port) for port in SENSOR_PORTS}
    if args.json:
        write_json({port: asdict(who) if who else None for port, who in found.items()}, indent=2)
        return
    for port, who in found.items():
        words = f"{who.vendor} {who.product} {who.version}".strip() + f" ({who.kind})" if who else "nothing digital"
        write_line(f"{port}  {words}")


def _registers(args: argparse.Namespace, brick: Brick) -> None:
    warn_of_program(brick, PROGRAM)
    data = brick.i2c(args.port, args.address).read(args.register, args.size)
    if args.json:
        write_json({"register": args.register, "data": data.hex()})
        return
    text = "".join(chr(byte) if 0x20 <= byte < 0x7F else "." for byte in data)
    write_line(f"0x{args.register:02x}  {data.hex(' ')}  {text}")
