"""``nxtdrive sim record``: records a conversation with a brick, in the format that ``nxtdrive sim check`` replays."""

from __future__ import annotations

import argparse
import json
import shlex
from contextlib import closing, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import AddressError, ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, check_not_read, check_writable, output_file, write_output
from nxtdrive.cli.output import write_line
from nxtdrive.signals import held
from sim_backend.firmware.versions import FIRMWARES

if TYPE_CHECKING:
    from nxtdrive.tools.conformance.recorder import BenchPeer
    from nxtdrive.transports.address import Address


def add_record_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument(
        "script",
        metavar="SCRIPT",
        type=Path,
        help="one telegram in hex, command or !tick MS per line; # begins a comment",
    )
    parser.add_argument(
        "--out", metavar="FILE.jsonl", type=output_file, help="the recording (default: the script's name with .jsonl)"
    )
    parser.add_argument("--scenario", metavar="NAME", help="what to call it (default: the script's name)")
    parser.add_argument("--about", metavar="TEXT", help="what it is about, such as where the firmware comes from")
    parser.add_argument(
        "--allow-writes",
        action="store_true",
        help="also send commands that delete, write or format, rename the brick, change its settings or are unknown",
    )
    parser.add_argument(
        "--with-identity",
        action="store_true",
        help="keep names and addresses of the brick and other devices, and the screen; otherwise they are blanked",
    )
    add_brick_arguments(parser)


def record(args: argparse.Namespace) -> int:
    """Send the script's lines and write what the brick replies.

    Raises:
        ConfigError: The script has a mistake, or the recording cannot be written.
        NXTError: The brick cannot be opened or is lost; what was recorded until then is written.
    """
    from nxtdrive.tools.conformance.recorder import Anonymizer, TransportPeer, ask_identity, record_conversation, stop
    from nxtdrive.tools.conformance.script import read_script
    from nxtdrive.transports import open_transport
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.record import brick_address

    lines = read_script(args.script, allow_writes=args.allow_writes)
    out = args.out or Path(f"{args.script.stem}.jsonl")
    check_not_read(out, args.script)
    check_writable(out)
    address, records = Address.parse(args.nxt), list[dict[str, Any]]()
    bench = _bench(address)
    with nullcontext() if bench else closing(open_transport(address)) as transport:
        peer = bench or TransportPeer(transport)
        try:
            real = transport is not None and not transport.simulated
            anonymizer = Anonymizer(ask_identity(peer)) if real and not args.with_identity else None
            about = args.about or f"a brick over {brick_address(address).scheme}"
            for line in record_conversation(peer, lines, args.scenario or args.script.stem, about, anonymizer):
                records.append(line)  # one by one: an error or a signal must not lose them
        finally:
            with held():
                if transport is not None:
                    stop(transport)
                if records:
                    write_output(out, "".join(json.dumps(each) + "\n" for each in records).encode())
    firmware = records[0]["firmware"]
    write_line(f"{out}: {len(records)} steps with firmware {firmware}")
    if firmware not in FIRMWARES:
        command = f"nxtdrive sim check {shlex.quote(str(out))} --firmware {FIRMWARES[0]}"
        write_line(f"To compare it, name a similar firmware: {command}")
    return DONE


def _bench(address: Address) -> BenchPeer | None:
    """Return the bench of `nxtdrive sim check` for ``sim://``, alone or with a firmware; None for other addresses."""
    from nxtdrive.tools.conformance.recorder import BenchPeer
    from nxtdrive.transports.record import brick_address

    brick = brick_address(address)
    if brick.scheme != "sim" or brick.target or brick.options.keys() - {"firmware"}:
        return None
    if brick != address:
        raise ConfigError(
            f"{brick} is a bench here, without a link whose traffic --trace could record.",
            remedy="Leave out --trace, or name a room: --nxt sim://arena.",
        )
    firmware = brick.options.get("firmware", FIRMWARES[0])
    if firmware not in FIRMWARES:
        raise AddressError(
            f"{address}: there is no simulated firmware {firmware!r}.", remedy=f"Choose from {', '.join(FIRMWARES)}."
        )
    return BenchPeer(firmware)
