"""Try an ONNX model in a process of its own, once for each version of its files."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors.onnx_file import read_onnx
from nxtdrive.vision.detectors.trial import run_trial

TRIAL_S = 120.0
PROGRAM = Path(__file__).with_name("onnx_trial.py")
REFUSED = 3
"""Exit code of the program after it said why."""

Versions = tuple[tuple[int, int] | None, ...]


def try_in_subprocess(path: Path, options: Mapping[str, object]) -> None:
    """Have another process load a model and run it.

    Args:
        path: The file.
        options: Those of `nxtdrive.vision.detectors.onnx_model.Options`.

    Raises:
        ConfigError: That process refused the model, crashed, or took too long or too much memory.
    """
    read_onnx(path)  # what this refuses needs no process
    labels = options.get("labels")
    refusal = _tried(str(path), json.dumps(options), versions(path, str(labels) if labels else None))
    if refusal is not None:
        raise ConfigError(refusal[0], remedy=refusal[1])


def versions(path: Path, labels: str | None) -> Versions:
    """Return time and size of a model's files: itself, its weights apart and its labels; None for a missing one."""
    files = [path, Path(f"{path}.data"), *([Path(labels)] if labels else [])]
    stats = (file.stat() if os.path.isfile(file) else None for file in files)
    return tuple(stat and (stat.st_mtime_ns, stat.st_size) for stat in stats)


@lru_cache(maxsize=32)
def _tried(path: str, options: str, _versions: Versions) -> tuple[str, str] | None:
    """Return why a model cannot be used, and what to do; tried once for each version of its files."""
    done = run_trial(PROGRAM, path, options, limit_s=TRIAL_S)
    if done is None:
        return f"{path} took more than {TRIAL_S:g} s for one frame.", "Use a smaller model."
    if done.returncode == 0:
        return None
    if done.returncode == REFUSED:
        message, remedy = json.loads(done.stdout.splitlines()[-1])
        return str(message), str(remedy)
    return f"{path} crashes the runtime that loads it, or takes more memory than a detector may.", (
        "Export or download it again; it may be damaged."
    )
