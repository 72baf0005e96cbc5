"""Results of the checks."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
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
    verdict: Verdict
    text: str
    remedy: str = ""


def ok(topic: str, text: str) -> Finding:
    """Return a finding that needs no action."""
    return Finding(topic, Verdict.OK, text)


def warning(topic: str, text: str, remedy: str) -> Finding:
    """Return a finding that does not prevent what the user wants."""
    return Finding(topic, Verdict.WARNING, text, remedy)


def problem(topic: str, text: str, remedy: str) -> Finding:
    """Return a finding that prevents what the user wants."""
    return Finding(topic, Verdict.PROBLEM, text, remedy)


def trouble(topic: str, text: str, remedy: str, *, needed: bool) -> Finding:
    """Return a problem if the part is needed for what the user wants, else a warning."""
    return (problem if needed else warning)(topic, text, remedy)
