"""What an examination ends with."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """How bad it is."""

    OK = "ok"
    WARNING = "warning"
    PROBLEM = "problem"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report.

    Attributes:
        topic: What was examined, such as ``battery``.
        verdict: How bad it is.
        text: What was found.
        remedy: What to do, or an empty string when nothing need be done.
    """

    topic: str
    verdict: Verdict
    text: str
    remedy: str = ""


def ok(topic: str, text: str) -> Finding:
    """Nothing to do."""
    return Finding(topic, Verdict.OK, text)


def warning(topic: str, text: str, remedy: str) -> Finding:
    """It works, or is not needed today."""
    return Finding(topic, Verdict.WARNING, text, remedy)


def problem(topic: str, text: str, remedy: str) -> Finding:
    """It does not work."""
    return Finding(topic, Verdict.PROBLEM, text, remedy)


def trouble(topic: str, text: str, remedy: str, *, needed: bool) -> Finding:
    """A problem if it is needed for what the user wants, else a warning."""
    return (problem if needed else warning)(topic, text, remedy)
