"""The command line's entrance: finds the command, runs it, turns errors into one sentence and an exit code.

Exit codes: 0 done, 1 mission not achieved, 2 usage or a bad file, 3 no brick, 4 link lost or not to be had, 5 the brick
refused, 6 mission achieved, but its record is incomplete.
"""

from __future__ import annotations

import argparse
import importlib
import logging
import sys
from collections.abc import Sequence
from typing import NoReturn, Protocol, cast

from firmware_protocol.errors import (
    AddressError,
    BrickBusy,
    BrickError,
    BrickNotFound,
    CameraError,
    ConfigError,
    LinkError,
    LocalProtocolError,
    NXTError,
    PermissionDenied,
)
from nxtdrive.cli.output import drop_output

DONE, NOT_ACHIEVED, USAGE, NO_BRICK, LINK_LOST, REFUSED, INCOMPLETE = range(7)
"""Exit codes."""

INTERRUPTED = 130
"""Exit code of a command that Ctrl-C ended and that had nothing to report; 128 + SIGINT, as shells have it."""

COMMANDS = {
    "run": ("run", "run a mission: search, drive there, recover (the default is the built-in one, simulated)"),
    "explain-run": ("explain_run", "say why the robot did what it did in a run, decision by decision"),
    "serve": ("serve", "serve the robot to an agent of your own, over TCP"),
    "list": ("list_bricks", "find bricks and print their addresses"),
    "info": ("info", "name, firmware and battery of a brick"),
    "motor": ("motor", "turn a motor for a time or by an angle, or stop it"),
    "explain": ("explain", "say what the bytes of a telegram mean"),
    "trace": ("trace", "look at recorded conversations with a brick, compare and replay them"),
    "files": ("files", "list, fetch, send and delete files on a brick"),
    "program": ("program", "start and stop programs on a brick"),
    "send": ("send", "send any declared command and print the reply"),
    "doctor": ("doctor", "examine computer and brick, and say what to do"),
    "sensor": ("sensor", "read or watch a sensor, ask who is plugged in"),
    "monitor": ("monitor", "motors, sensors, battery and link at a glance"),
    "teleop": ("teleop", "drive by hand in a terminal"),
    "tone": ("tone", "play a tone on a brick"),
    "message": ("message", "put messages into mailboxes, and take them"),
    "screenshot": ("screenshot", "save what a brick's display shows as an image"),
    "mission": ("mission", "check a mission file, show how missions run"),
    "detect": ("detect", "try a detector on a picture, a video or a camera"),
    "sim": ("sim", "serve the simulated brick to other programs"),
    "sweep": ("sweep", "compare policies on many simulated missions"),
    "bench": ("bench", "measure this machine: protocol, simulation, detectors, doors, mind, motion"),
}
"""Command -> (module in this package, one line of help); a module is imported when its command is used."""


_EPILOG = """\
examples:
  nxtdrive run            # the built-in mission on the simulated brick
  nxtdrive run --help     # every command has examples

exit codes: 0 done, 1 mission not achieved, 2 usage or a bad file, 3 no brick,
4 link, camera or sensors lost or not to be had, 5 the brick refused,
6 mission achieved, but its record is incomplete"""


class CommandModule(Protocol):
    """What a module of this package offers."""

    DESCRIPTION: str
    """A paragraph for ``--help``."""
    EXAMPLES: str
    """Lines shown under ``--help``, each a command that works."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the command's arguments."""
        ...

    def run(self, args: argparse.Namespace) -> int:
        """Do it; returns the exit code."""
        ...


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: Arguments without the program's name; those of the process when None.

    Returns:
        The exit code.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    verbose = on_usb = False
    try:
        args = _parse(arguments)
        on_usb = str(getattr(args, "nxt", "")).startswith("usb:")
        if getattr(args, "trace", None):
            args.nxt = _recorded(args.nxt, args.trace, arguments)
        verbose = args.verbose
        _log(verbose=verbose)
        return cast("int", args.run(args))
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # the reader of our output went away, as `head` does; nothing is left to say
        drop_output()
        return DONE
    except Exception as error:
        code = _exit_code(error)
        if verbose or code is None:
            raise
        further = " `nxtdrive doctor` looks for the cause." if isinstance(error, BrickNotFound) and on_usb else ""
        print(f"nxtdrive: {_overwritten(error) or error}{further}", file=sys.stderr)
        return code


def _recorded(address: str, trace: str, arguments: Sequence[str]) -> str:
    """The address that opens `address` and records to the file `trace` what is said; it notes the command as well."""
    import shlex
    from pathlib import Path

    from nxtdrive.transports.record import recording_address

    command, left = [], iter(arguments)
    for word in left:
        if word in ("--nxt", "--trace"):
            next(left, None)
        elif not word.startswith(("--nxt=", "--trace=")):
            command.append(word)
    return recording_address(Path(trace), address, shlex.join(command))


def _log(*, verbose: bool) -> None:
    """Send log messages to standard error; the libraries' only when they warn."""
    logging.basicConfig(format="%(name)s: %(message)s")
    for room in ("firmware_protocol", "nxtdrive", "behaviors", "sim_backend"):
        logging.getLogger(room).setLevel(logging.DEBUG if verbose else logging.WARNING)


def _exit_code(error: Exception) -> int | None:
    """The exit code of an error we know; None for a fault of ours, which deserves its traceback."""
    # imported here, the mission file's reader would cost every command a third of a second
    missions = sys.modules.get("behaviors.mission")
    if (missions and isinstance(error, missions.MissionError)) or _overwritten(error):
        return USAGE
    match error:
        case BrickNotFound() | PermissionDenied():
            return NO_BRICK
        case LinkError():
            return LINK_LOST
        case BrickError() | BrickBusy():
            return REFUSED
        case AddressError() | ConfigError() | CameraError() | LocalProtocolError():
            return USAGE
        case NXTError():
            return LINK_LOST
    return None


def _overwritten(error: Exception) -> str:
    """What to do when another distribution's package ``behaviors`` stands in the place of ours; else nothing."""
    if not isinstance(error, ImportError) or (error.name or "").partition(".")[0] != "behaviors":
        return ""
    from importlib.metadata import packages_distributions

    others = sorted(set(packages_distributions().get("behaviors", ())) - {"nxtdrive"})
    culprit = " and ".join(others) or "another package"
    return (
        f"{culprit} brought a package that is also called 'behaviors' and hides the one of nxtdrive ({error}). "
        f"Mend it: pip uninstall {' '.join(others) or 'that package'}, "
        "then pip install --force-reinstall --no-deps nxtdrive; or give nxtdrive a virtual environment of its own."
    )


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = _Parser(
        prog="nxtdrive",
        description="A LEGO MINDSTORMS NXT that searches for what you showed it and drives there.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action=_Version)
    parser.add_argument("-v", "--verbose", action="store_true", help="log what happens; show tracebacks")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    named = next((word for word in arguments if word in COMMANDS), None)
    for name, (module, summary) in COMMANDS.items():
        if name == named:
            _add_command(commands, name, module, summary)
        else:
            commands.add_parser(name, help=summary)
    args, unknown = parser.parse_known_args(arguments)
    if unknown:
        commands.choices[args.command].error(f"unrecognized arguments: {' '.join(unknown)}")
    return args


def _add_command(commands: argparse._SubParsersAction[_Parser], name: str, module: str, summary: str) -> None:
    command = cast("CommandModule", importlib.import_module(f"nxtdrive.cli.{module}"))
    parser = commands.add_parser(
        name,
        help=summary,
        description=command.DESCRIPTION,
        epilog="examples:\n" + command.EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-v", "--verbose", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    command.add_arguments(parser)
    if parser.get_default("run") is None:
        parser.set_defaults(run=command.run)


class _Parser(argparse.ArgumentParser):
    """A parser whose mistakes say where help is."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong and leave."""
        super().error(f"{message}\n`{self.prog} --help` explains it.")


class _Version(argparse.Action):
    """Prints the version; reads the package's metadata only when asked, it is slow to import."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="print the version")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it and leave."""
        from importlib.metadata import version

        print(f"nxtdrive {version('nxtdrive')}")
        parser.exit()


if __name__ == "__main__":
    sys.exit(main())
