"""``nxtdrive world``: checks a simulated room, draws it, writes a new one."""

from __future__ import annotations

import argparse
import os
import shlex
import shutil
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, USAGE
from nxtdrive.cli.options import add_action, add_json_argument, check_not_read, new_file, write_output
from nxtdrive.cli.output import CONTINUED, report_findings, write_line, write_text

if TYPE_CHECKING:
    from nxtdrive.mission.checking import Findings

DESCRIPTION = """\
Name the simulated rooms that sim:// opens, check your own, draw one with all its
objects, write a commented room to start from, or list all tables and keys."""
EXAMPLES = """\
  nxtdrive world list                    # the rooms that come with nxtdrive
  nxtdrive world show arena              # the room of `nxtdrive run`
  nxtdrive world new my-room.toml
  nxtdrive world check my-room.toml
  nxtdrive world show my-room.toml --out my-room.png
  nxtdrive world keys                    # what a room can have"""

TEMPLATE = "room"
"""The bundled world that a new one starts as."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the actions."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    add_action(actions, "list", "name the rooms that come with nxtdrive", _list)
    check = add_action(actions, "check", "report every mistake in world files at once", _check)
    check.add_argument("files", metavar="FILE", nargs="+", help="world files, *.toml, or names of bundled worlds")
    add_json_argument(check)
    show = add_action(actions, "show", "draw a room: as text, or with --out as an image", _show)
    show.add_argument("file", metavar="FILE", nargs="?", default="arena", help="default: the room of `nxtdrive run`")
    show.add_argument("--out", metavar="IMAGE", type=Path, help="a PNG or JPEG file to write")
    add_action(actions, "keys", "list all tables and keys of a world file, with defaults and meaning", _keys)
    new = add_action(actions, "new", "write a commented world file", _new)
    new.add_argument("file", metavar="FILE", type=new_file, help="a new file, such as my-room.toml")
    new.add_argument("--force", action="store_true", help="overwrite a file that exists")


def _list(_args: argparse.Namespace) -> int:
    from sim_backend.bundled import world_names
    from sim_backend.world.loading import load_world

    for name in world_names():
        write_line(f"{name:<12} {load_world(name).title}")
    return DONE


def _keys(_args: argparse.Namespace) -> int:
    from nxtdrive.cli.views.world_keys import world_keys

    write_text(world_keys())
    return DONE


def _check(args: argparse.Namespace) -> int:
    found = {file: _examined(file) for file in args.files}
    report_findings(found, as_json=args.json)
    return USAGE if any(each.mistakes for each in found.values()) else DONE


def _examined(file: str) -> Findings:
    """Check a world, image files included."""
    from nxtdrive.cli.views.room_warnings import room_warnings
    from nxtdrive.mission.checking import Findings
    from sim_backend.simulation import Simulation
    from sim_backend.world.loading import load_world

    try:
        simulation = Simulation(load_world(file, read_images=True))
        simulation.webcam.frame()
    except ConfigError as error:
        head, *rest = str(error).split(CONTINUED)
        return Findings(mistakes=rest or [head])
    return Findings(warnings=list(room_warnings(simulation)))


def _show(args: argparse.Namespace) -> int:
    from nxtdrive.cli.views.room_drawing import draw
    from nxtdrive.cli.views.room_sketch import sketch
    from nxtdrive.drawing.sheet import encoded
    from sim_backend.world.loading import image_files, load_world

    world = load_world(args.file)
    if args.out is None:
        write_text(sketch(world, shutil.get_terminal_size().columns if sys.stdout.isatty() else None))
        return DONE
    check_not_read(args.out, *image_files(world))
    write_output(args.out, encoded(draw(world), args.out))
    write_line(args.out)
    return DONE


def _new(args: argparse.Namespace) -> int:
    from nxtdrive.transports.address import Address
    from sim_backend.bundled import WORLDS

    if args.file.parent == Path() and os.path.isfile(WORLDS / f"{args.file}.toml"):
        raise ConfigError(f"{args.file} is the name of a bundled world.", remedy=f"Write {args.file}.toml.")
    if os.path.lexists(args.file) and not args.force:
        raise ConfigError(f"{args.file} exists already.", remedy="Choose another name, or --force to overwrite it.")
    write_output(args.file, (WORLDS / f"{TEMPLATE}.toml").read_bytes())
    write_line(f"Wrote {args.file}, a room with lena and rilakkuma. Draw it, change it, check it, and run in it:")
    file = shlex.quote(str(args.file))
    write_line(f"  nxtdrive world show {file}")
    write_line(f"  nxtdrive world check {file}")
    write_line(f"  nxtdrive run --profile adaptive --nxt {shlex.quote(str(Address('sim', str(args.file))))}")
    return DONE
