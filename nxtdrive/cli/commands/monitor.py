"""``nxtdrive monitor``: shows the state of a brick, continuously."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping
from contextlib import nullcontext
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.csv_file import CsvFile, add_csv_argument, column
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_json_argument, number
from nxtdrive.cli.output import make_console, make_table, write_error, write_json
from nxtdrive.cli.pace import in_real_time

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from nxtdrive.brick import Brick
    from nxtdrive.sensors import QuantitySensor
    from nxtdrive.tools.monitor import History, Plot, Snapshot

DESCRIPTION = """\
Show motors, input ports, battery and link of a brick until Ctrl-C, even if the
link is lost and comes back. Digital sensors, such as the ultrasonic
one, identify themselves; touch, light, sound and color sensors do not: --sensor
names one, sets up its port and shows its measurements. While a program runs on
the brick, other ports are only read, in the mode that it has set. In a terminal, the
readings of the last minute are plotted between their lowest and highest."""
EXAMPLES = """\
  nxtdrive monitor
  nxtdrive monitor --sensor 1=touch --sensor 3=light --nxt usb://
  nxtdrive monitor --every 1 --csv robot.csv
  nxtdrive monitor --once --json"""

REDRAWS_PER_S = 8
BLOCKS, ASCII = "▁▂▃▄▅▆▇█", "_.,-=+*#"
"""Characters of a plot from the lowest to the highest reading; the second set is for terminals without blocks."""
SCALE_WIDTH, WIDEST_PLOT = 22, 60
"""Width of a line beside its plot (port and scale), and largest width of a plot, in characters."""


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
    add_csv_argument(parser)
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Show snapshots until Ctrl-C, or one with --once."""
    from nxtdrive.brick import open_brick
    from nxtdrive.ports import SENSOR_PORTS
    from nxtdrive.tools.monitor import identify_sensors, watch

    going_on = not args.once
    with (
        CsvFile(args.csv) if args.csv else nullcontext() as table,
        open_brick(in_real_time(args.nxt), reconnect=going_on) as brick,
    ):
        sensors = _named(args.sensor, brick)
        for sensor in sensors.values():
            sensor.set_up()
        identified = identify_sensors(brick, {*SENSOR_PORTS} - {*sensors})
        brick.link.reconnect_timeout_s = 0.0
        on_loss = _say_loss if going_on else None
        snapshots = watch(brick, sensors, args.every, identified=identified, on_loss=on_loss)
        if table:
            snapshots = _kept(snapshots, table, {port: each.sensor for port, each in identified.items()} | sensors)
        if args.once:
            _print(next(snapshots), as_json=args.json)
        elif args.json:
            for snapshot in snapshots:
                write_json(asdict(snapshot), flush=True)
        elif sys.stdout.isatty():
            _show(snapshots)
        else:  # what reads it waits for each snapshot, as a pipe or a file does
            for snapshot in snapshots:
                _print(snapshot, as_json=False)
    return DONE


def _kept(
    snapshots: Iterator[Snapshot], table: CsvFile, sensors: Mapping[int, QuantitySensor[Any] | None]
) -> Iterator[Snapshot]:
    """Yield snapshots, each after writing it as a row, with a column for each measuring sensor."""
    begun: float | None = None
    for snapshot in snapshots:
        begun = snapshot.time_s if begun is None else begun
        row: dict[str, object] = {
            "time_s": round(snapshot.time_s - begun, 3),
            "battery_mv": snapshot.battery_mv,
            "latency_ms": snapshot.latency_ms,
        }
        for motor in snapshot.motors:
            row |= {f"{motor.port}_power_percent": motor.power, f"{motor.port}_angle_deg": motor.angle_deg}
        for port in snapshot.sensors:
            sensor = sensors.get(port.port)
            row[f"port{port.port}_raw"] = port.raw
            if sensor:
                row[f"port{port.port}_{column(sensor.quantity, sensor.unit)}"] = port.value
        table.write(row)
        yield snapshot


def _say_loss(error: str) -> None:
    write_error(f"{error} The monitor continues when the brick answers.")


def _named(words: list[str], brick: Brick) -> dict[int, QuantitySensor[Any]]:
    from nxtdrive.sensors.kinds import make_sensor

    sensors = {}
    for word in words:
        port, separator, kind = word.partition("=")
        if not separator or port not in ("1", "2", "3", "4"):
            wrong = f"has no port {port!r}: ports are 1 to 4" if separator else "is not PORT=KIND"
            raise ConfigError(f"--sensor {word} {wrong}.", remedy="Write it as in --sensor 4=ultrasonic.")
        if int(port) in sensors:
            raise ConfigError(f"--sensor names port {port} twice.", remedy="Name each port once.")
        sensors[int(port)] = make_sensor(kind, brick.link, int(port))  # type: ignore[arg-type]  # one of the four
    return sensors


def _print(snapshot: Snapshot, *, as_json: bool) -> None:
    if as_json:
        write_json(asdict(snapshot), indent=2)
        return
    make_console().print(_table(snapshot))


def _show(snapshots: Iterator[Snapshot]) -> None:
    from rich.live import Live

    from nxtdrive.tools.monitor import History

    console, history = make_console(), History()

    def view(snapshot: Snapshot) -> Table:
        history.add(snapshot)
        return _plots(snapshot, history, console)

    with Live(view(next(snapshots)), console=console, refresh_per_second=REDRAWS_PER_S) as live:
        for snapshot in snapshots:
            live.update(view(snapshot))


def _table(snapshot: Snapshot) -> Table:
    """Make a table with one row per port."""
    caption = f"battery {snapshot.battery_mv / 1000:.2f} V   link {snapshot.latency_ms:.1f} ms"
    table = make_table("port", "what", "reading", "raw", caption=caption)
    for motor in snapshot.motors:
        table.add_row(motor.port, f"motor, {motor.state}", f"power {motor.power} %, angle {motor.angle_deg}°", "")
    for sensor in snapshot.sensors:
        table.add_row(str(sensor.port), sensor.name, sensor.text, str(sensor.raw) if sensor.analog else "")
    return table


def _plots(snapshot: Snapshot, history: History, console: Console) -> Table:
    """Make a table with a line for each port and a plot of its latest readings below it."""
    from rich.table import Table

    from nxtdrive.tools.monitor import HISTORY_S

    power = f"battery {snapshot.battery_mv / 1000:.2f} V  link {snapshot.latency_ms:.1f} ms"
    caption = f"{power}  plots: last {HISTORY_S:.0f} s  Ctrl-C ends"
    table = Table(box=None, show_header=False, caption=caption, caption_justify="left")
    table.add_column(min_width=1, no_wrap=True, style="bold")
    table.add_column(no_wrap=True, overflow="ellipsis")
    lines = {each.port: f"{each.state}, power {each.power} %, angle {each.angle_deg}°" for each in snapshot.motors}
    for each in snapshot.sensors:
        raw = f"raw {each.raw}" if each.analog else ""
        lines[str(each.port)] = "  ".join(filter(None, [each.text, raw, each.name]))
    width = min(max(console.width - SCALE_WIDTH, 1), WIDEST_PLOT)
    for port, line in lines.items():
        plot = history.plot(port, width)
        table.add_row(
            port, f"{line}\n{_plot_line(plot, ASCII if console.options.ascii_only else BLOCKS)}" if plot else line
        )
    return table


def _plot_line(plot: Plot, signs: str) -> str:
    """Return a plot with a character for each part, followed by its scale."""
    levels = (None if height is None else round(height * (len(signs) - 1)) for height in plot.heights)
    drawn = "".join(" " if level is None else signs[level] for level in levels)
    return f"{drawn} {plot.lowest:g} to {plot.highest:g}"
