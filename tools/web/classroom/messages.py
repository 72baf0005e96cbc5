"""Messages from the page of a classroom to the server; docs/web-protocol.md describes both directions."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, TypeAdapter

from ..messages import ClientMessage, read

Names = Annotated[list[str], Field(max_length=100)]


class StopAll(ClientMessage):
    """Stop every robot, and stay stopped until `ReleaseAll` or until the robot's own page releases it."""

    type: Literal["stop_all"]


class ReleaseAll(ClientMessage):
    """End the stop of every robot."""

    type: Literal["release_all"]


class Start(ClientMessage):
    """Start a mission on some robots.

    Attributes:
        robots: Their names.
        mission: Name of a mission as the server lists it; empty for the built-in one, null for each robot's own.
        profile: How the robots behave: a built-in or an installed profile; the mission's own by default.
    """

    type: Literal["start"]
    robots: Names
    mission: str | None = None
    profile: str | None = None


class End(ClientMessage):
    """End the missions of some robots.

    Attributes:
        robots: Their names.
    """

    type: Literal["end"]
    robots: Names


class Beep(ClientMessage):
    """Play a tone on a robot's brick.

    Attributes:
        robot: Its name.
    """

    type: Literal["beep"]
    robot: str


class ReturnToBrick(ClientMessage):
    """Reopen a brick that a simulated robot has replaced.

    Attributes:
        robot: Its name.
    """

    type: Literal["return_to_brick"]
    robot: str


class Visible(ClientMessage):
    """Choose the robots whose pictures are sent: those that the page shows now.

    Attributes:
        robots: Their names.
    """

    type: Literal["visible"]
    robots: Names


ClassroomMessage = StopAll | ReleaseAll | Start | End | Beep | ReturnToBrick | Visible
ADAPTER: TypeAdapter[ClassroomMessage] = TypeAdapter(Annotated[ClassroomMessage, Field(discriminator="type")])


def read_message(text: str | bytes) -> ClassroomMessage:
    """Read a client's message.

    Raises:
        ValueError: It is invalid; the text says why.
    """
    return read(ADAPTER, text)


def schema() -> dict[str, object]:
    """Return the JSON schema of a client's messages."""
    return ADAPTER.json_schema()
