"""``nxtdrive explain``: what the bytes of telegrams mean."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument
from nxtdrive.cli.output import write_json, write_text

DESCRIPTION = """\
Decode a telegram field by field. It may be a request or a reply, with or without
the Bluetooth length prefix; unknown and incomplete telegrams are decoded as far
as possible."""
EXAMPLES = """\
  nxtdrive explain 00 0b
  nxtdrive explain 02 0b 00 40 1f
  nxtdrive explain 0x00,0x04,0x01,0x64,0x07,0x01,0x00,0x20,0x68,0x01,0x00,0x00
  nxtdrive explain - --json < telegrams.txt      # one telegram per line"""

STANDARD_INPUT = "-"
_SEPARATORS = re.compile(r"0x|\\x|[\s,:;-]+", re.IGNORECASE)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("hex", metavar="HEX", nargs="+", help="the bytes of one telegram, or - to read one per line")
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Explain each telegram as soon as it is read."""
    from firmware_protocol.explain import explain
    from nxtdrive.cli.views.telegram import as_json

    for text in _telegrams(args.hex):
        explanation = explain(parse_hex(text))
        if args.json:
            write_json(as_json(explanation), flush=True)
        else:
            write_text(explanation, flush=True)
    return DONE


def parse_hex(text: str) -> bytes:
    r"""Return the bytes written in `text`, as ``00 0b``, ``000B``, ``0x00, 0x0b``, ``00:0b`` or ``\x00\x0b``.

    Raises:
        ConfigError: The text contains something else.
    """
    digits = _SEPARATORS.sub("", text)
    try:
        return bytes.fromhex(digits)
    except ValueError:
        problem = "has an odd number of digits" if re.fullmatch(r"[0-9a-fA-F]*", digits) else "is not hexadecimal"
    raise ConfigError(f"{text!r} {problem}.", remedy="A byte is two hex digits: 00 0b.")


def _telegrams(words: list[str]) -> Iterator[str]:
    if words != [STANDARD_INPUT]:
        yield " ".join(words)
        return
    for line in sys.stdin:
        if line.strip():
            yield line.strip()
