"""``nxtdrive mission``: check a mission file, show what it will do, write a new one."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, USAGE
from nxtdrive.cli.options import add_action, add_json_argument

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
    check = add_action(actions, "check", "say what is wrong with mission files, everything at once")
    check.add_argument("files", metavar="FILE", nargs="+", type=Path, help="mission files, *.toml")
    add_json_argument(check)
    check.set_defaults(action=_check)
    show = add_action(actions, "show", "a mission's numbers, the chart's transitions and its diagram")
    show.add_argument("file", metavar="FILE", nargs="?", type=Path, help="without it, the built-in mission")
    add_json_argument(show)
    show.set_defaults(action=_show)
    new = add_action(actions, "new", "write a commented mission file")
    new.add_argument("file", metavar="FILE", type=Path, help="a name that is free, such as my-mission.toml")
    new.set_defaults(action=_new)


def run(args: argparse.Namespace) -> int:
    """Do what the subcommand says."""
    return int(args.action(args))


def _check(args: argparse.Namespace) -> int:
    complaints = {str(path): complaint for path in args.files if (complaint := _complaint(path))}
    if args.json:
        results = [{"file": str(path), "mistakes": _lines(complaints.get(str(path), ""))} for path in args.files]
        print(json.dumps(results, indent=2, ensure_ascii=False))
        return USAGE if complaints else DONE
    for path in args.files:
        if str(path) in complaints:
            print(complaints[str(path)], file=sys.stderr)
        else:
            print(f"{path}: good")
    return USAGE if complaints else DONE


def _complaint(path: Path) -> str:
    """What is wrong with a mission file, or with the pictures and cascades it names; nothing if all is well."""
    from nxtdrive.mission.setup import build_detectors, load

    try:
        mission = load(path)
    except ConfigError as error:
        return str(error)
    try:
        build_detectors(mission)
    except ConfigError as error:
        return "\n".join([f"{path}: a target cannot be looked for", *(f"  {line}" for line in str(error).split("\n"))])
    return ""


def _lines(complaint: str) -> list[str]:
    """The mistakes of one message; a headline over indented lines, or a single sentence."""
    head, *rest = complaint.split("\n")
    return [line.strip() for line in rest] or [head] * bool(head)


def _show(args: argparse.Namespace) -> int:
    from behaviors.diagram import mermaid, transition_table
    from nxtdrive.mission.setup import load

    mission = load(args.file)
    if args.json:
        print(mission.model_dump_json(indent=2))
        return DONE
    print(_described(mission))
    print("\nTransitions\n")
    print(transition_table())
    print("\nDiagram (Mermaid)\n")
    print(mermaid())
    return DONE


def _described(mission: Mission) -> str:
    """Every number the mission runs with; a star marks those the file sets."""
    from nxtdrive.cli.mission_template import meanings

    tables = {
        "mission": mission.mission,
        **{f"target.{name}": target for name, target in mission.target.items()},
        "adaptive": mission.adaptive,
        "thesis": mission.thesis,
        "robot": mission.robot,
        "camera": mission.camera,
    }
    lines = ["Parameters; * marks what the file sets, the rest are defaults"]
    idle = {"adaptive", "thesis"} - {mission.mission.profile}
    for title, table in tables.items():
        lines += ["", f"[{title}]" + "   of no effect: the profile is another" * (title in idle)]
        about = meanings(type(table))
        for name, value in table:
            star = "*" if name in table.model_fields_set else " "
            lines.append(f"{star} {name:<17}  {_short(value):<15}  {about.get(name, '')}".rstrip())
    return "\n".join(lines)


def _short(value: object) -> str:
    if isinstance(value, list):
        return ", ".join(_short(item) for item in value)
    if isinstance(value, str) and Path(value).is_absolute():
        return Path(value).name
    return f"{value:g}" if isinstance(value, float) else str(value)


def _new(args: argparse.Namespace) -> int:
    from nxtdrive.cli.mission_template import template

    try:
        with args.file.open("x", encoding="utf-8") as file:
            file.write(template())
    except FileExistsError:
        raise ConfigError(f"{args.file} exists already.", remedy="Choose another name.") from None
    except OSError as error:
        raise ConfigError(
            f"{args.file} cannot be written ({error.strerror}).", remedy="Name a file in a folder that exists."
        ) from error
    print(f"{args.file} is written. Change the targets, then: nxtdrive mission check {args.file}")
    return DONE
