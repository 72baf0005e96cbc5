"""Arguments and helpers that several commands share."""

from __future__ import annotations

import argparse
import math
import os
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.errors import ConfigError
from input_files.plain import PICTURE_SUFFIXES
from nxtdrive.cli.output import write_error
from nxtdrive.host.writing import WRITABLE_FILE, writing

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.transports.address import Address

DEFAULT_ADDRESS = "sim://"

Run = Callable[[argparse.Namespace], int]
"""Runs a command or one of its actions; returns the exit code."""
T = TypeVar("T", int, float)

_DECIMAL_COMMA = re.compile(r"\s*[+-]?\d+,\d+\s*", re.ASCII)


def add_action(actions: Any, name: str, summary: str, run: Run) -> argparse.ArgumentParser:  # noqa: ANN401 - argparse's
    """Add an action to a command; its own help begins with its line in the list of actions."""
    description = f"{summary[0].upper()}{summary[1:]}."
    parser: argparse.ArgumentParser = actions.add_parser(name, help=summary, description=description)
    parser.set_defaults(run=run, parser=parser)
    return parser


def on_brick(action: Callable[[argparse.Namespace, Brick], int | None]) -> Run:
    """Make a command's function of an action that takes the open brick at ``--nxt``; its None counts as exit code 0."""

    def run(args: argparse.Namespace) -> int:
        from nxtdrive.brick import open_brick

        with open_brick(args.nxt) as brick:
            return action(args, brick) or 0

    return run


def note_simulated(brick: Brick) -> None:
    """Warn that what was changed on a brick is lost if it is the simulated one, which may not have been meant."""
    if brick.link.transport.address.startswith(DEFAULT_ADDRESS):
        text = (
            "this was the simulated brick, which starts afresh with each command. `nxtdrive list` finds others, and "
            "`nxtdrive sim serve` offers a simulated one that stays."
        )
        write_error(text, sender="note: ")


def warn_of_program(brick: Brick, consequence: str) -> None:
    """Warn of a program that runs on a brick, and of the consequence, which continues the sentence."""
    if name := brick.programs.running:
        write_error(f"warning: {name} is running on the brick {consequence}")


def warn_of_room(brick: Brick) -> None:
    """Warn of a simulated room in which the robot probably cannot succeed, before it tries for minutes."""
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.sim import simulated

    if transport := simulated(brick.link.transport):
        from nxtdrive.cli.views.room_warnings import room_warnings

        for warning in room_warnings(transport.simulation):
            write_error(f"warning: {Address.parse(transport.address).target}: {warning}")


def number(name: str, convert: Callable[[str], T], low: float, high: float) -> Callable[[str], T]:
    """Make a converter for argparse that refuses anything but a number from `low` to `high`.

    Args:
        name: What is counted or measured, for the message: ``seconds``.
        convert: `float`, or a function that makes a whole number of the text.
        low: Smallest value allowed.
        high: Largest value allowed; may be infinite, but the value may not.
    """
    kind = "a number" if convert is float else "a whole number"
    limits = f"from {low:.10g} to {high:.10g}" if math.isfinite(high) else f"of at least {low:.10g}"

    def read(text: str) -> T:
        try:
            value = convert(text)
            fits = math.isfinite(value) and low <= value <= high
        except (ValueError, OverflowError):
            fits = False
        if not fits:
            point = ". Write a decimal point, not a comma" if _DECIMAL_COMMA.fullmatch(text) else ""
            raise argparse.ArgumentTypeError(f"{name} must be {kind} {limits}, not {text!r}{point}")
        return value

    return read


tcp_port = number("port", int, 0, 65535)


def target_height_mm(text: str) -> float:
    """Convert an argument of argparse: the height of a target, as a mission may have it."""
    from behaviors.mission.targets import HEIGHT_MM

    return number("height in mm", float, *HEIGHT_MM)(text)


def marker_id(text: str) -> int:
    """Convert an argument of argparse: the number of a marker of the usual family."""
    from nxtdrive.vision.detectors.marker import DEFAULT_FAMILY, FAMILIES

    _, count = FAMILIES[DEFAULT_FAMILY]
    return number("id", int, 0, count - 1)(text)


def new_file(text: str) -> Path:
    """Convert an argument of argparse: the file of a new mission or world, whose name also goes into an address.

    One that ends as a picture's is refused, since ``--force`` would overwrite a photograph.
    """
    if not text.isprintable() or "?" in text or text.startswith("-") or not Path(text).name:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a valid name for it; use letters, digits, spaces, '.', '_' and, not at the beginning, '-'"
        )
    if Path(text).suffix.lower() in PICTURE_SUFFIXES:
        raise argparse.ArgumentTypeError(
            f"{text!r} is a picture's name. Name the file to write, FILE.toml; `nxtdrive mission new --picture {text} "
            "--height-mm MM` writes a mission that searches for what a picture shows"
        )
    return Path(text)


def output_file(text: str) -> Path:
    """Convert an argument of argparse: a file to write. A lone ``-`` is refused: it is not standard output here."""
    if text == "-":
        raise argparse.ArgumentTypeError("standard output is not possible here; name a file, ./- for one called '-'")
    return Path(text)


def write_output(path: Path, content: bytes, remedy: str = WRITABLE_FILE) -> None:
    """Write a file.

    Raises:
        ConfigError: It cannot be written, as on a full disk; an incomplete file is removed.
    """
    from nxtdrive.recording.output_file import write_file

    with writing(path, remedy):
        write_file(path, content)


def check_not_read(out: Path, *inputs: str | Path, option: str = "--out") -> None:
    """Refuse a file to write that is one of those to read.

    Raises:
        ConfigError: It is.
    """
    if os.path.exists(out) and any(os.path.exists(each) and os.path.samefile(each, out) for each in inputs):
        raise ConfigError(f"{out} cannot be written: the command reads it.", remedy=f"Choose another {option}.")


def check_writable(path: Path, remedy: str = WRITABLE_FILE) -> None:
    """Refuse a file that cannot be written, before minutes of work whose result goes there.

    Raises:
        ConfigError: It cannot.
    """
    new = not os.path.lexists(path)
    with writing(path, remedy):
        open(path, "ab").close()
        if new:
            path.unlink()


def add_brick_arguments(parser: argparse.ArgumentParser, default: str = DEFAULT_ADDRESS) -> None:
    """Add ``--nxt ADDRESS`` and ``--trace FILE``, which `nxtdrive.cli.main` handles."""
    parser.add_argument(
        "--nxt",
        metavar="ADDRESS",
        default=os.environ.get("NXT") or default,
        help="which brick: sim://, usb://, usb://0016530A1B2C, bt://00:16:53:0A:1B:2C, serial:///dev/rfcomm0, "
        "serial://COM5, tcp://host:port, nxt-server://host:port, replay://FILE.nxttrace; `nxtdrive list` finds some "
        f"(default: $NXT, else {default})",
    )
    parser.add_argument(
        "--trace", metavar="FILE", type=output_file, help="record the traffic with the brick, see `nxtdrive trace`"
    )


def mission_brick(args: argparse.Namespace) -> Address:
    """Return the address of the brick for a mission.

    It is that of ``--nxt``; a simulated one that names no room is in the room that was written with the mission.

    Raises:
        AddressError: The text of ``--nxt`` is not an address.
    """
    from nxtdrive.mission.files import in_own_room
    from nxtdrive.transports.address import Address

    return in_own_room(Address.parse(args.nxt), args.mission)


def add_robot_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--robot FILE``."""
    parser.add_argument(
        "--robot",
        metavar="FILE",
        type=Path,
        help="robot file, as `nxtdrive calibrate` writes it; keys of the mission's own [robot] and [camera] take "
        "precedence (default: the mission's robot_file, else $NXT_ROBOT)",
    )


def add_json_argument(parser: argparse.ArgumentParser) -> None:
    """Add ``--json``, output for programs."""
    parser.add_argument("--json", action="store_true", help="print JSON instead of text")


def add_profile_argument(parser: argparse.ArgumentParser, meaning: str) -> None:
    """Add ``--profile NAME``, also called ``--policy``."""
    named = "thesis, adaptive, an installed profile, or module:Class for a class in module.py of this folder"
    help_text = f"{meaning}; NAME is {named}"
    parser.add_argument("--profile", "--policy", metavar="NAME", type=_profile, choices=_Profiles(), help=help_text)


def _profile(text: str) -> str:
    if text.endswith(".py"):
        module = Path(text).stem
        raise argparse.ArgumentTypeError(f"'{text}' is a file; name the class, in the file's folder: {module}:CLASS")
    return text


class _Profiles:
    """The names that a profile can have."""

    def __contains__(self, name: object) -> bool:
        from behaviors.profile_names import profile_name

        try:
            return bool(profile_name(str(name)))
        except ValueError:
            return False

    def __iter__(self) -> Iterator[str]:
        from behaviors.profile_names import named_profiles

        yield from (*named_profiles(), "package.module:Class")
