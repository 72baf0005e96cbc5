"""The thesis's console: the lines its agent `client2` printed, word for word.

Choices of a recovery can be printed, too; the thesis's agent did not print them.

Source: docs/thesis.md, console; figures 1 and 7.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

from behaviors.events import Reason
from behaviors.journal import Kind, Record
from behaviors.recoveries import RECOVERIES
from behaviors.skills import Reply

PREFIX = "[client2] "

_ANSWERS: dict[object, str] = {Reply.CONTINUE.value: "Continue...", Reply.FAILED.value: "Failed"}

_OUTAGES: dict[object, str] = {
    Reason.LINK_LOST: "The brick does not answer; waiting for it",
    Reason.CAMERA_LOST: "The camera gives no picture; waiting for it",
    Reason.SENSOR_LOST: "No sensor is left that could stop the robot; waiting for one",
}


class Console:
    """Turns records into the agent's lines.

    Args:
        write: Takes one line, without its end.
        choices: Whether it prints what is chosen after a failure, and why, and what does not answer.
    """

    def __init__(self, write: Callable[[str], None], *, choices: bool = False) -> None:
        self._write = write
        self._choices = choices

    def say(self, text: str) -> None:
        """Print one line as the agent does."""
        self._write(PREFIX + text)

    def __call__(self, record: Record) -> None:
        """Print what a record says."""
        line = _line(record)
        if line:
            self.say(line)
        if self._choices and (line := _comment(record)):
            self.say(line)


def _comment(record: Record) -> str | None:
    data = record.data
    if record.kind is Kind.CHOICE:
        return _choice(data)
    if record.kind is Kind.SENSOR:
        return f"The {data['sensor']} answers again" if data["answers"] else f"Going on without {data['sensor']}"
    if record.kind is Kind.TRANSITION and data["to"] == "down":
        return _OUTAGES.get(data.get("reason"))
    return None


def _choice(data: Mapping[str, object]) -> str:
    said = RECOVERIES[str(data["choice"])].said
    limit = f" up to {data['wait_s']:.1f} s" if "wait_s" in data else ""
    return f"{said}{limit}: {data['why']}"


def _line(record: Record) -> str | None:
    data = record.data
    if record.kind is Kind.CALL and data["verb"] == "arrive":
        return f"Arriving at {record.target}"
    if record.kind is Kind.REPLY and data["verb"] == "arrive":
        return _ANSWERS.get(data["value"])
    # when the last target is given up there is nothing to change to
    if record.kind is Kind.TRANSITION and data["source"] == "gave_up" and data["to"] == "search":
        return "change target!"
    return None
