"""The part of a world file that can be checked further although other parts have mistakes, so that all are reported."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from typing import Any

from sim_backend.toml_file import Problem, check
from sim_backend.world.toml_types import FARTHEST_MM
from sim_backend.world.world_file import WorldFile

PLACEHOLDERS: dict[str, dict[str, Any]] = {
    "floor": {"size_mm": [FARTHEST_MM, FARTHEST_MM]},
    "robot": {"start_mm": [FARTHEST_MM / 2, FARTHEST_MM / 2]},
}
"""Substitutes for mandatory tables; with them nothing is too far out or too near."""


@dataclass(slots=True)
class PartialWorld:
    """A world without the tables that have mistakes.

    Attributes:
        world: The rest.
        lost: Names in the tables that were left out, by the list they were in.
        kept: Indices in the file of the remaining entries of each list.
        placeholders: Tables that are not the file's.
    """

    world: WorldFile
    lost: Mapping[str, list[str]]
    kept: Mapping[str, Sequence[int]]
    placeholders: set[str] = field(default_factory=set)

    def relevant(self, sentences: Iterable[str]) -> Iterator[str]:
        """Yield the sentences that are about tables of the file."""
        for sentence in sentences:
            if sentence.split(".")[0] not in self.placeholders:
                yield sentence

    def renumbered(self, sentence: str) -> str:
        """Put the indices of the file into a sentence."""

        def index(match: re.Match[str]) -> str:
            table, number = match[1], int(match[2])
            return f"{table}[{self.kept[table][number]}]" if table in self.kept else match[0]

        return re.sub(r"\b([a-z]+)\[(\d+)\]", index, sentence)


def valid_part(tables: Mapping[str, Any], problems: Sequence[Problem]) -> PartialWorld | None:
    """Return the part of tables with problems that can be checked further, or None."""
    rest = deepcopy(dict(tables))
    bad: dict[str, set[int]] = {}
    for problem in problems:
        match problem.location:
            case (str(name), int(index), str(key)) if problem.kind == "extra_forbidden":
                del rest[name][index][key]
            case (str(name), int(index), *_):
                bad.setdefault(name, set()).add(index)
            case (str(name), str(key), *_) if isinstance(rest.get(name), dict):
                rest[name].pop(key, None)
            case (str(name), *_):
                rest.pop(name, None)
    lost, kept = {}, {}
    for name, entries in rest.items():
        if isinstance(entries, list):
            kept[name] = [index for index in range(len(entries)) if index not in bad.get(name, ())]
            names = (_name(entries[index]) for index in sorted(bad.get(name, ())))
            lost[name] = [each for each in names if each]
            rest[name] = [entries[index] for index in kept[name]]
    world, problems = check(WorldFile, rest)
    wanted = {problem.location[0] for problem in problems}
    placeholders = {name: table for name, table in PLACEHOLDERS.items() if name in wanted}
    if world is None:
        world, _ = check(WorldFile, rest | placeholders)
    return None if world is None else PartialWorld(world, lost, kept, set(placeholders))


def _name(entry: object) -> str:
    return str(entry.get("name", "")) if isinstance(entry, dict) else ""
