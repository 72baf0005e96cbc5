"""``nxtdrive chances``: how often the choices of runs succeeded."""

from __future__ import annotations

import argparse
import hashlib
import json
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.profile_names import ADAPTIVE
from firmware_protocol.errors import ConfigError
from input_files.toml_file import toml_string
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import output_file, write_output
from nxtdrive.cli.output import make_console, make_table, write_error, write_line

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from behaviors.adaptive.chances import Counts
    from nxtdrive.recording.predictions import Prediction

DESCRIPTION = """\
Count how often the choices of the adaptive profile succeeded in your runs, or in
the missions of a sweep, and print it next to the chances that the profile had predicted. With
--out, keep the counts in a file; a mission with chances = "FILE" in its table
[adaptive] uses them in addition to those that come with nxtdrive. Runs that are in
a file of counts already are not counted again."""
EXAMPLES = """\
  nxtdrive chances runs
  nxtdrive chances runs --out chances.json
  nxtdrive chances sweep.jsonl --out chances.json
  nxtdrive chances chances.json runs --out chances.json     # add to them"""

REMEDY = "Name run folders, sweeps, or files that `nxtdrive chances --out` wrote."


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command's arguments."""
    parser.add_argument(
        "run_paths",
        metavar="RUN",
        type=Path,
        nargs="+",
        help="a run folder, a folder of runs, a run's journal.jsonl, a sweep's .jsonl, or counts written by --out",
    )
    parser.add_argument("--out", metavar="FILE", type=output_file, help="write the counts to this file")


def run(args: argparse.Namespace) -> int:
    """Count the choices and return the exit code."""
    from nxtdrive.recording.predictions import counts, summed
    from nxtdrive.recording.run_folder import JOURNAL

    paths = [each for path in args.run_paths for each in _runs_in(path)]
    found: list[Prediction] = []
    sources: list[dict[str, Any]] = []
    earlier: list[Counts] = []
    # counts first: they may have runs that are named, too
    for path in sorted(paths, key=lambda each: not _has_counts(each)):
        if _has_counts(path):
            kept, origins = _read_counts(path)
            if not _counted(path, origins, sources):
                earlier.append(kept)
                sources += origins
            continue
        file = path / JOURNAL if path.is_dir() else path
        whole = file.parent if file.name == JOURNAL else file
        source = {"name": os.path.basename(os.path.realpath(whole)), "sha256": _digest(file)}
        if _counted(path, [source], sources):
            continue
        if path.suffix == ".jsonl" and path.is_file() and path.name != JOURNAL:
            more, made = _read_sweep(path)
        else:
            more, made = _read_run(path), {}
        found += more
        sources.append({**source, "choices": len(more), **made})
    if not found and not earlier:
        raise ConfigError("no choices of the adaptive profile in these runs.", remedy="Name some that had failures.")
    numbers = summed([*earlier, counts(found)])
    if found:
        _show(found)
    else:
        _show_counts(numbers)
    if args.out is not None:
        write_output(args.out, _text(sources, numbers).encode(), "Choose another file with --out.")
        total, name = sum(map(sum, numbers.values())), toml_string(args.out.name)
        write_line(f"{args.out}: {total} choices; use them with chances = {name} in [adaptive]")
    return DONE


def _runs_in(path: Path) -> list[Path]:
    """Return the runs in a folder of runs; any other path stands for itself."""
    from nxtdrive.recording.run_folder import JOURNAL
    from nxtdrive.recording.run_reader import journals_in

    if os.path.lexists(path / JOURNAL):
        return [path]
    return sorted(journal.parent for journal in journals_in(path)) or [path]


def _has_counts(path: Path) -> bool:
    return path.suffix == ".json" and path.is_file()


def _digest(file: Path) -> str | None:
    """Return the digest of a file; None for one that cannot be read, of which its reader says why."""
    from input_files.json_text import MAX_BYTES
    from input_files.plain import InputFileError, read_bytes

    try:
        return hashlib.sha256(read_bytes(file, MAX_BYTES)).hexdigest()
    except InputFileError:
        return None


def _counted(path: Path, more: list[dict[str, Any]], sources: list[dict[str, Any]]) -> bool:
    """Return whether one of a file's sources was counted, and say so; files of older versions do not say."""
    known = {(str(each.get("name")), str(each["sha256"])) for each in sources if "sha256" in each}
    again = [name for each in more if (name := str(each.get("name")), str(each.get("sha256"))) in known]
    if again:
        write_error(f"{path} is not counted: {again[0]} is in the counts already.", sender="")
    return bool(again)


def _read_counts(path: Path) -> tuple[Counts, list[dict[str, Any]]]:
    """Read counts that this command wrote, and where they are from."""
    from behaviors.mission import AdaptiveParameters
    from input_files.json_text import MAX_BYTES, parse_object
    from input_files.plain import read_text

    try:
        kept = parse_object(read_text(path, MAX_BYTES))
        return AdaptiveParameters(chances=kept["counts"]).chances or {}, [dict(each) for each in kept["sources"]]
    except (ValueError, KeyError, TypeError) as error:
        raise ConfigError(f"{path} has no counts.", remedy=REMEDY) from error


def _read_run(path: Path) -> list[Prediction]:
    """Read a run's choices; print why a run has none that count."""
    from nxtdrive.recording.predictions import predictions
    from nxtdrive.recording.run_reader import read_run

    past = read_run(path)
    if past.mission is None:
        write_error(f"{path} is not counted: its mission is not recorded.", sender="")
    elif (profile := past.mission.mission.profile) != ADAPTIVE:
        write_error(f"{path} is not counted: its profile {profile} predicts no chances.", sender="")
    else:
        return predictions(past.records, profile, past.mission)
    return []


def _read_sweep(path: Path) -> tuple[list[Prediction], dict[str, Any]]:
    """Read the predictions of the adaptive profile, and how they were made."""
    from input_files.json_text import MAX_BYTES, parse_object
    from input_files.plain import read_text
    from nxtdrive.tools.sweep.result_file import read_results
    from nxtdrive.tools.sweep.summary_file import summary_path

    try:
        results = [result for result in read_results(path) if result.agent == ADAPTIVE]
    except ConfigError as error:
        raise ConfigError(error.args[0], remedy=REMEDY) from None
    try:
        made = parse_object(read_text(summary_path(path), MAX_BYTES))
    except ValueError:
        made = {}
    found = [each for result in results for each in result.chances]
    return found, {key: made[key] for key in ("command", "versions", "seeds") if key in made}


def _text(sources: list[dict[str, Any]], numbers: Counts) -> str:
    """Return the file with a line for each source and each situation."""
    heads = ",\n".join(f" {json.dumps(each)}" for each in sources)
    lines = ",\n".join(f" {json.dumps(name)}: {json.dumps(each)}" for name, each in numbers.items())
    return f'{{"sources": [\n{heads}\n],\n"counts": {{\n{lines}\n}}}}\n'


def _show(found: Iterable[Prediction]) -> None:
    """Print the chances of each choice, and how often it succeeded."""
    from nxtdrive.recording.wording import state_words

    groups: dict[str, list[Prediction]] = {}
    for each in found:
        groups.setdefault(each.choice, []).append(each)
    table = make_table("choice", "number", "predicted chance", "succeeded")
    for choice, group in sorted(groups.items()):
        chance, true = (
            sum(values) / len(group) for values in zip(*((x.chance, x.came_true) for x in group), strict=True)
        )
        table.add_row(state_words(choice), str(len(group)), f"{chance:.2f}", f"{true:.2f}")
    make_console().print(table)


def _show_counts(numbers: Counts) -> None:
    """Print how often each choice succeeded; counts do not include predictions."""
    from nxtdrive.recording.wording import state_words

    groups: dict[str, list[Sequence[int]]] = {}
    for situation, each in numbers.items():
        groups.setdefault(situation.partition("/")[0], []).append(each)
    table = make_table("choice", "number", "succeeded")
    for choice, group in sorted(groups.items()):
        true, number = sum(each[0] for each in group), sum(map(sum, group))
        table.add_row(state_words(choice), str(number), f"{true / number:.2f}" if number else "-")
    make_console().print(table)
