"""``nxtdrive send``: sends one command of the protocol, by name."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import LocalProtocolError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_brick_arguments, add_json_argument
from nxtdrive.cli.output import write_json, write_line, write_text

if TYPE_CHECKING:
    from firmware_protocol.catalog import AnyCommand
    from firmware_protocol.telegram import Command
    from nxtdrive.brick import Brick

DESCRIPTION = """\
Send a command and print the reply field by field. Fields are given as
field=value; numbers may be hexadecimal (0x20), named values go by name and
flags are joined by |; bytes are hex digits or text:WORDS. Nothing is undone
afterwards: a motor that was started keeps running."""
EXAMPLES = """\
  nxtdrive send --list
  nxtdrive send GetBatteryLevel
  nxtdrive send PlayTone frequency_hz=440 duration_ms=500 --nxt usb://
  nxtdrive send GetOutputState port=B --json"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("name", metavar="NAME", nargs="?", help="name of the command; case does not matter")
    parser.add_argument(
        "fields", metavar="field=value", nargs="*", help="its fields; after a mistake the usage is shown"
    )
    parser.add_argument("--list", action="store_true", help="print all commands with their fields and exit")
    parser.add_argument("--no-reply", action="store_true", help="request no reply")
    add_brick_arguments(parser)
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Build the telegram, send it, print the reply."""
    from firmware_protocol.build import build
    from nxtdrive.brick import open_brick

    if args.list:
        return _list(args.json)
    if args.name is None:
        raise LocalProtocolError("no command given.", remedy="`nxtdrive send --list` prints all of them.")
    command = build(args.name, args.fields)
    with open_brick(args.nxt) as brick:
        _require_known(type(command), brick)
        if args.no_reply:
            brick.link.send(command)
            return _sent(command, args.json)
        reply = brick.request(command)
    return _replied(type(command).encode_reply(reply), args.json)


def _require_known(command: AnyCommand, brick: Brick) -> None:
    """Refuse a command that the brick's firmware does not have; it answers some of them with meaningless bytes."""
    from firmware_protocol.system import GetVersions
    from firmware_protocol.telegram import OLDEST

    if command.since == OLDEST:
        return
    firmware = brick.request(GetVersions()).firmware
    if firmware < command.since:
        raise LocalProtocolError(
            f"the brick's firmware {firmware} does not have {command.__name__}.",
            remedy=f"Firmware {command.since} and later have it; `nxtdrive send --list` prints all commands.",
        )


def _list(as_json: bool) -> int:
    from firmware_protocol.build import usage
    from firmware_protocol.catalog import ALL_COMMANDS

    if as_json:
        write_json([_declaration(command) for command in ALL_COMMANDS], indent=2)
        return DONE
    for command in ALL_COMMANDS:
        write_line(usage(command).removeprefix("Usage: ").removesuffix("."))
    return DONE


def _declaration(command: AnyCommand) -> dict[str, object]:
    from firmware_protocol.catalog import choices, describe

    layout = command.layout
    return {
        "name": command.__name__,
        "kind": command.kind.name.lower(),
        "opcode": command.opcode,
        "fields": [
            {"name": name, "type": describe(wire, layout.units[name]), "choices": choices(wire)}
            for name, wire in layout.wires.items()
        ],
    }


def _sent(command: Command[Any], as_json: bool) -> int:
    telegram = command.encode(want_reply=False)
    if as_json:
        write_json({"sent": telegram.hex()})
    else:
        write_line(f"sent {telegram.hex(' ')}")
    return DONE


def _replied(telegram: bytes, as_json: bool) -> int:
    from firmware_protocol.explain import explain
    from nxtdrive.cli.views.telegram import as_json as explanation_as_json

    explanation = explain(telegram)
    if as_json:
        write_json(explanation_as_json(explanation), indent=2)
    else:
        write_text(explanation)
    return DONE
