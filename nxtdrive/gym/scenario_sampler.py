"""Sample the scenario of each episode."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from numbers import Integral, Real
from typing import Any

import numpy as np

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import did_you_mean
from nxtdrive.mission.files import check_profile, with_profile
from nxtdrive.simulated.episode import Episode
from nxtdrive.simulated.robot import CAMERA, GEOMETRIC
from nxtdrive.simulated.scenario import Scenario, generate_scenario
from sim_backend.scenarios.classes import ALL_CLASSES

TUNING_SEEDS = range(20000)
"""Seeds that may be used freely; later ones are held out for reports. See docs/evaluation.md."""


class ScenarioSampler:
    """Samples the scenario of each episode.

    Args:
        kinds: Classes to draw from.
        seeds: Seeds to draw from.
        profile: The missions' profile.

    Raises:
        ConfigError: There is no such class or profile, nothing to draw from, or something else than a list to draw
            from.
    """

    def __init__(self, kinds: Sequence[str], seeds: Sequence[int], profile: str) -> None:
        if isinstance(kinds, str):
            raise ConfigError(f"kinds is a list of classes, not {kinds!r}.", remedy=f"Write kinds=[{kinds!r}].")
        for name, values in (("kinds", kinds), ("seeds", seeds)):
            if not isinstance(values, Sequence | np.ndarray):  # a set has no order, so draws would not be repeatable
                raise ConfigError(f"{name} is a list, not {values!r}.", remedy=f"Write {name}=[...].")
        _check_kinds(kinds)
        check_profile(profile)
        if len(kinds) == 0 or len(seeds) == 0:
            raise ConfigError("there is nothing to draw an episode from.", remedy="Name a class and a seed.")
        self._kinds, self._seeds, self._profile = tuple(kinds), seeds, profile

    def sample(self, random: np.random.Generator, options: Mapping[str, Any] | None) -> Scenario:
        """Draw a scenario; the options ``kind`` and ``seed`` name one instead.

        Raises:
            ConfigError: An option names nothing that exists.
        """
        options = options or {}
        if unknown := sorted(map(str, set(options) - {"kind", "seed"})):
            raise ConfigError(f"there is no option {unknown[0]!r}.", remedy="The options are kind and seed.")
        kind = options.get("kind", self._kinds[int(random.integers(len(self._kinds)))])
        seed = options.get("seed", self._seeds[int(random.integers(len(self._seeds)))])
        _check_kinds([kind])
        if isinstance(seed, bool) or not isinstance(seed, Integral) or seed < 0:
            raise ConfigError(f"there is no seed {seed!r}.", remedy="A seed is a whole number from 0 on.")
        scenario = generate_scenario(kind, int(seed))
        return replace(scenario, mission=with_profile(scenario.mission, self._profile))


def _check_kinds(kinds: Sequence[object]) -> None:
    if unknown := [kind for kind in kinds if kind not in ALL_CLASSES]:
        remedy = did_you_mean(str(unknown[0]), ALL_CLASSES) or f"Classes: {', '.join(ALL_CLASSES)}."
        raise ConfigError(f"there is no class {unknown[0]!r}.", remedy=remedy)


def episode_info(episode: Episode) -> dict[str, Any]:
    """Return an environment's ``info`` of an episode: its scenario, and the targets reached by ground truth."""
    scenario, reached = episode.scenario, sorted(episode.reached)
    return {"kind": scenario.kind, "seed": scenario.seed, "seconds": episode.time_s, "reached": reached}


def check_vision(vision: str) -> str:
    """Return `vision`, the name of how targets are seen.

    Raises:
        ConfigError: It is not a known name.
    """
    if vision not in (GEOMETRIC, CAMERA):
        raise ConfigError(f"vision = {vision!r} is not valid.", remedy=f"Use {GEOMETRIC!r} or {CAMERA!r}.")
    return vision


def check_cost(cost_per_s: float) -> float:
    """Return the cost of a second.

    Raises:
        ConfigError: It is not a finite number.
    """
    if not isinstance(cost_per_s, Real) or not math.isfinite(cost_per_s):
        raise ConfigError(f"cost_per_s is a finite number, not {cost_per_s!r}.", remedy="Write cost_per_s=0.01.")
    return float(cost_per_s)
