"""A telegram is declared once.

A declaration such as ::

    @direct(0x06)
    class GetOutputState(Command[OutputState]):
        port: OutputPortField

is everything this project knows about that command: both ends encode and decode from it, `explain` prints it, the
command line builds it from ``field=value``, the tests generate it, and the simulated brick must answer it.

Byte 0 of a telegram is its kind (bit 0x80: no reply wanted), byte 1 the opcode; a reply adds a status byte
(docs/firmware.md section 3).
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass, fields
from enum import IntEnum
from typing import Any, ClassVar, Generic, Self, TypeVar, cast, dataclass_transform, get_args, get_type_hints

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.status import Status
from firmware_protocol.wire import Block, Number, Scalar, Tail, Text, WireType

NO_REPLY = 0x80
"""Bit of byte 0: the sender does not want a reply."""

REPLY_HEADER = 3
"""Bytes in front of a reply's payload: 0x02, opcode, status."""


class Kind(IntEnum):
    """Byte 0 of a telegram, without the no-reply bit."""

    DIRECT = 0x00
    SYSTEM = 0x01
    REPLY = 0x02


class Layout:
    """The fields of one declaration, compiled to one `struct.Struct`.

    Attributes:
        wires: Wire type of each field, in order, by name.
        size: Bytes of the fixed part; a `Tail` adds to it.
        tail: The open-ended last field's wire type, or None.
        plain: Whether all fields are numbers, so that the compiled fast paths apply.
    """

    def __init__(self, cls: type[Any]) -> None:
        hints = get_type_hints(cls, include_extras=True)
        self.owner = cls
        self.wires: dict[str, WireType] = {f.name: get_args(hints[f.name])[1] for f in fields(cls)}
        kinds = list(self.wires.values())
        if any(isinstance(kind, Tail) for kind in kinds[:-1]):
            raise TypeError(f"{cls.__name__}: only the last field may take the rest of the telegram")
        last = kinds[-1] if kinds else None
        self.tail = last if isinstance(last, Tail) else None
        fixed = [kind for kind in kinds if not isinstance(kind, Tail)]
        self.codes = "".join(kind.code for kind in fixed)
        self._struct = struct.Struct("<" + self.codes)
        self.size = self._struct.size
        self.converters = [(i, _decoder(kind)) for i, kind in enumerate(fixed) if not isinstance(kind, Scalar)]
        self.plain = all(isinstance(kind, Scalar | Number) for kind in kinds)

    def unpack(self, data: bytes, offset: int) -> list[Any]:
        """Values of all fields from `data[offset:]`; the caller has checked the length."""
        values = list(self._struct.unpack_from(data, offset))
        for i, convert in self.converters:
            values[i] = convert(values[i])
        if self.tail:
            values.append(bytes(data[offset + self.size :]))
        return values

    def pack(self, owner: Command[Any] | Reply) -> bytes:
        """The fields of `owner` as bytes.

        Raises:
            LocalProtocolError: A value does not fit its field; the message names it.
        """
        try:
            values = [_encode(kind, getattr(owner, name)) for name, kind in self.wires.items()]
            rest = values.pop() if self.tail else b""
            return self._struct.pack(*values) + rest
        except (struct.error, TypeError, ValueError, AttributeError) as error:
            raise self.complaint(owner, error) from None

    def complaint(self, owner: Command[Any] | Reply, error: Exception) -> LocalProtocolError:
        """An error that names the field of `owner` that does not fit."""
        for name, kind in self.wires.items():
            value = getattr(owner, name)
            scalar = kind.scalar if isinstance(kind, Number) else kind
            if isinstance(scalar, Scalar):
                if not (isinstance(value, int) and scalar.minimum <= value <= scalar.maximum):
                    return LocalProtocolError(
                        f"{type(owner).__name__}.{name} must be a whole number "
                        f"from {scalar.minimum} to {scalar.maximum}, not {value!r}."
                    )
                continue
            try:
                _encode(kind, value)
            except (TypeError, ValueError, AttributeError) as reason:
                return LocalProtocolError(f"{type(owner).__name__}.{name}: {reason}.")
        return LocalProtocolError(f"{type(owner).__name__}: {error}")

    def compile_encoder(self, kind: int, opcode: int) -> Callable[..., bytes]:
        """`Command.encode` as straight-line code, as `dataclass` makes its methods.

        A motor command is encoded at 20 Hz and more on slow computers; this is three times as fast as the general loop.
        """
        arguments = "".join(f", self.{name}" for name in self.wires)
        source = (
            "def encode(self, *, want_reply=True):\n"
            f"    try:\n        return pack({kind} if want_reply else {kind | NO_REPLY}, {opcode}{arguments})\n"
            "    except error as reason:\n        raise complaint(self, reason) from None\n"
        )
        scope = {"pack": struct.Struct(f"<BB{self.codes}").pack, "error": struct.error, "complaint": self.complaint}
        return _compiled("encode", source, scope)

    def compile_reply_decoder(self) -> Callable[[bytes], Any]:
        """`Reply.unpack` as straight-line code; see `compile_encoder`."""
        values = [f"v{i}" for i in range(len(self.wires))]
        converted = list(values)
        scope: dict[str, Any] = {"unpack_from": self._struct.unpack_from, "cls": self.owner, "refuse": self.refuse}
        for i, convert in self.converters:
            scope[f"convert{i}"] = convert
            converted[i] = f"convert{i}(v{i})"
        source = (
            "def unpack(telegram):\n"
            f"    if len(telegram) != {REPLY_HEADER + self.size}:\n        raise refuse(telegram)\n"
            f"    {''.join(f'{v}, ' for v in values)} = unpack_from(telegram, {REPLY_HEADER})\n"
            f"    return cls({', '.join(converted)})\n"
        )
        return _compiled("unpack", source, scope)

    def refuse(self, telegram: bytes) -> RemoteProtocolError:
        """The error for a reply of the wrong length."""
        size = max(0, len(telegram) - REPLY_HEADER)
        return RemoteProtocolError(
            f"{self.owner.__name__} takes {self.size} bytes of payload, the brick sent {size}", bytes(telegram)
        )


def _compiled(name: str, source: str, scope: dict[str, Any]) -> Callable[..., Any]:
    exec(source, scope)  # noqa: S102 - the source is built above from declared field names only
    return cast("Callable[..., Any]", scope[name])


def _decoder(kind: WireType) -> Callable[[Any], Any]:
    if isinstance(kind, Number):
        return kind.convert
    if isinstance(kind, Text):
        return lambda raw: raw.split(b"\0", 1)[0].decode("latin-1")
    return bytes


def _encode(kind: WireType, value: Any) -> Any:  # noqa: ANN401 - the value's type is the field's
    match kind:
        case Text(limit=limit):
            if len(value) > limit or "\0" in value:
                raise ValueError(f"text of at most {limit} characters expected, got {value!r}")
            return value.encode("latin-1")
        case Block(size=size):
            if len(value) > size:
                raise ValueError(f"at most {size} bytes expected, got {len(value)}")
            return bytes(value)
        case Tail(limit=limit):
            if len(value) > limit:
                raise ValueError(f"at most {limit} bytes expected, got {len(value)}")
            return bytes(value)
        case _:
            return value


class Reply:
    """Payload of a reply: what follows ``02 opcode status``."""

    __slots__ = ()
    layout: ClassVar[Layout]

    @classmethod
    def unpack(cls, telegram: bytes) -> Self:
        """Read the payload of a whole reply telegram.

        Raises:
            RemoteProtocolError: The payload is shorter or longer than declared.
        """
        layout = cls.layout
        size = len(telegram) - REPLY_HEADER
        if size != layout.size and (size < layout.size or layout.tail is None):
            raise layout.refuse(telegram)
        return cls(*layout.unpack(telegram, REPLY_HEADER))

    def pack(self) -> bytes:
        """The payload as bytes.

        Raises:
            LocalProtocolError: A value does not fit its field.
        """
        return self.layout.pack(self)


R = TypeVar("R", bound=Reply)


class Command(Generic[R]):
    """A request, direct or system."""

    __slots__ = ()
    kind: ClassVar[Kind]
    opcode: ClassVar[int]
    layout: ClassVar[Layout]
    reply_type: ClassVar[type[Reply]]
    firmware_1_05: ClassVar[bool]
    """Whether firmware 1.05 knows this command; the extended ones came with 1.28."""

    def encode(self, *, want_reply: bool = True) -> bytes:
        """The whole telegram.

        Raises:
            LocalProtocolError: A value does not fit its field.
        """
        kind = self.kind if want_reply else self.kind | NO_REPLY
        return bytes((kind, self.opcode)) + self.layout.pack(self)

    @classmethod
    def decode(cls, telegram: bytes) -> Self:
        """Read a whole request; bytes beyond the declared ones are ignored, as the firmware does.

        Raises:
            RemoteProtocolError: Fewer bytes than declared.
        """
        if len(telegram) < 2 + cls.layout.size:
            raise RemoteProtocolError(f"{cls.__name__} needs {2 + cls.layout.size} bytes", bytes(telegram))
        return cls(*cls.layout.unpack(telegram, 2))

    @classmethod
    def encode_reply(cls, reply: R | None = None, status: int = Status.OK) -> bytes:
        """A reply to this command: header, status and payload; without `reply` the status alone."""
        return bytes((Kind.REPLY, cls.opcode, status)) + (reply.pack() if reply is not None else b"")

    @classmethod
    def decode_reply(cls, telegram: bytes) -> R:
        """Read the payload of a reply to this command; the status is the caller's to judge.

        Raises:
            RemoteProtocolError: The payload does not have the declared size.
        """
        return cast("R", cls.reply_type.unpack(telegram))


COMMANDS: dict[tuple[Kind, int], type[Command[Any]]] = {}
"""Every declared command by kind and opcode, in the order of declaration."""

C = TypeVar("C", bound=type)


@dataclass_transform(eq_default=True)
def reply(cls: C) -> C:
    """Declare a reply's payload."""
    made = cast("Any", dataclass(slots=True)(cls))
    made.layout = layout = Layout(made)
    if layout.plain and layout.wires:
        made.unpack = staticmethod(layout.compile_reply_decoder())
    return cast("C", made)


@dataclass_transform(eq_default=True)
def direct(opcode: int, *, firmware_1_05: bool = True) -> Callable[[C], C]:
    """Declare a direct command (byte 0 = 0x00)."""
    return _declare(Kind.DIRECT, opcode, firmware_1_05)


@dataclass_transform(eq_default=True)
def system(opcode: int, *, firmware_1_05: bool = True) -> Callable[[C], C]:
    """Declare a system command (byte 0 = 0x01)."""
    return _declare(Kind.SYSTEM, opcode, firmware_1_05)


def _declare(kind: Kind, opcode: int, firmware_1_05: bool) -> Callable[[C], C]:
    def declare(cls: C) -> C:
        made = cast("Any", dataclass(slots=True)(cls))
        made.kind, made.opcode, made.firmware_1_05 = kind, opcode, firmware_1_05
        made.layout = layout = Layout(made)
        made.reply_type = get_args(made.__orig_bases__[0])[0]
        if layout.plain:
            made.encode = layout.compile_encoder(kind, opcode)
        if (kind, opcode) in COMMANDS:
            raise TypeError(f"{made.__name__}: opcode 0x{opcode:02X} is declared twice")
        COMMANDS[kind, opcode] = made
        return cast("C", made)

    return declare


@reply
class Ack(Reply):
    """A reply that carries nothing but its status."""
