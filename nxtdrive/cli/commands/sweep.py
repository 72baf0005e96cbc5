"""``nxtdrive sweep``: the evaluation suite."""

from __future__ import annotations

import argparse
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import did_you_mean, number_of
from input_files.plain import whole_number
from nxtdrive.cli.main import DONE, USAGE
from nxtdrive.cli.options import add_json_argument, output_file, write_output
from nxtdrive.cli.output import make_console, write_error, write_json, write_line
from nxtdrive.cli.workers import add_worker_arguments, open_workers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nxtdrive.tools.sweep.mission_result import MissionResult
    from nxtdrive.tools.sweep.runner import SweepResult
    from nxtdrive.tools.sweep.task import Task

DESCRIPTION = """\
Run agents (profiles, baselines and oracles) on the same simulated missions and
evaluate them by the simulation's ground truth. Missions already in the file are not
repeated, so the same command with --resume continues an interrupted sweep.
SPL is success weighted by path length, SCT success weighted by completion time; a
wrong stop is an arrival reported where the target is not."""
EXAMPLES = """\
  nxtdrive sweep
  nxtdrive sweep --suite full --workers 2 --out full.jsonl --resume
  nxtdrive sweep --suite full --dask tcp://host:8786 --out full.jsonl
  nxtdrive sweep --classes open,clutter --seeds 100-119 --agents thesis,oracle
  nxtdrive sweep --map clutter:100:thesis --out clutter.png
  nxtdrive sweep --suite full --out full.jsonl --resume --tables --plot full.svg
  nxtdrive sweep --suite hard --out new.jsonl --against old.jsonl"""

SUITES: dict[str, tuple[tuple[int, int], tuple[str, ...]]] = {
    # a profile that never gives up takes the whole time of every mission; the smoke suite should take a minute
    "smoke": ((100, 100), ("thesis", "adaptive", "random-walk", "oracle")),
    "full": ((100, 199), ()),
    "reality": ((100, 104), ("thesis", "adaptive", "random-walk", "oracle")),
    "hard": ((100, 104), ("thesis", "adaptive", "random-walk", "oracle")),
}
"""Seeds and agents of each suite (none: all). Other seeds are held out for reports: --seeds."""
DEFAULT_OUT = Path("sweep.jsonl")
MAX_SEEDS = 100_000
"""Largest number of seeds of each class; the list of missions is kept in memory."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    _add_mission_arguments(parser)
    add_worker_arguments(parser, 1, "1")
    _add_output_arguments(parser)


def _add_mission_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--suite",
        choices=list(SUITES),
        default="smoke",
        help="smoke: one seed of each class, four agents, a minute; full: 100 seeds, six agents; reality "
        "(imperfect robots) and hard (flats, people, haste, poor light): 5 seeds, four agents each (default: smoke)",
    )
    usual = "(default: the suite's)"
    parser.add_argument(
        "--classes", metavar="A,B", type=_names, help=f"only these classes; a wrong name lists all {usual}"
    )
    parser.add_argument("--seeds", metavar="A-B", type=_seeds, help=f"seeds of each class, both ends included {usual}")
    parser.add_argument(
        "--agents",
        "--profiles",
        "--policies",
        dest="profiles",
        metavar="A,B",
        type=_names,
        help=f"only these agents: profiles, baselines, oracles, package.module:Class; a wrong name lists all {usual}",
    )
    parser.add_argument(
        "--vision",
        "--eyes",
        choices=("geometric", "camera"),
        default="geometric",
        help="how targets are seen: geometric samples detections by geometry and a model fitted to the detector, "
        "without images; camera renders frames and searches them (default: geometric)",
    )
    parser.add_argument(
        "--robot",
        metavar="FILE",
        type=Path,
        help="robot file for the missions; the simulated robots stay those of their classes (default: none, not even "
        "$NXT_ROBOT)",
    )


def _add_output_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--out",
        metavar="FILE",
        type=output_file,
        help=f"file for the results, one line per mission (default: {DEFAULT_OUT})",
    )
    parser.add_argument(
        "--resume", action="store_true", help="keep the results in the file and run only missing missions"
    )
    parser.add_argument("--map", metavar="CLASS:SEED:AGENT", help="draw the map of this one run instead")
    parser.add_argument("--plot", metavar="FILE", type=Path, help="also draw plots; needs the extra nxtdrive[plot]")
    parser.add_argument("--tables", action="store_true", help="print all tables, not only the overview")
    parser.add_argument(
        "--against",
        metavar="FILE",
        type=Path,
        help="also print how the figures differ from those in this file of another sweep, paired by mission",
    )
    add_json_argument(parser)


def run(args: argparse.Namespace) -> int:
    """Run the sweep, or draw a map; return the exit code."""
    from nxtdrive.mission.files import read_robot_file
    from nxtdrive.tools.sweep.agents import NAMES
    from nxtdrive.tools.sweep.runner import plan
    from nxtdrive.tools.sweep.summary_file import (
        earlier_versions,
        own_profiles,
        provenance,
        summary,
        summary_path,
        write_summary,
    )
    from sim_backend.scenarios.classes import ALL_CLASSES, CLASSES, HARD_CLASSES, REALITY_CLASSES

    if args.map:
        return _draw_map(args)
    if args.plot:
        from nxtdrive.tools.sweep.plots import check_plotting

        check_plotting(args.plot)
    seeds, agents = SUITES[args.suite]
    first, last = args.seeds or seeds
    classes = list({"reality": REALITY_CLASSES, "hard": HARD_CLASSES}.get(args.suite, CLASSES))
    tasks = plan(
        _known("class", args.classes or classes, ALL_CLASSES),
        range(first, last + 1),
        _agents(args.profiles or agents or NAMES),
        args.vision,
        read_robot_file(args.robot),
    )
    other = _other_sweep(args.against, tasks) if args.against else []
    out = args.out or DEFAULT_OUT
    _check_new(out, resume=args.resume)
    earlier = earlier_versions(summary_path(out))
    profiles = own_profiles(summary_path(out))
    performed = provenance(_command(tasks, args), earlier, profiles)
    swept = _sweep(tasks, out, args, performed)
    if earlier:
        write_error(f"other versions of nxtdrive or its libraries performed missions in {out}; the summary names them.")
    for name in (each for each, digests in profiles.items() if len(digests) > 1):
        write_error(f"{name} has changed since some of its missions in {out}. For a comparison choose another --out.")
    write_summary(summary_path(out), {**performed, **summary(swept)})
    _report(swept.results, swept.eval_s, args, other)
    if args.plot:
        from nxtdrive.tools.sweep.plots import plot_bytes

        write_output(args.plot, plot_bytes(swept.results, args.plot.suffix), "Choose another file with --plot.")
    return USAGE if _own_broke(swept.results) else DONE


def _check_new(out: Path, *, resume: bool) -> None:
    """Refuse a folder in place of a file, and files that exist unless the sweep is resumed."""
    from nxtdrive.tools.sweep.summary_file import summary_path

    if out.is_dir():
        raise ConfigError(f"{out} is a folder.", remedy="Choose a file in it with --out.")
    for path in (out, summary_path(out)):
        if os.path.lexists(path) and not resume:
            resumable = "Continue it with --resume" if out.is_file() else "Remove it"
            raise ConfigError(f"{path} exists already.", remedy=f"{resumable}, or choose another file with --out.")


def _other_sweep(path: Path, tasks: Sequence[Task]) -> list[MissionResult]:
    """Return the results in another sweep's file, if any mission can be compared with them."""
    from nxtdrive.tools.sweep.result_file import read_results

    remedy = "With --against, name the results file of a sweep."
    if not path.is_file():
        raise ConfigError(f"{path} is no file.", remedy=remedy)
    try:
        results: list[MissionResult] = read_results(path)
    except ConfigError as error:
        raise ConfigError(error.args[0], remedy=remedy) from None
    missions = [(result.kind, result.seed, result.agent) for result in results]
    if not {(task.kind, task.seed, task.agent) for task in tasks}.intersection(missions):
        raise ConfigError(
            f"{path} has none of these missions.", remedy="Give the --classes, --seeds and --agents of both sweeps."
        )
    if len(set(missions)) < len(missions):
        raise ConfigError(
            f"{path} has missions several times, seen in different ways or with different robot files.",
            remedy="Compare with a file that has each once.",
        )
    return results


def _own_broke(results: Sequence[MissionResult]) -> bool:
    """Return whether missions of profiles that are not ours broke; the tables say which, and why."""
    from nxtdrive.tools.sweep.agents import ALL_NAMES

    return any(result.broke and result.agent not in ALL_NAMES for result in results)


def _command(tasks: Sequence[Task], args: argparse.Namespace) -> list[str]:
    """Return the command that gives the same lines, with all values of the suite and all defaults spelt out."""
    classes, agents = dict.fromkeys(task.kind for task in tasks), dict.fromkeys(task.agent for task in tasks)
    seeds = f"{min(task.seed for task in tasks)}-{max(task.seed for task in tasks)}"
    command = ["nxtdrive", "sweep", "--classes", ",".join(classes), "--seeds", seeds]
    command += ["--agents", ",".join(agents), "--vision", args.vision]
    return [*command, *(["--robot", str(args.robot)] if args.robot else [])]


def _sweep(tasks: Sequence[Task], out: Path, args: argparse.Namespace, performed: dict[str, Any]) -> SweepResult:
    """Run the missing missions, with a progress bar; a sweep that is killed leaves what performed it in the summary."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from nxtdrive.tools.sweep.result_file import read_results
    from nxtdrive.tools.sweep.runner import sweep
    from nxtdrive.tools.sweep.summary_file import summary_path, write_summary

    known = {result.key for result in read_results(out)}
    done = sum(task.key in known for task in tasks)
    columns = (BarColumn(), MofNCompleteColumn(), TimeRemainingColumn(), TextColumn("{task.description}", markup=False))
    screen = make_console(stderr=True)
    with (
        open_workers(args, "Continue with --resume and fewer --workers.") as workers,
        Progress(*columns, console=screen, disable=args.json) as progress,
    ):
        bar = progress.add_task("missions", total=len(tasks), completed=done)

        def begin() -> None:
            write_summary(summary_path(out), performed)

        def show(result: MissionResult) -> None:
            progress.update(bar, advance=1, description=f"last {result.kind}:{result.seed}:{result.agent}")

        try:
            return sweep(tasks, out, workers, begin=begin, progress=show)
        except KeyboardInterrupt:
            progress.stop()
            screen.print(f"interrupted; the missions so far are in {out}: continue with --resume", markup=False)
            raise


def _report(
    results: Sequence[MissionResult], eval_s: float, args: argparse.Namespace, other: Sequence[MissionResult]
) -> None:
    if args.json:
        from nxtdrive.tools.sweep.chart_coverage import never
        from nxtdrive.tools.sweep.differences import against
        from nxtdrive.tools.sweep.summary import aggregate, by, finite
        from nxtdrive.tools.sweep.summary_file import plain

        agents = {agent: aggregate(group, eval_s) for agent, group in by(results, "agent").items()}
        missing, number = never(results)
        chart = {"transitions": number, "never": missing}
        content = {"n_episodes": len(results), "eval_s": eval_s, "policies": agents, "chart": chart}
        if other:
            differences = {
                agent: {kind: plain(more) for kind, more in classes.items()}
                for agent, classes in against(results, other).items()
            }
            content["against"] = {"file": str(args.against), "policies": finite(differences)}
        write_json(content, indent=2)
        return
    from nxtdrive.tools.sweep.tables import print_against, print_overview, print_tables

    # a table that is read by a program or kept in a file must not be cut to a terminal's width
    print_them = print_tables if args.tables else print_overview
    console = make_console() if sys.stdout.isatty() else make_console(width=180)
    print_them(results, console)
    if other:
        print_against(results, other, str(args.against), console)
    write_line(f"{number_of(len(results), 'mission')}; this run took {eval_s:.0f} s")
    if not args.tables:
        write_line("For all tables add --resume --tables.")


def _draw_map(args: argparse.Namespace) -> int:
    from nxtdrive.drawing.sheet import encoded
    from nxtdrive.mission.files import read_robot_file
    from nxtdrive.tools.sweep.task import Task, run_episode, scenario_of
    from nxtdrive.tools.sweep.true_map import draw_true_map
    from sim_backend.scenarios.classes import ALL_CLASSES

    kind, _, rest = args.map.partition(":")
    seed, _, agent = rest.partition(":")
    number = whole_number(seed)
    if number is None or not agent:
        raise ConfigError(f"--map {args.map}: expected CLASS:SEED:AGENT, as in clutter:100:thesis.")
    _known("class", [kind], ALL_CLASSES)
    _agents([agent])
    out = args.out or Path(f"{kind}-{seed}-{agent}.png".replace(":", "-"))  # Windows has no colons in names
    task = Task(0, kind, number, agent, args.vision, read_robot_file(args.robot))
    trace, _ = run_episode(scenario_of(task), agent, args.vision)
    picture = encoded(draw_true_map(trace, f"{kind}, seed {seed}, agent {agent}"), out)
    write_output(out, picture, "With --out, name a PNG in an existing folder with free space.")
    write_line(out)
    return DONE


def _agents(names: Sequence[str]) -> list[str]:
    """Return the names if each is an agent of the sweep or a custom profile whose class can be loaded."""
    from behaviors.profile_names import installed_profiles
    from behaviors.profiles.registry import find_profile
    from nxtdrive.tools.sweep.agents import ALL_NAMES

    installed = installed_profiles()
    for name in names:
        if ":" in name or (name in installed and name not in ALL_NAMES):
            find_profile(name)
        else:
            _known("agent", [name], (*ALL_NAMES, *installed))
    return list(names)


def _known(what: str, names: Sequence[str], known: Any) -> list[str]:  # noqa: ANN401 - any collection of names
    for name in names:
        if name not in known:
            remedy = did_you_mean(name, known) or f"Known: {', '.join(known)}."
            raise ConfigError(f"there is no {what} {name!r}.", remedy=remedy)
    return list(names)


def _names(text: str) -> list[str]:
    """Return the names in a list, each once: a mission that counts twice would make intervals too narrow."""
    names = list(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise argparse.ArgumentTypeError(f"{text!r} has no name")
    return names


def _seeds(text: str) -> tuple[int, int]:
    first, _, last = text.partition("-")
    low, high = whole_number(first), whole_number(last or first)
    if low is None or high is None or not low <= high < low + MAX_SEEDS:
        limit = f"at most {MAX_SEEDS:,} seeds"
        raise argparse.ArgumentTypeError(f"{text!r} is not a range of {limit}; write 100-119, or 7 for one")
    return low, high
