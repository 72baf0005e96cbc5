"""Entry point of the command line: finds the command, runs it, turns errors into a message and an exit code."""

from __future__ import annotations

import argparse
import importlib
import logging
import os
import sys
import traceback
from collections.abc import Container, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, cast

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
from firmware_protocol.printable import printable
from input_files.plain import InputFileError
from nxtdrive.cli.output import drop_output, finish_output, guarded_output, write_error, write_line
from nxtdrive.cli.parser import Help, Parser
from nxtdrive.signals import SIGNALLED, ignore_signals, signals_as_interrupt

if TYPE_CHECKING:
    from io import TextIOWrapper

PACKAGES = ("firmware_protocol", "input_files", "nxtdrive", "behaviors", "sim_backend")
DONE, NOT_ACHIEVED, USAGE, NO_BRICK, LINK_LOST, REFUSED, INCOMPLETE = range(7)
"""Exit codes, as `_EPILOG` and the README explain them."""

BUG = "This is a bug in nxtdrive. Please report it with this traceback, the command and the files it was given."
"""Added to the traceback of an error that is none of those above."""

BLAS_THREADS = "OPENBLAS_NUM_THREADS"
"""Environment variable with the number of threads of numpy's products, read when numpy is imported."""

COMMANDS = {
    "run": ("run", "run a mission: search, drive there, recover (default: the built-in mission, simulated)"),
    "web": ("web", "watch and drive the robot in the browser"),
    "teleop": ("teleop", "drive by hand in a terminal"),
    "mission": ("mission", "check, show and create mission files"),
    "world": ("world", "check, show and create simulated rooms"),
    "detect": ("detect", "try a detector on a picture, a video or a camera"),
    "calibrate": ("calibrate", "measure how the robot is built, and write it to a robot file"),
    "explain-run": ("explain_run", "explain the decisions of a run, one by one"),
    "what-if": ("what_if", "estimate what the other candidates of a decision would have cost"),
    "chances": ("chances", "count how often the recoveries chosen in runs succeeded"),
    "export": ("export", "write a run as a replay in one HTML file, as MCAP, CSV or video"),
    "list": ("list_bricks", "find bricks and print their addresses"),
    "doctor": ("doctor", "check computer and brick, and say how to fix what is wrong"),
    "info": ("info", "print name, firmware and battery of a brick"),
    "name": ("name", "print or change the name of a brick"),
    "monitor": ("monitor", "show motors, sensors, battery and link at a glance"),
    "motor": ("motor", "turn a motor for a time or by an angle, or stop it"),
    "sensor": ("sensor", "read or watch a sensor, identify what is plugged in"),
    "tone": ("tone", "play a tone on a brick"),
    "message": ("message", "write messages to mailboxes, and read them"),
    "screenshot": ("screenshot", "save a brick's display as an image"),
    "files": ("files", "list, download, upload and delete files on a brick"),
    "program": ("program", "start and stop programs on a brick"),
    "serve": ("serve", "serve the robot to your own agent, over TCP"),
    "mcp": ("mcp", "let an AI assistant use the robot, over the Model Context Protocol"),
    "sim": ("sim", "offer the simulated brick to other programs"),
    "send": ("send", "send one command of the NXT protocol and print the reply"),
    "explain": ("explain", "decode the bytes of a telegram"),
    "trace": ("trace", "show, compare and replay recorded traffic with a brick"),
    "sweep": ("sweep", "compare profiles on many simulated missions"),
    "bench": ("bench", "measure this machine: protocol, simulation, detectors, behaviors, motion"),
    "completion": ("completion", "print a script with which a shell completes commands and options"),
}
"""Command -> (module in `nxtdrive.cli.commands`, one line of help); a module is imported when its command is used."""


_EPILOG = """\
examples:
  nxtdrive run            # the built-in mission on the simulated brick
  nxtdrive run --help     # every command has examples

exit codes: 0 done, 1 mission not achieved, 2 usage, a bad file or profile, no such
camera, 3 no brick, 4 link not available, or link, camera or sensors lost,
5 the brick refused, 6 done, but the record of it (run folder, trace) is incomplete"""


class CommandModule(Protocol):
    """The interface of each command's module."""

    DESCRIPTION: str
    """A paragraph for ``--help``."""
    EXAMPLES: str
    """Lines shown under ``--help``, each a command that works."""

    def add_arguments(self, parser: argparse.ArgumentParser) -> None:
        """Declare the arguments, and the actions if there are any (see `nxtdrive.cli.options.add_action`)."""
        ...

    def run(self, args: argparse.Namespace) -> int:
        """Run a command that has no actions; returns the exit code."""
        ...


@guarded_output()
def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        argv: Arguments without the program's name; those of the process when None.

    Returns:
        The exit code.
    """
    os.environ.setdefault(BLAS_THREADS, "1")  # more threads wait in a loop, slow on a busy machine
    with suppress(AttributeError, OSError):  # there is none, it is not the process's, or it has been read from
        cast("TextIOWrapper", sys.stdin).reconfigure(errors="surrogateescape")
    with signals_as_interrupt() as first_signal:
        try:
            code = _reported(list(sys.argv[1:] if argv is None else argv))
        except KeyboardInterrupt:  # also one that arrives while an error is being reported
            code = SIGNALLED + first_signal()
        if argv is None:
            ignore_signals()  # the process is about to end
    return code


def _reported(arguments: Sequence[str]) -> int:
    """Run the command and turn an error into a message and an exit code."""
    args = argparse.Namespace(verbose=False)
    try:
        args = _parse_and_flush(arguments)
        return _run(args, arguments)
    except BrokenPipeError:
        # the reader of our output has closed it, as `head` does
        drop_output()
        return DONE
    except Exception as error:
        known = _raised_by_profile(error) or error
        code = exit_code(known)
        if code is None:
            error.add_note(_bug_note())
            raise
        with suppress(OSError):  # standard error cannot be written
            if args.verbose:
                traceback.print_exc()
            write_error(_sentence(known, args) if known is error else f"{known} -v shows the traceback.")
        with suppress(OSError, ConfigError):
            finish_output()
        return code


def _raised_by_profile(error: Exception) -> Exception | None:
    """Return an error that was raised in the code of an external profile, with its place in words."""
    registry = sys.modules.get("behaviors.profiles.registry")
    return None if registry is None or isinstance(error, NXTError) else registry.raised_by_profile(error)


def _bug_note() -> str:
    """Return whose bug an unknown error is, in words."""
    registry = sys.modules.get("behaviors.profiles.registry")
    if registry is None or not registry.external_profiles:
        return BUG
    names = registry.either(registry.external_profiles)
    return (
        f"This is a bug in the profile {names} or in nxtdrive. Show this traceback to the author of the profile first."
    )


def _parse_and_flush(arguments: Sequence[str]) -> argparse.Namespace:
    """Parse the arguments and flush what that has printed: help or the version."""
    try:
        return _parse(arguments)
    except SystemExit:
        finish_output()
        raise


def _run(args: argparse.Namespace, arguments: Sequence[str]) -> int:
    """Run the command and flush what it has printed."""
    trace = getattr(args, "trace", None)
    if trace:
        args.nxt = _recorded(args.nxt, trace, arguments)
    _log(verbose=args.verbose)
    code = cast("int", args.run(args))
    finish_output()
    if trace and code == DONE:
        from nxtdrive.transports.trace_file import incomplete

        return INCOMPLETE if trace in incomplete else DONE
    return code


def _sentence(error: Exception, args: argparse.Namespace) -> str:
    """Return the error with its remedy, in words."""
    if said := _overwritten(error):
        return said
    if isinstance(error, BrickNotFound) and str(getattr(args, "nxt", "")).startswith("usb:"):
        return f"{error} `nxtdrive doctor` looks for the cause."
    if isinstance(error, AddressError) and (usual := os.environ.get("NXT")) and usual == getattr(args, "nxt", None):
        return f"{error} The address comes from $NXT."
    if isinstance(error, NXTError):
        return str(error)
    match error:
        case OSError(filename=None):
            return f"standard output or a file cannot be used ({error.strerror or error}). -v shows which."
        case OSError():
            return f"{error.filename} cannot be used: {error.strerror}. Check the path, its owner and the free space."
        case MemoryError():
            return "there is not enough memory for it. Try smaller files."
        case RecursionError():
            return "something in the file or command is nested too deeply. Simplify it; -v shows where."
    return str(error)


def _recorded(address: str, trace: Path, arguments: Sequence[str]) -> str:
    """Return the address that opens `address` and records its traffic, and the command, to the file `trace`."""
    import shlex

    from nxtdrive.transports.record import recording_address

    command, left = [], iter(arguments)
    for word in left:
        if word in ("--nxt", "--trace"):
            next(left, None)
        elif not word.startswith(("--nxt=", "--trace=")):
            command.append(word)
    return recording_address(trace, address, shlex.join(command))


def _log(*, verbose: bool) -> None:
    """Send log messages to standard error; those of libraries only from warnings on."""
    handler = logging.StreamHandler()
    handler.setFormatter(_LogFormatter(verbose=verbose))
    logging.basicConfig(handlers=[handler])
    for package in PACKAGES:
        logging.getLogger(package).setLevel(logging.DEBUG if verbose else logging.WARNING)


def exit_code(error: Exception) -> int | None:
    """Return the exit code of a known error; None for a bug, which keeps its traceback."""
    # importing the module here would cost every command a third of a second
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
        case InputFileError() | OSError() | MemoryError() | RecursionError():
            return USAGE
    return None


def _overwritten(error: Exception) -> str:
    """Return the remedy if another distribution's package ``behaviors`` has replaced ours, else an empty string."""
    if not isinstance(error, ImportError) or (error.name or "").partition(".")[0] != "behaviors":
        return ""
    from importlib.metadata import packages_distributions

    from nxtdrive.host.environment import pip_command

    others = sorted(set(packages_distributions().get("behaviors", ())) - {"nxtdrive"})
    culprit = " and ".join(others) or "another package"
    return (
        f"{culprit} installed a package that is also called 'behaviors' and hides nxtdrive's ({error}). "
        f"Give nxtdrive a virtual environment of its own, or remove the other: {pip_command('uninstall', *others)}, "
        "and install nxtdrive again."
    )


def _parse(arguments: Sequence[str]) -> argparse.Namespace:
    parser = make_parser([word for word in arguments if word in COMMANDS][:1])
    args, unknown = parser.parse_known_args(arguments)
    if unknown:
        args.parser.reject(unknown)
    return args


def make_parser(named: Container[str]) -> argparse.ArgumentParser:
    """Make the parser of the command line; only the commands in `named` are imported and get their arguments."""
    parser = Parser(
        prog="nxtdrive",
        description="A LEGO MINDSTORMS NXT that searches for what you showed it and drives there.",
        epilog=_EPILOG,
        formatter_class=Help,
    )
    parser.add_argument("--version", action=_Version)
    parser.add_argument("-v", "--verbose", action="store_true", help="log what happens; show tracebacks")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for name, (module, summary) in COMMANDS.items():
        if name in named:
            _add_command(commands, name, module, summary)
        else:
            commands.add_parser(name, help=summary)
    return parser


def _add_command(commands: argparse._SubParsersAction[Parser], name: str, module: str, summary: str) -> None:
    command = cast("CommandModule", importlib.import_module(f"nxtdrive.cli.commands.{module}"))
    parser = commands.add_parser(
        name,
        help=summary,
        description=command.DESCRIPTION,
        epilog="examples:\n" + command.EXAMPLES,
        formatter_class=Help,
    )
    parser.add_argument("-v", "--verbose", action="store_true", default=argparse.SUPPRESS, help=argparse.SUPPRESS)
    parser.set_defaults(parser=parser)
    command.add_arguments(parser)
    _add_examples(parser, command.EXAMPLES.splitlines())
    if hasattr(command, "run"):
        parser.set_defaults(run=command.run)


def _add_examples(parser: argparse.ArgumentParser, examples: Sequence[str]) -> None:
    """Repeat a command's examples of each of its actions in that action's help."""
    for actions in parser._actions:
        if isinstance(actions, argparse._SubParsersAction):
            for action in actions.choices.values():
                if own := [line for line in examples if f"{line} ".startswith(f"  {action.prog} ")]:
                    action.epilog = "\n".join(["examples:", *own])
                    action.formatter_class = Help


class _LogFormatter(logging.Formatter):
    """Escapes messages; a traceback keeps its lines. Names our modules only if it is verbose."""

    def __init__(self, *, verbose: bool) -> None:
        super().__init__()
        self._verbose = verbose

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's name
        """Return the message's line."""
        ours = record.name.partition(".")[0] in PACKAGES
        sender = "nxtdrive: warning" if ours and not self._verbose else record.name
        return printable(f"{sender}: {record.message}")


class _Version(argparse.Action):
    """Prints the version."""

    def __init__(self, option_strings: Sequence[str], dest: str) -> None:
        super().__init__(option_strings, dest, nargs=0, help="print the version")

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print it and exit."""
        import nxtdrive

        write_line(f"nxtdrive {nxtdrive.__version__}")
        parser.exit()
