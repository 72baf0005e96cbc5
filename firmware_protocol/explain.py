"""Decode telegrams field by field for people.

Accepts anything: requests, replies, telegrams with Bluetooth's length prefix, unknown opcodes, truncated ones. Never
raises.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntFlag
from typing import Any

from firmware_protocol.catalog import AnyCommand, command_of
from firmware_protocol.enums import OpenEnum
from firmware_protocol.framing import LENGTH_SIZE
from firmware_protocol.iomap import IO_MAPS
from firmware_protocol.layout import Layout
from firmware_protocol.status import Status
from firmware_protocol.telegram import NO_REPLY, OLDEST, REPLY_HEADER, REQUEST_HEADER, Kind
from firmware_protocol.wire import Block, Number, Scalar, Tail, Text, WireType

_KINDS = {Kind.DIRECT: "direct command", Kind.SYSTEM: "system command", Kind.REPLY: "reply"}


@dataclass(frozen=True, slots=True)
class ExplainedField:
    """One field.

    Attributes:
        name: Name in the declaration.
        raw: Bytes of the field; fewer than declared if the telegram is truncated.
        value: Decoded value, or None if the telegram is truncated.
        unit: Unit of the value, or empty.
    """

    name: str
    raw: bytes
    value: Any
    unit: str = ""

    @property
    def text(self) -> str:
        """The value in words."""
        if self.value is None:
            return f"cut off after {self.raw.hex(' ')}" if self.raw else "missing"
        return f"{_words(self.name, self.value)} {self.unit}".rstrip()


@dataclass(frozen=True, slots=True)
class Explanation:
    """The meaning of a telegram.

    Attributes:
        telegram: The bytes, without Bluetooth's length.
        framed: Whether Bluetooth's length preceded it.
        kind: Direct command, system command, reply or unknown.
        name: Name of the command that this is or answers; empty if unknown.
        direction: To the brick or from the brick; empty if unknown.
        want_reply: Whether a reply is requested.
        status: Status of a reply.
        fields: The fields in the order of the wire.
        leftover: Bytes after the last field.
        remarks: Other noteworthy facts, one sentence each.
    """

    telegram: bytes
    framed: bool = False
    kind: str = "unknown"
    name: str = ""
    direction: str = ""
    want_reply: bool = False
    status: Status | None = None
    fields: tuple[ExplainedField, ...] = ()
    leftover: bytes = b""
    remarks: tuple[str, ...] = ()

    @property
    def title(self) -> str:
        """The telegram in one line."""
        opcode = f" 0x{self.telegram[1]:02X}" if len(self.telegram) > 1 else ""
        ending = ", requests no reply" if self.kind.endswith("command") and not self.want_reply else ""
        framing = ", with Bluetooth's length in front" if self.framed else ""
        name = self.name or "unknown"
        match self.kind:
            case "unknown":
                return f"not a telegram{framing}"
            case "reply":
                return f"reply to {name}{opcode}, {self.direction}{framing}"
            case kind:
                return f"{name} ({kind}{opcode}, {self.direction}{ending}{framing})"

    def __str__(self) -> str:
        rows = [(each.name, each.text) for each in self.fields]
        if self.status is not None:
            rows.insert(0, ("status", f"{self.status.label} (0x{int(self.status):02X})"))
        if self.leftover:
            rows.append(("left over", self.leftover.hex(" ")))
        width = max((len(name) for name, _ in rows), default=0)
        return "\n".join([self.title, *(f"  {name:{width}}  {text}" for name, text in rows), *self.remarks])


def explain(telegram: bytes) -> Explanation:
    """Explain a telegram."""
    telegram = bytes(telegram)
    framed = _has_length(telegram)
    return _explain(telegram[LENGTH_SIZE:] if framed else telegram, framed=framed)


def _has_length(telegram: bytes) -> bool:
    """Return whether the first two bytes look like Bluetooth's length."""
    body = telegram[LENGTH_SIZE:]
    if not body or len(body) != int.from_bytes(telegram[:LENGTH_SIZE], "little") or not _begins_a_telegram(body):
        return False
    known = len(body) >= REQUEST_HEADER and command_of(Kind(body[0] & ~NO_REPLY), body[1]) is not None
    return known or not _begins_a_telegram(telegram)


def _begins_a_telegram(data: bytes) -> bool:
    return data[0] & ~NO_REPLY in _KINDS


def _explain(telegram: bytes, *, framed: bool) -> Explanation:
    if len(telegram) < REQUEST_HEADER or not _begins_a_telegram(telegram):
        reason = "It is too short." if len(telegram) < REQUEST_HEADER else "The brick ignores such a first byte."
        return Explanation(telegram, framed=framed, leftover=telegram, remarks=(reason,))
    kind = Kind(telegram[0] & ~NO_REPLY)
    command = command_of(kind, telegram[1])
    reply = kind == Kind.REPLY
    header = REPLY_HEADER if reply else REQUEST_HEADER
    layout = None if command is None else command.reply_type.layout if reply else command.layout
    status = Status(telegram[2]) if reply and len(telegram) >= REPLY_HEADER else None
    refused = status is not None and command is not None and int(status) not in command.success
    rest = telegram[header:]
    fields, leftover = _split(layout, rest) if layout and not (refused and not rest) else ((), rest)
    return Explanation(
        telegram,
        framed=framed,
        kind=_KINDS[kind],
        name=command.__name__ if command else "",
        direction="from the brick" if reply else "to the brick",
        want_reply=not reply and not telegram[0] & NO_REPLY,
        status=status,
        fields=fields,
        leftover=leftover,
        remarks=_remarks(command, fields, status if refused else None, len(telegram) < header),
    )


def _split(layout: Layout, data: bytes) -> tuple[tuple[ExplainedField, ...], bytes]:
    """Split `data` into fields as far as it goes; return them and the remaining bytes."""
    fields = []
    for name, wire in layout.wires.items():
        size = len(data) if isinstance(wire, Tail) else struct.calcsize("<" + wire.code)
        raw, data = data[:size], data[size:]
        value = _decode(wire, raw) if len(raw) == size else None
        fields.append(ExplainedField(name, raw, value, layout.units[name]))
    return tuple(fields), data


def _decode(wire: WireType, raw: bytes) -> Any:  # noqa: ANN401 - the value's type is the field's
    match wire:
        case Scalar(code=code):
            return struct.unpack("<" + code, raw)[0]
        case Number(members=members):
            return members[int.from_bytes(raw, "little")]
        case Text() | Block():
            return wire.from_wire(raw)
        case _:
            return raw


def _words(name: str, value: Any) -> str:  # noqa: ANN401 - see _decode
    match value:
        case bool():
            return "yes" if value else "no"
        case IntFlag():
            return f"{value.name or 'none'} (0x{value:02X})"
        case OpenEnum():
            return f"{value.name} (0x{value:02X})" if value.known else f"unknown (0x{value:02X})"
        case int() if name == "module_id":
            module = IO_MAPS.get(value)
            return f"0x{value:08X}" + (f" ({module.name})" if module else "")
        case bytes():
            return value.hex(" ") or "nothing"
        case str():
            return repr(value)
        case _:
            return str(value)


def _remarks(
    command: AnyCommand | None, fields: tuple[ExplainedField, ...], refused: Status | None, headless: bool
) -> tuple[str, ...]:
    remarks = []
    if command is None:
        remarks.append("No command with this opcode is known.")
    elif command.since > OLDEST:
        remarks.append(f"Firmware before {command.since} does not know this command.")
    if refused is not None:
        remarks.append(f"The brick refused. {refused.remedy}".rstrip())
    if headless or any(each.value is None for each in fields):
        remarks.append("The telegram is cut; the firmware would complete a request with bytes of the one before.")
    remarks += _map_remark({each.name: each.value for each in fields})
    return tuple(remarks)


def _map_remark(values: dict[str, Any]) -> list[str]:
    """Describe which variables an IO map access covers."""
    module = IO_MAPS.get(values.get("module_id") or 0)
    start, size = values.get("offset"), values.get("size")
    if module is None or start is None or size is None:
        return []
    touched = []
    for name, variable in module.fields.items():
        for index in range(variable.copies):
            first = variable.offset + index * variable.stride
            if first < start + size and start < first + variable.size:
                touched.append(f"{name}[{index}]" if variable.copies > 1 else name)
    return [f"{module.name}: {', '.join(touched)}."] if touched else []
