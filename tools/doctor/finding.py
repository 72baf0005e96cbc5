"""Results of the checks."""

from __future__ import annotations

import re
import textwrap
from dataclasses import dataclass
from enum import StrEnum

INDENT = " " * 23
"""Width of the columns for verdict and topic."""
_COMMAND = re.compile(r"`[^`]*`")
_UNBROKEN = "\N{NO-BREAK SPACE}"


class Severity(StrEnum):
    """Severity of a finding."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report.

    Attributes:
        topic: What was checked, such as ``battery``.
        verdict: Severity.
        text: What was found.
        remedy: What to do, or an empty string.
    """

    topic: str
    verdict: Severity
    text: str
    remedy: str = ""


def ok(topic: str, text: str) -> Finding:
    """Return a finding that needs no action."""
    return Finding(topic, Severity.OK, text)


def warning(topic: str, text: str, remedy: str) -> Finding:
    """Return a finding that does not block the user's task."""
    return Finding(topic, Severity.WARNING, text, remedy)


def problem(topic: str, text: str, remedy: str) -> Finding:
    """Return a finding that blocks the user's task."""
    return Finding(topic, Severity.PROBLEM, text, remedy)


def trouble(topic: str, text: str, remedy: str, *, needed: bool) -> Finding:
    """Return a problem if the user's task needs the part, else a warning."""
    return (problem if needed else warning)(topic, text, remedy)


def lines(finding: Finding, width: int | None) -> list[str]:
    """Return a finding as lines for people, its text and its remedy indented below each other.

    Args:
        finding: The finding.
        width: Characters per line, or None for lines of any length; commands in backticks stay whole, for copying.
    """
    begins = f"{finding.verdict:<8} {finding.topic:<13} "
    shown = _wrapped(finding.text, begins, INDENT, width)
    if finding.remedy:
        shown += _wrapped(finding.remedy, f"{INDENT}-> ", f"{INDENT}   ", width)
    return shown


def _wrapped(text: str, first: str, rest: str, width: int | None) -> list[str]:
    whole = [_COMMAND.sub(lambda command: command[0].replace(" ", _UNBROKEN), line) for line in text.splitlines()]
    wrapped: list[str] = []
    for line in whole:
        indent = rest if wrapped else first
        limits = textwrap.TextWrapper(
            width or len(indent) + len(line) + 1,
            initial_indent=indent,
            subsequent_indent=rest,
            break_long_words=False,
            break_on_hyphens=False,
        )
        wrapped += limits.wrap(line) or [indent]
    return [line.replace(_UNBROKEN, " ") for line in wrapped]
