"""Messages from a page to the server: JSON objects with a ``type``; docs/web-protocol.md describes both directions."""

from __future__ import annotations

from typing import Annotated, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from behaviors.mission.robot import ColorName
from input_files.pydantic_words import first_mistake

from ..calibrate import SHEET_HEIGHT_MM

VERSION = 1
"""Version of the protocol, in the server's first message. Messages and keys may be added without a new version."""

MAX_MESSAGE_BYTES = 64 * 1024
M = TypeVar("M")
Calibrated = Literal["camera", "wheels", "sonar", "motors"]
Share = Annotated[float, Field(ge=-1.0, le=1.0, allow_inf_nan=False)]


class ClientMessage(BaseModel):
    """Fields that all messages of clients have in common."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Drive(ClientMessage):
    """Drive on for half a second; to be repeated while the pad is held.

    Attributes:
        ahead: Share of the highest speed, forward positive.
        turn: Share of the highest turn rate, right positive.
    """

    type: Literal["drive"]
    ahead: Share
    turn: Share


class Stop(ClientMessage):
    """Stop the robot, and stay stopped until `Release`; a running mission or calibration ends.

    Any client may send it at any time.
    """

    type: Literal["stop"]


class Release(ClientMessage):
    """End the stop."""

    type: Literal["release"]


class SpeedLimit(ClientMessage):
    """Set the share of the highest speeds that driving by hand uses."""

    type: Literal["speed_limit"]
    percent: Annotated[int, Field(ge=20, le=100)]


class TakeControl(ClientMessage):
    """Become the driver; while another client drives, ask it."""

    type: Literal["take_control"]


class GiveControl(ClientMessage):
    """Hand control to the client that asked for it, or to anyone."""

    type: Literal["give_control"]


class StartMission(ClientMessage):
    """Start a mission.

    Attributes:
        mission: Name of a mission as the server lists it; empty for the built-in one.
        profile: How the robot behaves: a built-in or an installed profile; the mission's own by default.
        confirm: Whether each recovery waits for `Answer`.
    """

    type: Literal["start_mission"]
    mission: str = ""
    profile: str | None = None
    confirm: bool = False


class StopMission(ClientMessage):
    """End the running mission or calibration."""

    type: Literal["stop_mission"]


class PauseMission(ClientMessage):
    """Pause the running mission, the robot at rest, until `ResumeMission`."""

    type: Literal["pause"]


class ResumeMission(ClientMessage):
    """End the pause: the mission continues where it left off."""

    type: Literal["resume"]


class Answer(ClientMessage):
    """Answer the server's `question`.

    Attributes:
        question: Its number.
        choice: Index of the candidate; 0 is the policy's proposal.
    """

    type: Literal["answer"]
    question: int
    choice: Annotated[int, Field(ge=0)]


class Evidence(ClientMessage):
    """Ask for the open decision, as a program reads it."""

    type: Literal["evidence"]


class Choose(ClientMessage):
    """Take a candidate of the open decision.

    Attributes:
        number: Its number in the answer to `Evidence`; 0 is the policy's proposal.
    """

    type: Literal["choose"]
    number: Annotated[int, Field(ge=0)]


class StartCalibration(ClientMessage):
    """Calibrate the robot; `StopMission` ends it.

    Attributes:
        what: What to calibrate before the marker sheet.
        how: Before the sheet, by ruler, which is for the wheels alone, or with a colour in the middle of the picture.
        sheet_height_mm: The middle of the marker sheet above the floor.
        color: Name of the colour; null for the one that it resembles most.
    """

    type: Literal["start_calibration"]
    what: Annotated[list[Calibrated], Field(min_length=1)] = [
        "camera",
        "wheels",
        "sonar",
        "motors",
    ]
    how: Literal["sheet", "ruler", "color"] = "sheet"
    sheet_height_mm: Annotated[float, Field(ge=20, le=2000, allow_inf_nan=False)] = SHEET_HEIGHT_MM
    color: ColorName | None = None


class AnswerCalibration(ClientMessage):
    """Answer the question of a calibration.

    Attributes:
        question: Its number.
        value: What was measured; 0 where only a confirmation is needed.
    """

    type: Literal["answer_calibration"]
    question: int
    value: Annotated[float, Field(allow_inf_nan=False)] = 0.0


class SaveCalibration(ClientMessage):
    """Write the last calibration's result to the robot file; missions use it from then on."""

    type: Literal["save_calibration"]


Message = (
    Drive
    | Stop
    | Release
    | SpeedLimit
    | TakeControl
    | GiveControl
    | StartMission
    | StopMission
    | PauseMission
    | ResumeMission
    | Answer
    | Evidence
    | Choose
    | StartCalibration
    | AnswerCalibration
    | SaveCalibration
)
_ADAPTER: TypeAdapter[Message] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


def read_message(text: str | bytes) -> Message:
    """Read a client's message.

    Raises:
        ValueError: It is not such a message; the text says why.
    """
    return read(_ADAPTER, text)


def read(adapter: TypeAdapter[M], text: str | bytes) -> M:
    """Read a message of the types that an adapter accepts.

    Raises:
        ValueError: It is not such a message; the text says why.
    """
    try:
        return adapter.validate_json(text)
    except ValidationError as error:
        raise ValueError(first_mistake(error.errors())) from None


def schema() -> dict[str, object]:
    """Return the JSON schema of a client's messages."""
    return _ADAPTER.json_schema()
