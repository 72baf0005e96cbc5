"""Check keys of a mission file against each other; each of them may be valid on its own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any

from input_files.mistakes import nearest

MOTORS, SENSORS = ("left", "right"), ("ultrasonic", "touch", "compass")


def cross_checks(tables: Mapping[str, Any], robot_ports: Mapping[str, object]) -> Iterator[str]:
    """Yield mistakes that involve several keys, from the tables as they are in the file, which may have others.

    Args:
        tables: The file's tables.
        robot_ports: The default ports of the robot, by key.
    """
    yield from _ports_used_twice(_table(tables, "robot"), robot_ports)
    described, wanted = _table(tables, "target"), _table(tables, "mission").get("targets")
    names = [name for name in wanted if isinstance(name, str)] if isinstance(wanted, list) else []
    for name in dict.fromkeys(names):
        if name not in described:
            near = nearest(name, described)
            hint = f"; did you mean {near!r}?" if near else ""
            yield f"mission.targets: target {name!r} has no table [target.{name}]{hint}"


def _table(tables: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    table = tables.get(name)
    return table if isinstance(table, dict) else {}


def _ports_used_twice(robot: Mapping[str, Any], defaults: Mapping[str, object]) -> Iterator[str]:
    for keys, what in ((MOTORS, "motor"), (SENSORS, "sensor")):
        for one, other in combinations(keys, 2):
            port = robot.get(one, defaults[one])
            if port and port == robot.get(other, defaults[other]):
                yield f"robot: {one} and {other} both use port {port}; give each {what} a port of its own"
