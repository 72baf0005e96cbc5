"""``nxtdrive files``: the brick's file system."""

from __future__ import annotations

import argparse
import contextlib
import os
import sys
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import BrickError, ConfigError, LocalProtocolError
from firmware_protocol.status import Status
from firmware_protocol.wording import number_of
from input_files.plain import MEGABYTE, InputFileError, read_bytes
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, REFUSED, USAGE, exit_code
from nxtdrive.cli.options import (
    add_action,
    add_brick_arguments,
    add_json_argument,
    note_simulated,
    on_brick,
    output_file,
    write_output,
)
from nxtdrive.cli.output import make_console, write_error, write_json, write_line
from nxtdrive.cli.prompt import agrees, can_ask

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.onboard.files import Progress

DESCRIPTION = """\
List, download, upload and delete files on a brick. Names on the brick have at most
19 characters. Patterns are those of a shell (*, ?); quote them."""
EXAMPLES = """\
  nxtdrive files ls
  nxtdrive files ls "*.rxe" --nxt usb:// --json
  nxtdrive files get hello.rso --nxt usb://
  nxtdrive files put follow-line.rxe --replace --nxt usb://
  nxtdrive files put melody.rso --as alarm.rso --nxt usb://
  nxtdrive files rm "old*.rxe" --nxt usb://
  nxtdrive files df --nxt usb://"""

SYSTEM_SUFFIX = ".sys"
MAX_UPLOAD = MEGABYTE
"""The brick's flash is a quarter of it."""

LISTED = "`nxtdrive files ls` lists what is there."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions and their arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    ls = add_action(actions, "ls", "list files", on_brick(_ls))
    ls.add_argument("pattern", metavar="PATTERN", nargs="?", default="*", help="e.g. '*.rxe' (default: all)")
    get = add_action(actions, "get", "download a file", on_brick(_get))
    get.add_argument("name", metavar="NAME", help="on the brick")
    get.add_argument("--to", metavar="PATH", type=output_file, help="file or folder (default: the same name, here)")
    put = add_action(actions, "put", "upload files", on_brick(_put))
    put.add_argument("paths", metavar="PATH", nargs="+", type=Path, help="on this computer")
    put.add_argument("--as", dest="name", metavar="NAME", help="name on the brick (single file only)")
    put.add_argument("--replace", action="store_true", help="delete files of the same name first")
    rm = add_action(actions, "rm", "delete files", on_brick(_rm))
    rm.add_argument("--force", action="store_true", help="also delete system files (*.sys), without asking")
    rm.add_argument("patterns", metavar="PATTERN", nargs="+", help="a name, or a pattern such as 'old*.rxe'")
    df = add_action(actions, "df", "print free and used space", on_brick(_df))
    for action in (ls, get, put, rm, df):
        add_brick_arguments(action)
        add_json_argument(action)


def _ls(args: argparse.Namespace, brick: Brick) -> None:
    entries = brick.files.ls(args.pattern)
    if args.json:
        write_json([asdict(entry) for entry in entries], indent=2)
        return
    for entry in entries:
        write_line(f"{entry.size:>7}  {entry.name}")


def _get(args: argparse.Namespace, brick: Brick) -> None:
    target: Path = args.to or Path(args.name)
    if os.path.isdir(target):
        target = target / args.name

    with _progress(args.name) as progress:
        content = brick.files.read(args.name, progress)
    write_output(target, content, "Choose another file with --to.")
    _say(args, {"name": args.name, "size": len(content), "path": str(target)})


def _put(args: argparse.Namespace, brick: Brick) -> int:
    if args.name and len(args.paths) > 1:
        raise ConfigError("--as names a single file.", remedy="Send the files one by one.")
    for path in args.paths:
        try:
            content = read_bytes(path, MAX_UPLOAD)
        except InputFileError as error:
            raise ConfigError(str(error)) from None
        name = args.name or path.name
        try:
            with _progress(name) as progress:
                brick.files.write(name, content, progress, replace=args.replace)
        except BrickError as error:
            if error.status is not Status.FILE_EXISTS:
                raise
            write_error(f"{name} is already on the brick; --replace replaces it.")
            return REFUSED
        _say(args, {"name": name, "size": len(content), "path": str(path)})
    note_simulated(brick)
    return DONE


def _rm(args: argparse.Namespace, brick: Brick) -> int:
    code = DONE
    for pattern in args.patterns:
        wild = set(pattern) & set("*?[")
        names = [entry.name for entry in brick.files.ls(pattern)] if wild else [pattern]
        if not names:
            write_error(f"no file on the brick matches {pattern}; {LISTED}")
            code = code or NOT_ACHIEVED
        for name in names:
            try:
                _check_deletion(name, force=args.force)
                brick.files.delete(name)
            except (BrickError, ConfigError, LocalProtocolError) as error:
                missing = isinstance(error, BrickError) and error.status is Status.FILE_NOT_FOUND
                text = f"there is no file {name} on the brick; {LISTED}"
                write_error(text if missing else f"{name} is kept: {error}")
                code = code or exit_code(error) or USAGE
            else:
                _say(args, {"deleted": name})
    return code


def _check_deletion(name: str, *, force: bool) -> None:
    """Ask before deleting one of the brick's own files.

    Raises:
        ConfigError: The answer is no, or there is no terminal to ask in.
    """
    if force or not name.lower().endswith(SYSTEM_SUFFIX):
        return
    if not can_ask():
        raise ConfigError("it is a system file of the brick.", remedy="Add --force to delete it.")
    if not agrees(f"{name} is a system file of the brick. Delete it?"):
        raise ConfigError("deletion was not confirmed.", remedy="Answer y to delete it, or add --force.")


def _df(args: argparse.Namespace, brick: Brick) -> None:
    sizes = [entry.size for entry in brick.files.ls()]
    free = brick.files.free_bytes
    if args.json:
        write_json({"free_bytes": free, "files": len(sizes), "used_bytes": sum(sizes)})
    else:
        write_line(f"{free} bytes free; {number_of(len(sizes), 'file')} with {sum(sizes)} bytes")


def _say(args: argparse.Namespace, what: dict[str, object]) -> None:
    if args.json:
        write_json(what)
    elif "deleted" in what:
        write_line(f"deleted {what['deleted']}")
    else:
        write_line(f"{what['name']}: {what['size']} bytes, {what['path']}")


@contextlib.contextmanager
def _progress(name: str) -> Iterator[Progress | None]:
    """Show a progress bar if standard error is a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Bars(*columns, console=make_console(stderr=True), transient=True) as bars:
        task = bars.add_task(name, total=None)
        yield lambda done, total: bars.update(task, completed=done, total=total)
