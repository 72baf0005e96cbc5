"""Run a program on a brick and record every 20 ms what can be observed of it from outside.

The brick is anything that answers telegrams in hex and the control lines of docs/firmware.md section 0.1, so that a
firmware and the simulated brick can be observed in the same way. Events during the run, such as a pressed button or a
message, are comments in the program's source: ``// at 100: !button 8``; ``// file NAME: HEX`` is a file that exists
before.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from hashlib import sha256
from typing import Any

from firmware_protocol import direct, system
from firmware_protocol.iomap import COMMAND, DISPLAY, LOADER, UI, ProgramStatus, UiFlag
from firmware_protocol.iomap_layout import IOMapVariable
from firmware_protocol.telegram import Command
from sim_backend.firmware.ui.stored_settings import SETTINGS

INTERVAL_MS = 20
LONGEST_MS = 4000
"""When a program that still runs is stopped."""

PROGRAM = "prog.rxe"
_LINGER = 3
"""Number of samples after the end."""
_BOXES = (10, 11)
_FRAME_SIZE = 800
_FILE_BYTES = 58
_EVENT = re.compile(r"^(?://|;) at (\d+): (.+)$", re.MULTILINE)
_FILE = re.compile(r"^(?://|;) file (\S+): ([0-9a-f]+)$", re.MULTILINE)
_MESSAGE = re.compile(r"message (\d+) (.*)")

Exchange = Callable[[str], str]
"""Sends a telegram in hex, which takes 1 ms, or a control line, and returns the answer."""

Event = tuple[int, str]
"""Time in ms since the start, and telegram or control line."""


@dataclass(frozen=True)
class Run:
    """The observation of a program.

    Attributes:
        samples: Time in ms since the start, and what has changed since the sample before: ``status`` and ``ui`` (flags)
            of the brick, ``free`` flash, ``motors`` as the control line shows them, the messages in
            boxes 10 and 11, which are taken out, and the hash of the ``frame`` buffer while a program has drawn.
        files: Content in hex of each file that was there at the end, by name.
    """

    samples: list[tuple[int, dict[str, Any]]] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)


def events_of(source: str) -> list[Event]:
    """Return the events in the comments of a source."""
    return [(int(at), _line(action.strip())) for at, action in _EVENT.findall(source)]


def given_files(source: str) -> dict[str, str]:
    """Name and content in hex of the files that the comments of a source put on the brick beforehand."""
    files: dict[str, str] = {}
    for name, part in _FILE.findall(source):
        files[name] = files.get(name, "") + part
    return files


def _line(action: str) -> str:
    message = _MESSAGE.fullmatch(action)
    if message is not None:
        return _hex(direct.MessageWrite.text(int(message[1]), message[2]))
    return action if action.startswith("!") else action.replace(" ", "")


def run_program(exchange: Exchange, content: bytes, events: list[Event], files: Mapping[str, str]) -> Run:
    """Run a program from its start until shortly after its end.

    Args:
        exchange: A brick that has just been switched on.
        content: The executable file.
        events: See `events_of`.
        files: See `given_files`.
    """
    run, waiting, before = Run(), list(events), dict[str, Any]()
    for name, data in files.items():
        _upload(exchange, name, bytes.fromhex(data))
    _upload(exchange, PROGRAM, content)
    exchange(_hex(direct.StartProgram(PROGRAM)))
    now_ms = ended = 0
    while ended < _LINGER:
        while waiting and waiting[0][0] <= now_ms:
            exchange(waiting.pop(0)[1])
        if now_ms == LONGEST_MS:
            exchange(_hex(direct.StopProgram()))
        now_ms += INTERVAL_MS
        seen = _sample(exchange, drawn=_drawn(before))
        run.samples.append((now_ms, {name: value for name, value in seen.items() if value != before.get(name)}))
        before = seen
        ended += now_ms > INTERVAL_MS and seen["status"] != ProgramStatus.RUNNING
    run.files.update(_files(exchange))
    return run


def _sample(exchange: Exchange, *, drawn: bool) -> dict[str, Any]:
    """Look at the brick; takes 20 ms. The frame counts if it was the program's all the time."""
    frame = b""
    if drawn:
        start = DISPLAY.field("Normal").offset
        for at in range(0, _FRAME_SIZE, system.IO_MAP_READ_LIMIT_USB):
            size = min(system.IO_MAP_READ_LIMIT_USB, _FRAME_SIZE - at)
            frame += _ask(exchange, system.IOMapRead(DISPLAY.module_id, start + at, size)).data
    else:
        exchange(f"!tick {-(-_FRAME_SIZE // system.IO_MAP_READ_LIMIT_USB)}")
    seen: dict[str, Any] = {
        "status": _value(exchange, COMMAND.field("ProgStatus")),
        "ui": _value(exchange, UI.field("Flags")),
        "free": _value(exchange, LOADER.field("FreeUserFlash")),
        **{str(box): _message(exchange, box) for box in _BOXES},
        "motors": exchange("!motors"),
    }
    return seen | ({"frame": sha256(frame).hexdigest()[:12]} if drawn and _drawn(seen) else {})


def _drawn(seen: dict[str, Any]) -> bool:
    """Return whether the program controls the screen."""
    return seen.get("status") == ProgramStatus.RUNNING and not seen["ui"] & UiFlag.ENABLE_STATUS


def _message(exchange: Exchange, box: int) -> str:
    reply = bytes.fromhex(exchange(_hex(direct.MessageRead(box, 0, remove=True))))
    return f"{reply[2]:02x}" + (reply[5 : 5 + reply[4]].hex() if not reply[2] else "")


def _ask(exchange: Exchange, command: Command[Any]) -> Any:  # noqa: ANN401 - the reply of the command
    return type(command).decode_reply(bytes.fromhex(exchange(_hex(command))))


def _value(exchange: Exchange, variable: IOMapVariable) -> Any:  # noqa: ANN401 - as the IO map has it
    return variable.decode(_ask(exchange, variable.read()).data)


def _upload(exchange: Exchange, name: str, content: bytes) -> None:
    handle = _ask(exchange, system.OpenWriteLinear(name, len(content))).handle
    for at in range(0, len(content), _FILE_BYTES):
        exchange(_hex(system.Write(handle, content[at : at + _FILE_BYTES])))
    exchange(_hex(system.Close(handle)))


def _files(exchange: Exchange) -> Iterator[tuple[str, str]]:
    """Name and content in hex of all files but the program."""
    reply = exchange(_hex(system.FindFirst("*.*")))
    while not int(reply[4:6], 16):
        found = system.FindFirst.decode_reply(bytes.fromhex(reply))
        if found.name not in (PROGRAM, SETTINGS):
            yield found.name, _content(exchange, found.name, found.size).hex()
        reply = exchange(_hex(system.FindNext(found.handle)))


def _content(exchange: Exchange, name: str, size: int) -> bytes:
    if not size:
        return b""
    handle = _ask(exchange, system.OpenRead(name)).handle
    content = b""
    while len(content) < size:
        wanted = min(_FILE_BYTES, size - len(content))
        content += _ask(exchange, system.Read(handle, wanted)).data
    exchange(_hex(system.Close(handle)))
    return content


def _hex(command: Command[Any]) -> str:
    return command.encode().hex()
