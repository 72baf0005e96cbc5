"""``nxtdrive mission``: checks a mission file, shows what it does, writes a new one."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from firmware_protocol.printable import printable
from nxtdrive.cli.main import DONE, USAGE
from nxtdrive.cli.options import add_action, add_json_argument, writing
from nxtdrive.cli.output import CONTINUED, complain, write_json, write_line, write_text

if TYPE_CHECKING:
    from behaviors.mission import Mission

DESCRIPTION = """\
Check mission files, show a mission with every number it runs with and the
statechart it runs in, or write a commented file to start from."""
EXAMPLES = """\
  nxtdrive mission show                  # the built-in mission
  nxtdrive mission new my.toml           # every key, with its meaning
  nxtdrive mission check my.toml"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the three subcommands."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    check = add_action(actions, "check", "report every mistake in mission files at once", _check)
    check.add_argument("files", metavar="FILE", nargs="+", type=Path, help="mission files, *.toml")
    add_json_argument(check)
    show = add_action(actions, "show", "a mission's numbers, the chart's transitions and its diagram", _show)
    show.add_argument("file", metavar="FILE", nargs="?", type=Path, help="without it, the built-in mission")
    add_json_argument(show)
    new = add_action(actions, "new", "write a commented mission file", _new)
    new.add_argument("file", metavar="FILE", type=Path, help="a new file, such as my-mission.toml")


def _check(args: argparse.Namespace) -> int:
    complaints = {str(path): complaint for path in args.files if (complaint := _complaint(path))}
    if args.json:
        results = [{"file": str(path), "mistakes": _lines(complaints.get(str(path), ""))} for path in args.files]
        write_json(results, indent=2)
        return USAGE if complaints else DONE
    for path in args.files:
        if str(path) in complaints:
            complain(complaints[str(path)], sender="")
        else:
            write_line(f"{path}: good")
    return USAGE if complaints else DONE


def _complaint(path: Path) -> str:
    """Return what is wrong with a mission file or the pictures and cascades it names; empty if nothing is."""
    from nxtdrive.mission.setup import build_detectors, load

    try:
        mission = load(path)
    except ConfigError as error:
        return str(error)
    try:
        build_detectors(mission)
    except ConfigError as error:
        return CONTINUED.join([f"{path}: a target cannot be looked for", *str(error).split(CONTINUED)])
    return ""


def _lines(complaint: str) -> list[str]:
    """Split a message (a headline over indented lines, or a single sentence) into its mistakes."""
    head, *rest = complaint.split(CONTINUED)
    return rest or [head] * bool(head)


def _show(args: argparse.Namespace) -> int:
    from behaviors.diagram import mermaid, recovery_table, transition_table
    from nxtdrive.mission.setup import load

    mission = load(args.file)
    if args.json:
        write_json(mission.model_dump(mode="json"), indent=2)
        return DONE
    write_text(_described(mission))
    write_text("\nTransitions\n")
    write_text(transition_table())
    write_text("\nRecoveries\n")
    write_text(recovery_table())
    write_text("\nDiagram (Mermaid)\n")
    write_text(mermaid())
    return DONE


def _described(mission: Mission) -> str:
    """Format every number the mission runs with; a star marks those the file sets."""
    from nxtdrive.cli.mission_template import meanings

    tables = {
        "mission": mission.mission,
        **{f"target.{name}": target for name, target in mission.target.items()},
        "adaptive": mission.adaptive,
        "thesis": mission.thesis,
        "robot": mission.robot,
        "camera": mission.camera,
    }
    lines = ["Parameters; * marks those that the file sets, the others are defaults"]
    idle = {"adaptive", "thesis"} - {mission.mission.profile}
    for title, table in tables.items():
        lines += ["", printable(f"[{title}]") + "   no effect: the mission has the other profile" * (title in idle)]
        about = meanings(type(table))
        for name, value in table:
            star = "*" if name in table.model_fields_set else " "
            lines.append(printable(f"{star} {name:<17}  {_short(value):<15}  {about.get(name, '')}".rstrip()))
    return "\n".join(lines)


def _short(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(_short(item) for item in value)
    if isinstance(value, str) and Path(value).is_absolute():
        return Path(value).name
    return f"{value:g}" if isinstance(value, float) else str(value)


def _new(args: argparse.Namespace) -> int:
    from nxtdrive.cli.mission_template import template
    from nxtdrive.recording.output_file import write_file

    if os.path.lexists(args.file):
        raise ConfigError(f"{args.file} exists already.", remedy="Choose another name.")
    with writing(args.file):
        write_file(args.file, template().encode())
    write_line(f"Wrote {args.file}. Change the targets, then run: nxtdrive mission check {args.file}")
    return DONE
