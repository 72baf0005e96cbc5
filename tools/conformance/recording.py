"""Read recorded conversations with a brick from a file of JSON lines (docs/firmware.md section 0.2).

A line has a ``request`` or a ``control``, and the ``reply``. Lines without the name of a scenario form one together.
The ``reply`` is firmware 1.29's, unless ``firmware`` names another one: on any line of a scenario for this scenario, on
a line of its own for all that follow.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from firmware_protocol.errors import ConfigError
from input_files.json_text import MAX_BYTES, parse_object
from input_files.plain import InputFileError, read_text
from sim_backend.firmware.versions import FIRMWARES

REFERENCE = "1.29"
"""The firmware a recording was made with that does not say so."""

_REPLIES = {"1.05": "reply_lego105", "1.32": "reply_fw132"}
"""Keys of the replies of other firmwares, present where they differ from ``reply``."""

_TEXTS = ("scenario", "firmware", "request", "control", "reply", "mask", *_REPLIES.values())
_HEX = ("request", "mask")


@dataclass(frozen=True)
class Step:
    """One exchange.

    Attributes:
        number: Position in the scenario.
        request: Telegram to the firmware in hex, or empty.
        control: Control line for the hardware, or empty.
        reply: Reply in hex; several are separated by spaces.
        reference: Reply of the firmware that the recording was made with.
        mask: Hex; bytes where it is 00 are not compared.
    """

    number: int
    request: str
    control: str
    reply: str
    reference: str
    mask: str


@dataclass
class Scenario:
    """One conversation; it begins at power-on.

    Attributes:
        firmware: Version to behave as.
        steps: Its exchanges in order.
    """

    firmware: str
    steps: list[Step] = field(default_factory=list)


def load(path: Path, firmware: str = "") -> dict[str, Scenario]:
    """Read the scenarios of a recording by name.

    Args:
        path: The recording.
        firmware: Version whose replies are wanted: those under its own key where a line has one, else ``reply``. By
            default the version each scenario was recorded with.

    Raises:
        ConfigError: The file cannot be read, is not a recording, or was made with a firmware that the simulated brick
            cannot behave as and `firmware` is not given.
    """
    try:
        lines = read_text(path, MAX_BYTES).split("\n")
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    scenarios: dict[str, Scenario] = {}
    recorded_with = REFERENCE
    for number, line in enumerate(lines, 1):
        if not line.strip():
            continue
        record = _record(line, f"{path}, line {number}")
        if "reply" not in record:
            recorded_with = record["firmware"]
            continue
        scenario = scenarios.setdefault(record.get("scenario") or path.stem, Scenario(firmware or recorded_with))
        scenario.firmware = firmware or record.get("firmware") or scenario.firmware
        scenario.steps.append(_step(record, len(scenario.steps), firmware))
    if not scenarios:
        raise ConfigError(f"{path} contains no recorded telegrams.", remedy="Give a recording of JSON lines.")
    for name, scenario in scenarios.items():
        if scenario.firmware not in FIRMWARES:
            raise ConfigError(
                f"{path}: {name} was recorded with firmware {scenario.firmware!r}, which is not simulated.",
                remedy=f"Compare it with a similar one: --firmware {' or '.join(FIRMWARES)}.",
            )
    return scenarios


def _record(line: str, place: str) -> dict[str, Any]:
    """Parse a line and check its texts."""
    remedy = 'Each line is a JSON object with "request" or "control", and "reply".'
    try:
        record = {name: "" if value is None else value for name, value in parse_object(line).items()}
    except ValueError as error:
        raise ConfigError(f"{place} is not a JSON object that can be read: {error}.", remedy=remedy) from None
    for name in _TEXTS:
        if not isinstance(record.get(name, ""), str):
            raise ConfigError(f"{place}: {name} is not a text.", remedy=remedy)
        if name in record:
            record[name] = record[name].strip()
    if record.get("firmware") and not record.keys() & {"request", "control", "reply"}:
        return record
    if "reply" not in record or bool(record.get("request")) == bool(record.get("control")):
        raise ConfigError(f"{place} is not an exchange.", remedy=remedy)
    telegrams = _HEX if record.get("control") and not record.get("mask") else (*_HEX, "reply", *_REPLIES.values())
    for name in telegrams:
        try:
            bytes.fromhex(record.get(name, ""))
        except ValueError as error:
            raise ConfigError(f"{place}: {name} is not hex.", remedy=remedy) from error
    return record


def _step(record: dict[str, Any], number: int, firmware: str) -> Step:
    step = record.get("step", number)
    return Step(
        number=step if isinstance(step, int) else number,
        request=record.get("request", ""),
        control=record.get("control", ""),
        reply=record.get(_REPLIES.get(firmware, "reply"), record["reply"]),
        reference=record["reply"],
        mask=record.get("mask", ""),
    )
