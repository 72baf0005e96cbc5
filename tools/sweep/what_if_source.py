"""The missions that what-if can repeat: those of a sweep, runs of a simulated robot, and runs of a real one."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from pathlib import Path

from behaviors.journal import RecordKind
from behaviors.mission import Mission
from behaviors.profile_names import ADAPTIVE, THESIS, named_profiles
from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import did_you_mean
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import read_text, whole_number
from nxtdrive.mission.files import check_profile
from nxtdrive.recording.run_folder import SUMMARY
from nxtdrive.recording.run_reader import read_run
from nxtdrive.simulated.rebuilt_room import rebuilt
from nxtdrive.simulated.scenario import Scenario
from nxtdrive.transports.address import Address
from sim_backend.scenarios.classes import ALL_CLASSES

from .agents import ALL_NAMES

OTHER_RUN = "Choose another run, or CLASS:SEED:PROFILE."
"""The remedy for a run that cannot be repeated."""


@dataclass(frozen=True, slots=True)
class GeneratedMission:
    """A mission of a sweep."""

    kind: str
    seed: int
    profile: str

    @property
    def name(self) -> str:
        """The same however it is written: ``open:100`` also for ``open:100:adaptive``."""
        return f"{self.kind}:{self.seed}" + ("" if self.profile == ADAPTIVE else f":{self.profile}")


@dataclass(frozen=True, slots=True)
class _Run:
    """A run of ``nxtdrive run``.

    Attributes:
        path: Its folder.
    """

    path: Path

    @property
    def name(self) -> str:
        """Its folder."""
        return str(self.path)


@dataclass(frozen=True, slots=True)
class RecordedRun(_Run):
    """A run with a simulated robot.

    Attributes:
        mission: What it did.
        nxt: Address of its brick, as fast as the computer allows.
        camera: Its camera.
        choices: Mission time and name of each choice.
    """

    mission: Mission
    nxt: Address
    camera: str
    choices: tuple[tuple[float, str], ...]


@dataclass(frozen=True, slots=True)
class RebuiltRun(_Run):
    """A run of a real robot, to be repeated in a room made from its map.

    Attributes:
        scenario: Mission and room.
    """

    scenario: Scenario


Source = GeneratedMission | RecordedRun | RebuiltRun


def read_source(name: str) -> Source:
    """Read a mission, named by its run folder or as ``CLASS:SEED[:PROFILE]``.

    Raises:
        ConfigError: It is neither, or cannot be repeated.
    """
    kind, _, rest = name.partition(":")
    seed, _, profile = rest.partition(":")
    if kind in ALL_CLASSES and (number := whole_number(seed)) is not None and not os.path.exists(name):
        if profile in ALL_NAMES and profile not in named_profiles():
            raise ConfigError(
                f"{profile} is an agent of sweeps, not a profile.",
                remedy=f"Write {kind}:{seed} or {kind}:{seed}:{THESIS}.",
            )
        check_profile(profile or ADAPTIVE)
        return GeneratedMission(kind, number, profile or ADAPTIVE)
    if not os.path.isdir(name):
        remedy = did_you_mean(kind, ALL_CLASSES) if rest and kind not in ALL_CLASSES else ""
        raise ConfigError(
            f"{name} is neither a run folder nor CLASS:SEED[:PROFILE].",
            remedy=remedy or "Write clutter:100, for example.",
        )
    return read_recorded(Path(name))


def read_recorded(path: Path) -> RecordedRun | RebuiltRun:
    """Read a run.

    Raises:
        ConfigError: It cannot be repeated, or is not a run.
    """
    past = read_run(path)
    try:
        summary = parse_object(read_text(path / SUMMARY, MAX_BYTES))
        nxt, camera = Address.parse(str(summary["nxt"])), str(summary["camera"])
    except (ValueError, KeyError):
        wrong = f"{path} has no complete {SUMMARY}, which says what robot it was, as after a run that was killed."
        raise ConfigError(wrong, remedy=OTHER_RUN) from None
    if past.mission is None:
        raise ConfigError(f"{path} cannot be repeated: its mission is not recorded.", remedy=OTHER_RUN)
    if nxt.scheme != "sim":
        try:
            return RebuiltRun(path, rebuilt(past.records, past.mission))
        except ValueError as error:
            raise ConfigError(f"{path} cannot be repeated in the simulator: {error}.", remedy=OTHER_RUN) from None
    if nxt.target.endswith(".toml") and not os.path.exists(nxt.target):
        raise ConfigError(
            f"{path} was made in the room {nxt.target}, and there is no such file here.",
            remedy="Repeat the command in the folder in which the run was made.",
        )
    choices = [(each.time_s, str(each.data.get("choice"))) for each in past.records if each.kind is RecordKind.CHOICE]
    nxt = replace(nxt, options={**nxt.options, "pace": "fast"})
    return RecordedRun(path, past.mission, nxt, camera, tuple(choices))
