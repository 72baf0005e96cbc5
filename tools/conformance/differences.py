"""Describe how the simulated brick's result of a step differs from the recorded one, and name the cause.

A cause names the command or control line, and what differs first in the result, without the numbers of the particular
case: differences of one kind have the same cause.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from firmware_protocol.catalog import AnyCommand, command_of
from firmware_protocol.framing import LENGTH_SIZE
from firmware_protocol.iomap import IO_MAPS
from firmware_protocol.iomap_layout import IOMap
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead
from firmware_protocol.telegram import NO_REPLY, REPLY_HEADER, REQUEST_HEADER, Kind

from .recording import Step

_INTERRUPTS = re.compile(r" irqs=\d+")
"""How often the timer fired during the recording: a property of its stub hardware, not of the firmware or the bus."""

DONE = "ok"
"""Result of a control line; after a wait the time follows, which a recording of a real brick lacks."""

_NUMBER = re.compile(r"-?\b[0-9a-f]*\d[0-9a-f]*\b")
_MOTOR = ("pwm", "brake", "count")
_SHORT = 60
"""Longest result in words that a cause quotes."""

_HEADER = ("kind", "opcode", "status")
_STATUS = REPLY_HEADER - 1

ICONS = "LEGO's icons are not drawn"
"""Cause of a blank frame buffer: docs/firmware.md, section 8.5."""

_FRAME_BUFFER = "Display.Normal,"

ADDRESSES = "addresses in the firmware's memory"
"""Cause of pointers that are read, which say where a compiler put tables: docs/firmware.md, section 6."""

_MAP_BYTE = re.compile(r"(\w+) offset (\d+),")
_POINTERS_END = {"Comm": 8, "Display": 108, "Loader": 4, "Ui": 4}
"""First byte after the pointers that an IO map begins with."""

_BYTE_NUMBER = re.compile(r", byte \d+$")


@dataclass(frozen=True)
class Difference:
    """One step whose result is not the recorded one.

    Attributes:
        step: Number of the step.
        cause: Command or control line and what differs.
        text: What was sent, the result and the recorded one.
        exception: Whether the simulated brick failed with a Python exception.
    """

    step: int
    cause: str
    text: str
    exception: bool = False


def compare(step: Step, got: str) -> Difference | None:
    """Describe the difference, if there is one."""
    in_hex = re.fullmatch(r"(?:[0-9a-fA-F]{2}| )*", step.reply) is not None
    if step.request or step.mask or (in_hex and step.control.startswith("!bt ")):
        return _compare_bytes(step, got)
    theirs, ours = (_INTERRUPTS.sub("", reply) for reply in (step.reply, got))
    if theirs == ours or (theirs == DONE and ours.startswith(f"{DONE} ")):
        return None
    if in_hex and step.control.startswith("!also "):
        return _compare_several(step, ours.split(" "), theirs.split(" "))
    for number, (their, our) in enumerate(zip(theirs.split(";"), ours.split(";"), strict=False)):
        if their != our:
            text = f"{step.control}: entry {number} is {our!r}, the firmware's is {their!r}"
            return Difference(step.number, f"{sent_name(step)}: {_words(step, our, their)}", text)
    text = f"{step.control}: {ours!r}, the firmware's is {theirs!r}"
    return Difference(step.number, f"{sent_name(step)}: number of entries", text)


def _compare_several(step: Step, ours: list[str], theirs: list[str]) -> Difference | None:
    """Describe the first difference between the replies to several telegrams."""
    for request, our, their in zip(step.control.split()[1:], ours, theirs, strict=False):
        if found := compare(Step(step.number, request, "", their, their, ""), our):
            return Difference(step.number, f"!also {found.cause}", f"{step.control}: {found.text}")
    replies = f"{len(ours)} replies, not {len(theirs)}"
    return Difference(step.number, f"!also: {replies}", f"{step.control}: {replies}")


def sent_name(step: Step) -> str:
    """Name the command or control line of a step, without its arguments."""
    if not step.request:
        word, *arguments = step.control.split()
        return f"{word} {arguments[1]}" if word == "!i2c" and len(arguments) > 1 else word
    telegram = bytes.fromhex(step.request)
    command = command_of_telegram(telegram)
    return command.__name__ if command else f"telegram {telegram[:REQUEST_HEADER].hex(' ')}"


def command_of_telegram(telegram: bytes) -> AnyCommand | None:
    """Return the command of a request, or that a reply answers."""
    kind = telegram[0] & ~NO_REPLY if len(telegram) >= REQUEST_HEADER else None
    return command_of(Kind(kind), telegram[1]) if kind in tuple(Kind) else None


def _compare_bytes(step: Step, got: str) -> Difference | None:
    theirs, ours, mask = bytes.fromhex(step.reply), bytes.fromhex(got), bytes.fromhex(step.mask)
    both = zip(theirs, ours, mask.ljust(len(theirs), b"\xff"), strict=False)
    offset = next((at for at, (their, our, compared) in enumerate(both) if (their ^ our) & compared), None)
    if offset is None and len(theirs) == len(ours):
        return None
    name = sent_name(step)
    if step.request:
        telegram, start = bytes.fromhex(step.request), 0
    else:  # a stream of framed replies
        telegram, start = _frame(theirs, len(ours) if offset is None else offset)
        command = command_of_telegram(telegram)
        name += f" {command.__name__}" if command else ""
    sent, replies = step.request or step.control, f"({got or 'none'}, not {step.reply or 'none'})"
    field = "length" if offset is None else _field(telegram, offset - start)
    if offset is None or (len(theirs) != len(ours) and field != "status"):
        lengths = f"reply of {len(ours)} bytes, not {len(theirs)}"
        return Difference(step.number, f"{name}: {lengths}", f"{sent}: {lengths} {replies}")
    text = f"{sent}: {field} is 0x{ours[offset]:02x}, the firmware's is 0x{theirs[offset]:02x} {replies}"
    cause = f"{name}: {_BYTE_NUMBER.sub('', field)}{_statuses(field, ours[start:], theirs[start:])}"
    if field.startswith(_FRAME_BUFFER) and not any(ours[offset:]):
        cause = ICONS
    elif (byte := _MAP_BYTE.match(field)) and int(byte[2]) < _POINTERS_END.get(byte[1], 0):
        cause = ADDRESSES
    return Difference(step.number, cause, text)


def _statuses(field: str, ours: bytes, theirs: bytes) -> str:
    """Return the pair of statuses where they differ, the refusal where another field differs."""
    if min(len(ours), len(theirs)) <= _STATUS:
        return ""
    our, their = (f"{data[_STATUS]:02X} {Status(data[_STATUS]).label}" for data in (ours, theirs))
    if field == _HEADER[_STATUS]:
        return f" {our}, not {their}"
    return f" at status {their}" if theirs[_STATUS] != Status.OK else ""


def _frame(stream: bytes, offset: int) -> tuple[bytes, int]:
    """Return the telegram in a Bluetooth stream that has the byte at `offset`, and where it begins."""
    start = 0
    while True:
        begin = start + LENGTH_SIZE
        end = begin + int.from_bytes(stream[start:begin], "little")
        if offset < end or end >= len(stream):
            return stream[begin:end], begin
        start = end


def _field(telegram: bytes, offset: int) -> str:
    """Name the field at `offset` of the reply to a request, or of a reply itself; below 0 it is the frame's length."""
    if offset < REPLY_HEADER:
        return _HEADER[offset] if offset >= 0 else "length"
    command = command_of_telegram(telegram)
    if command is None:
        return f"byte {offset}"
    layout = command.reply_type.layout
    for name, (start, end) in layout.spans.items():
        if start <= offset - REPLY_HEADER < end:
            return f"{name}, byte {offset - REPLY_HEADER - start}"
    if not layout.tail:
        return f"byte {offset}"
    place = offset - REPLY_HEADER - layout.size
    variable = variable_at(telegram, place) if command is IOMapRead and telegram[0] & ~NO_REPLY == Kind.SYSTEM else ""
    return f"{variable or layout.tail}, byte {place}"


def variable_at(telegram: bytes, place: int) -> str:
    """Name the variable that is byte `place` of what an IOMapRead reads, such as ``Ui.Flags``."""
    if len(telegram) < REQUEST_HEADER + IOMapRead.layout.size:
        return ""
    request = IOMapRead.decode(telegram)
    io_map: IOMap | None = IO_MAPS.get(request.module_id)
    if io_map is None:
        return ""
    at, module = request.offset + place, io_map.name.removesuffix(".mod")
    for name, field in io_map.fields.items():
        if any(0 <= at - (field.offset + copy * field.stride) < field.size for copy in range(field.copies)):
            return f"{module}.{name}"
    return f"{module} offset {at}"


def _words(step: Step, our: str, their: str) -> str:
    """Describe the first difference between two results."""
    ours, theirs = (_NUMBER.findall(result) for result in (our, their))
    shapes = [_NUMBER.sub("#", result) for result in (our, their)]
    if shapes[0] != shapes[1]:
        return f"{shapes[0]}, not {shapes[1]}" if max(map(len, shapes)) <= _SHORT else "other events"
    if not step.control.startswith(("!motors", "!trace")):
        return "other numbers"
    first = next(at for at, (one, other) in enumerate(zip(ours, theirs, strict=True)) if one != other)
    first -= step.control.startswith("!trace")
    return "time" if first < 0 else _MOTOR[first % len(_MOTOR)]
