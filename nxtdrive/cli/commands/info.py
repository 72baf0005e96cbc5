"""``nxtdrive info``: name, versions and state of a brick."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from nxtdrive.cli.options import add_brick_arguments, add_json_argument, on_brick
from nxtdrive.cli.output import write_json, write_line

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Ask a brick for its name, addresses, versions, battery, free flash and sleep
time. If this works, everything between this computer and the brick does."""
EXAMPLES = """\
  nxtdrive info
  nxtdrive info --nxt usb://
  nxtdrive info --nxt serial:///dev/rfcomm0 --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_brick_arguments(parser)
    add_json_argument(parser)
    parser.set_defaults(run=on_brick(_print_info))


def _print_info(args: argparse.Namespace, brick: Brick) -> None:
    from dataclasses import asdict

    from firmware_protocol.direct import KeepAlive
    from nxtdrive.brick import LOW_BATTERY_MV

    info = brick.info()
    sleep_s = brick.request(KeepAlive()).sleep_ms / 1000
    address, latency_s = brick.link.transport.address, brick.link.latency_s
    if args.json:
        write_json({"address": address, **asdict(info), "sleep_s": sleep_s, "latency_s": latency_s}, indent=2)
        return
    weak = ", low: charge it" if info.battery_mv < LOW_BATTERY_MV else ""
    rows = {
        "address": address,
        "name": info.name,
        "Bluetooth": info.bluetooth_address,
        "firmware": info.firmware,
        "protocol": info.protocol,
        "battery": f"{info.battery_mv / 1000:.2f} V{weak}",
        "free flash": f"{info.free_flash} bytes",
        "round trip": f"{latency_s * 1000:.1f} ms",
        "sleeps": f"after {sleep_s / 60:g} min without a keep-alive" if sleep_s else "never",
    }
    for label, value in rows.items():
        write_line(f"{label:<10}  {value}")
