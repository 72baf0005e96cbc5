"""The summary of a sweep as a file: figures with intervals, and the data needed to compare or repeat them."""

from __future__ import annotations

import json
import os
import platform
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from itertools import permutations
from pathlib import Path
from typing import Any

import cv2
import numpy as np

from behaviors.profiles import registry
from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text
from nxtdrive.recording.output_file import write_file

from .calibration import calibration_error, error_of_true_chances, pairs, reliability
from .cluster import digest_of, installed
from .differences import beyond
from .runner import SweepResult
from .summary import CONFIDENCE, HEADLINE, RESAMPLES, SEED, Estimate, aggregate, by, figures, finite

FORMAT = 1
SUFFIX = ".summary.json"


def summary_path(out: Path) -> Path:
    """Return the name of the summary of a sweep's file."""
    return out.with_suffix(SUFFIX)


def versions() -> dict[str, Any]:
    """Return the versions that perform a sweep's missions here and now."""
    nxtdrive = installed()
    return {
        "nxtdrive": nxtdrive.version,
        "sources": nxtdrive.sources,
        "python": platform.python_version(),
        "numpy": np.__version__,
        "opencv": cv2.__version__,
        "pymunk": version("pymunk"),
        "system": platform.platform(),
    }


def _kept(path: Path) -> dict[str, Any]:
    """Return the summary of an earlier sweep, or an empty one."""
    try:
        return parse_object(read_text(path, MAX_BYTES))
    except ValueError:
        return {}


def earlier_versions(path: Path) -> list[Any]:
    """Return the other versions by which a resumed sweep was performed so far, as its summary says."""
    kept, now = _kept(path), versions()
    earlier = kept.get("earlier_versions")
    found = [*(earlier if isinstance(earlier, list) else []), kept.get("versions")]
    return [each for each in found if each not in (None, now)]


def own_profiles(path: Path) -> dict[str, list[str]]:
    """Return digests of the sources of each profile of another package, by its name.

    The last one is that of now; before it come those with which a resumed sweep was performed so far, as its summary
    says.
    """
    kept = _kept(path).get("profiles")
    so_far = kept.items() if isinstance(kept, dict) else ()
    found = {name: [str(each) for each in digests] for name, digests in so_far if isinstance(digests, list)}
    for name, package in registry.external_profiles.items():
        if (now := _sources(package)) is not None:
            found[name] = [*(each for each in found.get(name, []) if each != now), now]
    return found


def _sources(package: str) -> str | None:
    """Return a digest of a module, or of all modules of a package; None if they are in no folder, or not loaded."""
    module = sys.modules.get(package)
    folders = [Path(each) for each in getattr(module, "__path__", ())]  # a package without __init__.py has no file
    files = {each.relative_to(folder).as_posix(): each for folder in folders for each in folder.rglob("*.py")}
    if not files and (file := getattr(module, "__file__", None)):
        files = {package: Path(file)}
    return digest_of(files) if files and all(map(os.path.isfile, files.values())) else None


def provenance(command: Sequence[str], earlier: Sequence[Any], profiles: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """Return what performs a sweep's missions, as is known before the first one.

    Args:
        command: The command that was given.
        earlier: What `earlier_versions` returned before it was resumed.
        profiles: What `own_profiles` returned.
    """
    return {
        "format": FORMAT,
        "versions": versions(),
        "earlier_versions": list(earlier),
        "profiles": dict(profiles),
        "command": list(command),
    }


def summary(swept: SweepResult) -> dict[str, Any]:
    """Summarise the results of a sweep."""
    results = swept.results
    agents = by(results, "agent")
    return {
        "vision": sorted(by(results, "vision")),
        "seeds": {kind: sorted({result.seed for result in group}) for kind, group in by(results, "kind").items()},
        "intervals": {"confidence": CONFIDENCE, "bootstrap": RESAMPLES, "seed": SEED, "resampled": "missions"},
        "policies": {
            agent: {
                **aggregate(group, swept.eval_s),
                "headline": plain(figures(group, HEADLINE)),
                "calibration_error": asdict(calibration_error(group)),
                "calibration_error_of_true_chances": error_of_true_chances(group),
                "reliability": [asdict(each) for each in reliability(pairs(group))],
                "classes": {kind: plain(figures(each, HEADLINE)) for kind, each in by(group, "kind").items()},
            }
            for agent, group in agents.items()
        },
        "paired": {
            f"{one} - {other}": plain(beyond(agents[one], agents[other])) for one, other in permutations(agents, 2)
        },
    }


def write_summary(path: Path, content: dict[str, Any]) -> None:
    """Write a summary; an earlier one is replaced.

    Raises:
        ConfigError: It cannot be written.
    """
    try:
        write_file(path, (json.dumps(finite(content), indent=2) + "\n").encode())
    except OSError as error:
        raise ConfigError(
            f"{path} cannot be written ({error.strerror}); the results are in the sweep's own file.",
            remedy="Free some space, and repeat the command with --resume.",
        ) from error


def plain(estimates: dict[str, Estimate]) -> dict[str, Any]:
    """Return estimates as plain values for JSON."""
    return {name: asdict(value) for name, value in estimates.items()}
