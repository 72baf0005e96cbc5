"""``nxtdrive mission``: checks a mission file, shows what it does, writes a new one."""

from __future__ import annotations

import argparse
import os
import shlex
import sys
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from firmware_protocol.printable import printable
from nxtdrive.cli.main import DONE, USAGE
from nxtdrive.cli.options import (
    add_action,
    add_json_argument,
    add_robot_argument,
    marker_id,
    new_file,
    target_height_mm,
    write_output,
)
from nxtdrive.cli.output import report_findings, write_json, write_line, write_text

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.cli.templates.target import TemplateTarget

DESCRIPTION = """\
Check mission files, show a mission's parameters and its statechart, or write
a commented file to start from, with a simulated room to try it in."""
EXAMPLES = """\
  nxtdrive mission show                  # the built-in mission
  nxtdrive mission show --diagram        # its statechart, for Mermaid
  nxtdrive mission new my.toml           # every key explained, and a room
  nxtdrive mission new --picture my-cat.jpg --height-mm 297
  nxtdrive mission new --marker 7        # with the sheet to print
  nxtdrive mission check my.toml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the three subcommands."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    check = add_action(actions, "check", "report every mistake in mission files at once", _check)
    check.add_argument("files", metavar="FILE", nargs="+", type=Path, help="mission files, *.toml")
    add_robot_argument(check)
    add_json_argument(check)
    show = add_action(actions, "show", "print a mission's parameters and its statechart", _show)
    show.add_argument("file", metavar="FILE", nargs="?", type=Path, help="without it, the built-in mission")
    show.add_argument("--diagram", action="store_true", help="print the statechart as a Mermaid diagram instead")
    add_robot_argument(show)
    add_json_argument(show)
    new = add_action(actions, "new", "write a commented mission file, and a simulated room in which it succeeds", _new)
    new.add_argument(
        "file",
        metavar="FILE",
        nargs="?",
        type=new_file,
        help="the mission (default: my-mission.toml, or the target's name); the room of cat.toml is cat-world.toml",
    )
    target = new.add_mutually_exclusive_group()
    target.add_argument(
        "--picture",
        metavar="IMAGE",
        action=_StoreOnce,
        type=Path,
        help="look for what this photograph shows, if it is flat",
    )
    target.add_argument(
        "--marker",
        metavar="ID",
        action=_StoreOnce,
        type=marker_id,
        help="look for this ArUco marker (0 to 49, dictionary 4x4_50), and write the sheet to print",
    )
    target.add_argument(
        "--qr",
        metavar="TEXT",
        action=_StoreOnce,
        help="look for a QR code with this text, and write the sheet to print",
    )
    new.add_argument(
        "--height-mm",
        metavar="MM",
        type=target_height_mm,
        help="its real height, 10 to 3000. Measure that of what a photograph shows: A4 portrait is 297, A4 "
        "landscape 210, A5 portrait 210; a marker is printed 150 mm high and a QR code 160 unless you say so",
    )
    new.add_argument("--force", action="store_true", help="overwrite files that exist")


class _StoreOnce(argparse.Action):
    """Stores the target of a new mission, and refuses a second one, which would silently replace it."""

    def __call__(
        self, _parser: argparse.ArgumentParser, namespace: argparse.Namespace, values: object, *_: object
    ) -> None:
        """Store it."""
        if getattr(namespace, self.dest) is not None:
            raise argparse.ArgumentError(
                self, "a new mission has one target. Add a second one, or more photographs of the first, to its file"
            )
        setattr(namespace, self.dest, values)


def _check(args: argparse.Namespace) -> int:
    from nxtdrive.mission.checking import check_mission

    found = {str(path): check_mission(path, args.robot, load_profile=True) for path in args.files}
    report_findings(found, as_json=args.json)
    return USAGE if any(each.mistakes for each in found.values()) else DONE


def _show(args: argparse.Namespace) -> int:
    from behaviors.diagram import event_table, mermaid, recovery_table, state_table, transition_table
    from nxtdrive.mission.files import read_mission_file

    mission = read_mission_file(args.file, args.robot)
    if args.json:
        write_json(mission.model_dump(mode="json"), indent=2)
        return DONE
    if args.diagram:
        write_text(mermaid())
        return DONE
    write_text(_described(mission))
    tables = {"States": state_table, "Events": event_table, "Transitions": transition_table}
    for title, table in {**tables, "Recoveries": recovery_table}.items():
        write_text(f"\n{title}\n")
        write_text(table())
    return DONE


def _described(mission: Mission) -> str:
    """Format every number the mission runs with; a star marks those that the mission or its robot file sets."""
    from behaviors.mission.value_warnings import unused_keys
    from nxtdrive.cli.templates.mission import meanings

    tables = {
        "mission": mission.mission,
        **{f"target.{name}": target for name, target in mission.target.items()},
        "adaptive": mission.adaptive,
        "thesis": mission.thesis,
        "robot": mission.robot,
        "camera": mission.camera,
        **{f"color.{name}": shade for name, shade in mission.color.items()},
    }
    lines = ["Parameters; * marks those that the mission or its robot file sets, the others are defaults"]
    unused = unused_keys(mission)
    width = max(len(name) for table in tables.values() for name in type(table).model_fields)
    for title, table in tables.items():
        lines += ["", printable(f"[{title}]")]
        if title in unused:
            used = ", ".join(sorted(set(type(table).model_fields) - unused[title]))
            lines[-1] += f"   no effect{used and f' except {used}'}: the profile is {mission.mission.profile}"
        about = meanings(type(table))
        for name, value in table:
            star = "*" if name in table.model_fields_set else " "
            lines.append(printable(f"{star} {name:<{width}}  {_short(value):<15}  {about.get(name, '')}".rstrip()))
    return "\n".join(lines)


def _short(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(_short(item) for item in value)
    if isinstance(value, str) and Path(value).is_absolute():
        return Path(value).name
    if value is None or isinstance(value, bool):
        return str(value).lower()
    return f"{value:g}" if isinstance(value, float) else str(value)


def _new(args: argparse.Namespace) -> int:
    from nxtdrive.cli.templates.mission import template
    from nxtdrive.cli.templates.target import RED_BOX
    from nxtdrive.cli.templates.world import world_text
    from nxtdrive.mission.files import own_room

    target = _new_target(args)
    mission = args.file or Path("my-mission.toml" if target is RED_BOX else f"{target.name}.toml")
    world = own_room(mission)
    text = world_text(target, world.parent)
    contents = {mission: template(target, mission.parent).encode(), world: text.encode()}
    if target.picture and target.sheet:
        contents[target.picture] = target.sheet
    for path, content in contents.items():
        if args.picture is not None and path.resolve() == args.picture.resolve():
            raise ConfigError(f"{path} is the photograph, which would be overwritten.", remedy="Choose another name.")
        if os.path.lexists(path) and not args.force and not (path == target.picture and _contains(path, content)):
            other = "It is named after the text or number: move it" if path == target.picture else "Choose another name"
            raise ConfigError(f"{path} exists already.", remedy=f"{other}, or --force to overwrite it.")
    hint = _better_detector(target, text, world)
    for path, content in contents.items():
        write_output(path, content)
    run = f"nxtdrive run {shlex.quote(str(mission))}"
    write_line(f"Wrote {mission}, and {world}, a simulated room with {target.name!r} in it. Try it there:")
    write_line(f"  {run}")
    write_line("Then with your robot:")
    write_line(f"  {run} --nxt usb:// --camera 0")
    wide_mm, high_mm = target.size_mm
    if args.picture is not None:
        size = f"{wide_mm:.0f} mm wide and {high_mm:.0f} mm high"
        write_line(f"The whole photograph counts as the target, {size}: crop it if it shows anything around it.")
    if target.sheet:
        write_line(f"Print {target.picture} at 100 %: with its white margin it is {wide_mm:.0f} x {high_mm:.0f} mm.")
    if hint:
        write_line(f"hint: {hint}.")
    return DONE


def _contains(path: Path, content: bytes) -> bool:
    """Return whether a file has this content, as the sheet of another mission with the same marker has."""
    with suppress(OSError):
        return path.is_file() and path.stat().st_size == len(content) and path.read_bytes() == content
    return False


def _better_detector(target: TemplateTarget, text: str, world: Path) -> str:
    """Look for a target with a picture in its room; returns which other detector fits a photograph, or nothing.

    Raises:
        ConfigError: It is not found there.
    """
    from nxtdrive.cli.templates.world import try_out, world_text
    from nxtdrive.mission.simpler_detector import simpler_detector
    from nxtdrive.vision.detectors import make_detector
    from nxtdrive.vision.sources import read_image

    if target.picture is None:
        return ""
    spec = {**target.options, "height_mm": target.height_mm}
    if target.sheet:
        with TemporaryDirectory() as folder:
            there = replace(target, picture=Path(folder, "sheet.png"))
            Path(folder, "sheet.png").write_bytes(target.sheet)
            try_out(there, make_detector(spec), world_text(there, Path(folder)), Path(folder, "world.toml"))
        return ""
    spec |= {"pictures": [str(target.picture)]}
    hint = simpler_detector(read_image(target.picture))
    try:
        try_out(target, make_detector(spec), text, world)
    except ConfigError as error:
        raise ConfigError(str(error.args[0]), remedy=f"But {hint}.") if hint else error from None
    return hint


def _new_target(args: argparse.Namespace) -> TemplateTarget:
    """Return what the new mission is to look for.

    Raises:
        ConfigError: There is no such picture, text or height.
    """
    from nxtdrive.cli.templates.target import RED_BOX, marker_target, qr_target
    from nxtdrive.vision.detectors.qr import QrDetector
    from nxtdrive.vision.geometry import MARKER_HEIGHT_MM, QR_HEIGHT_MM

    folder = args.file.parent if args.file else Path()
    if args.picture is not None:
        return _pictured(args.picture, args.height_mm)
    if args.marker is not None:
        return marker_target(args.marker, args.height_mm or MARKER_HEIGHT_MM, folder)
    if args.qr is not None:
        QrDetector(args.qr)
        return qr_target(args.qr, args.height_mm or QR_HEIGHT_MM, folder)
    if args.height_mm is not None:
        raise ConfigError(
            "--height-mm needs --picture, --marker or --qr.", remedy="Name the photograph of what has that height."
        )
    return RED_BOX


def _pictured(picture: Path, height_mm: float | None) -> TemplateTarget:
    """Return the target that a photograph shows.

    Raises:
        ConfigError: It is not an image, or its height is not known and there is no terminal to ask in.
    """
    from firmware_protocol.errors import CameraError
    from nxtdrive.cli.templates.target import TemplateTarget, plain_name
    from nxtdrive.vision.sources import read_image

    try:
        pixels = read_image(picture)
    except CameraError as error:
        raise ConfigError(*error.args, remedy=error.remedy) from None
    height_px, width_px = pixels.shape[:2]
    height_mm = _asked_height_mm(width_px > height_px) if height_mm is None else height_mm
    width_mm = round(height_mm * width_px / height_px, 1)
    return TemplateTarget(plain_name(picture.stem, "picture"), height_mm, width_mm, {"detector": "picture"}, picture)


def _asked_height_mm(landscape: bool) -> float:
    """Ask for the height of what the photograph shows, in a terminal."""
    usual = "A4 landscape is 210, A5 landscape 148" if landscape else "A4 portrait is 297, A5 portrait 210"
    remedy = f"Measure it and give it in millimetres with --height-mm; {usual}."
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise ConfigError("the height of the real thing is missing; all distances are computed from it.", remedy=remedy)
    try:
        return target_height_mm(input(f"How tall is the real thing, in mm ({usual})? "))
    except (argparse.ArgumentTypeError, EOFError) as error:
        raise ConfigError(f"{error or 'no height was given'}.", remedy=remedy) from None
