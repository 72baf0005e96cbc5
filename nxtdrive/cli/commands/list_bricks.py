"""``nxtdrive list``: finds bricks and prints their addresses."""

from __future__ import annotations

import argparse
import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING

from firmware_protocol.errors import LinkBusy, NXTError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import DEFAULT_ADDRESS, add_json_argument
from nxtdrive.cli.output import write_json, write_line

if TYPE_CHECKING:
    from serial.tools.list_ports_common import ListPortInfo

DESCRIPTION = """\
List the bricks on USB, those paired over Bluetooth (Linux), the serial ports a
paired brick may be behind, and the simulated brick, as addresses for --nxt. Only
bricks on USB are asked for their names: a paired brick may be off, and a port does not
show which brick is behind it; `nxtdrive info --nxt ADDRESS` does."""
EXAMPLES = """\
  nxtdrive list
  nxtdrive list --json"""

_BLUETOOTH = re.compile(r"rfcomm|bthenum|bluetooth|(tty|cu)\.nxt|001653", re.IGNORECASE)
"""Names of Bluetooth serial ports on Linux, Windows and macOS; 00:16:53 is LEGO's address block."""


@dataclass(frozen=True, slots=True)
class ListedAddress:
    """An address at which a brick is or may be.

    Attributes:
        address: For ``--nxt``.
        what: Description for people.
    """

    address: str
    what: str


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Print the addresses; what cannot be searched is reported as a note and is not a failure."""
    found, notes = find_addresses()
    if args.json:
        write_json({"bricks": [asdict(each) for each in found], "notes": notes}, indent=2)
        return DONE
    width = max(len(each.address) for each in found)
    for each in found:
        write_line(f"{each.address:<{width}}  {each.what}")
    for note in notes:
        write_line(f"note: {note}")
    return DONE


def find_addresses() -> tuple[list[ListedAddress], list[str]]:
    """Return all addresses, the most certain first, and notes about what could not be searched."""
    found: list[ListedAddress] = []
    notes: list[str] = []
    for search in (_on_usb, _paired):
        try:
            found += search()
        except NXTError as error:
            notes.append(str(error))
    found += _behind_serial_ports()
    found.append(ListedAddress(DEFAULT_ADDRESS, "the simulated brick"))
    return found, notes


def _on_usb() -> Iterator[ListedAddress]:
    from nxtdrive.transports.usb_port import UsbTransport

    for address in UsbTransport.discover():
        if address == "usb://":
            yield ListedAddress(address, "brick on USB that this user may not open")
        else:
            yield ListedAddress(address, f"brick on USB{_name(address)}")


def _name(address: str) -> str:
    """Return what to add to the description of a brick on USB: its name, or why it could not be asked."""
    from nxtdrive.brick import open_brick

    try:
        with open_brick(address) as brick:
            return f", called {brick.name}"
    except LinkBusy:
        return ", in use by another program"
    except NXTError:
        return ", but it does not answer"


def _paired() -> Iterator[ListedAddress]:
    from nxtdrive.transports.pairing import paired_bricks

    for mac, name in sorted(paired_bricks().items()):
        yield ListedAddress(f"bt://{mac}", f"paired LEGO brick {name}".strip())


def _behind_serial_ports() -> Iterator[ListedAddress]:
    from serial.tools.list_ports import comports

    ports = sorted(comports(), key=lambda port: (not _looks_like_bluetooth(port), port.device))
    for port in ports:
        kind = "Bluetooth serial port, perhaps a paired brick" if _looks_like_bluetooth(port) else "serial port"
        named = port.description and port.description not in ("n/a", port.device, port.name)
        yield ListedAddress(f"serial://{port.device}", f"{kind} ({port.description})" if named else kind)


def _looks_like_bluetooth(port: ListPortInfo) -> bool:
    return bool(_BLUETOOTH.search(f"{port.device} {port.description} {port.hwid}"))
