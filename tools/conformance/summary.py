"""Sum up replayed scenarios by category and their differences by cause."""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Iterable
from dataclasses import dataclass

from .replay import Report

OTHER = "other"
"""Category of scenarios whose name begins as no other's does."""

_NUMBERED = re.compile(r"[a-z]\d*_([^_]+)_\d+")


@dataclass(frozen=True)
class Category:
    """Results of the scenarios of one category.

    Attributes:
        category: Name.
        same: Number of scenarios without differences.
        scenarios: Number of scenarios.
        matched: Number of steps with the same result.
        steps: Number of steps.
    """

    category: str
    same: int
    scenarios: int
    matched: int
    steps: int


@dataclass(frozen=True)
class DifferenceCause:
    """Differences of one kind.

    Attributes:
        cause: Command or control line and what differs.
        count: Number of steps.
        scenarios: Names of those that have some.
        example: The first one: scenario, step and text.
    """

    cause: str
    count: int
    scenarios: list[str]
    example: str


def category_of(scenario: str) -> str:
    """Take the category from a name: CATEGORY/..., g_CATEGORY_00, or else the first word of CATEGORY_..."""
    if "/" in scenario:
        return scenario.partition("/")[0]
    numbered = _NUMBERED.fullmatch(scenario)
    return numbered[1] if numbered else scenario.partition("_")[0]


def by_category(reports: Iterable[Report]) -> list[Category]:
    """Sum up by category, in the order of the scenarios; single scenarios with names of their own come last."""
    groups: dict[str, list[Report]] = defaultdict(list)
    reports = list(reports)
    names = [category_of(report.scenario) for report in reports]
    counts = Counter(names)
    for report, name in zip(reports, names, strict=True):
        single = counts[name] == 1 and len(reports) > 1 and name == report.scenario.partition("_")[0]
        groups[OTHER if single else name].append(report)
    return [
        Category(
            name,
            sum(not report.differences for report in group),
            len(group),
            sum(report.matched for report in group),
            sum(report.steps for report in group),
        )
        for name, group in sorted(groups.items(), key=lambda item: item[0] == OTHER)
    ]


def by_cause(reports: Iterable[Report]) -> list[DifferenceCause]:
    """Group all differences of all scenarios, the most frequent cause first."""
    groups: dict[str, list[tuple[str, str]]] = defaultdict(list)
    for report in reports:
        for difference in report.differences:
            example = f"{report.scenario} step {difference.step}: {difference.text}"
            groups[difference.cause].append((report.scenario, example))
    causes = [
        DifferenceCause(cause, len(found), list(dict.fromkeys(name for name, _ in found)), found[0][1])
        for cause, found in groups.items()
    ]
    return sorted(causes, key=lambda each: -each.count)
