"""A telegram is declared once.

A declaration such as ::

    @direct(0x06)
    class GetOutputState(Command[OutputState]):
        port: OutputPortField

is the only definition of that command: both ends encode and decode by it, `explain` prints it, the command line builds
it from ``field=value``, the tests generate it, and the simulated brick must answer it. Instances behave like those of a
slotted dataclass.

Byte 0 of a telegram is its kind (bit 0x80: no reply wanted), byte 1 the opcode; a reply adds a status byte
(docs/firmware.md section 3).
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Any, ClassVar, Generic, Self, TypeVar, cast, dataclass_transform

from firmware_protocol.layout import Functions, Layout
from firmware_protocol.status import Status

NO_REPLY = 0x80
"""Bit of byte 0: the sender does not want a reply."""

REQUEST_HEADER = 2
"""Number of bytes before a request's fields: kind, opcode."""

REPLY_HEADER = 3
"""Number of bytes before a reply's fields: 0x02, opcode, status."""

OLDEST = "1.05"
"""The oldest firmware whose commands are known."""


class Kind(IntEnum):
    """Byte 0 of a telegram, without the no-reply bit."""

    DIRECT = 0x00
    SYSTEM = 0x01
    REPLY = 0x02


class Declared:
    """Base of requests and replies: named fields.

    The methods below whose bodies begin with `_compile` are replaced on the declaration when one of them is first used.
    """

    __slots__ = ()
    layout: ClassVar[Layout]

    def __init__(self, *values: object, **named: object) -> None:
        self._compile()
        type(self).__init__(self, *values, **named)

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(f'{k}={v!r}' for k, v in self.fields().items())})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, type(self)) and self.fields() == other.fields()

    __hash__ = None  # type: ignore[assignment] # mutable

    def fields(self) -> dict[str, Any]:
        """Return the values by field name, in the order of the wire."""
        return {name: getattr(self, name) for name in self.layout.wires}

    @classmethod
    def _compile(cls) -> None:
        """Put the functions made from the layout on the class."""

    @classmethod
    def _install(cls, functions: Functions) -> None:
        """Put compiled functions on the class; those that take no `self` become static, hand-written ones stay."""
        for name, function in functions.items():
            if name not in vars(cls):
                method = "self" in function.__code__.co_varnames[: function.__code__.co_argcount]
                setattr(cls, name, function if method else staticmethod(function))


class Reply(Declared):
    """The fields after ``02 opcode status`` in a reply."""

    __slots__ = ()

    @classmethod
    def unpack(cls, telegram: bytes) -> Self:
        """Read the fields of a whole reply telegram.

        Raises:
            RemoteProtocolError: It is shorter or longer than declared.
        """
        cls._compile()
        return cls.unpack(telegram)

    def pack(self) -> bytes:
        """Return the fields as bytes.

        Raises:
            LocalProtocolError: A value does not fit its field.
        """
        self._compile()
        return self.pack()

    @classmethod
    def _compile(cls) -> None:
        layout = cls.layout
        source = layout.init() + layout.packer("pack(self)", "") + layout.unpacker("unpack", REPLY_HEADER, exact=True)
        cls._install(layout.compile(cls, "", source))


R = TypeVar("R", bound=Reply)


class Command(Declared, Generic[R]):
    """A request, direct or system."""

    __slots__ = ()
    kind: ClassVar[Kind]
    opcode: ClassVar[int]
    reply_type: ClassVar[type[Reply]]
    success: ClassVar[tuple[int, ...]]
    """Status bytes whose reply carries its fields; everything else is a refusal."""
    since: ClassVar[str]
    """The first firmware that knows this command: 1.05, 1.28, or 1.32, which is the community's."""

    def encode(self, *, want_reply: bool = True) -> bytes:
        """Return the whole telegram.

        Raises:
            LocalProtocolError: A value does not fit its field.
        """
        self._compile()
        return self.encode(want_reply=want_reply)

    @classmethod
    def decode(cls, telegram: bytes) -> Self:
        """Read a whole request; bytes beyond the declared ones are ignored, as the firmware does.

        Raises:
            RemoteProtocolError: Fewer bytes than declared.
        """
        cls._compile()
        return cls.decode(telegram)

    @classmethod
    def encode_reply(cls, reply: R | None = None, status: int = Status.OK) -> bytes:
        """Return a reply to this command: header, status and fields; without `reply` the status alone."""
        return bytes((Kind.REPLY, cls.opcode, status)) + (reply.pack() if reply is not None else b"")

    @classmethod
    def decode_reply(cls, telegram: bytes) -> R:
        """Read the fields of a reply to this command; the status is the caller's to judge.

        Raises:
            RemoteProtocolError: The reply does not have the declared size.
        """
        return cast("R", cls.reply_type.unpack(telegram))

    @classmethod
    def reply_head(cls, request: bytes) -> bytes:
        """Return what a good reply to the encoded `request` begins with: header, status OK and the fields it echoes.

        The leading fields of a reply that have the name of a request's field repeat its value.
        """
        cls._compile()
        return cls.reply_head(request)

    @classmethod
    def _compile(cls) -> None:
        layout = cls.layout
        head = f"{cls.kind:d} if want_reply else {cls.kind | NO_REPLY}, {cls.opcode}"
        source = (
            layout.init()
            + layout.packer("encode(self, *, want_reply=True)", head)
            + layout.unpacker("decode", REQUEST_HEADER, exact=False)
            + f"def reply_head(request):\n    return {' + '.join([repr(cls.encode_reply()), *cls._echoes()])}\n"
        )
        cls._install(layout.compile(cls, "BB", source))
        if "unpack" not in vars(cls.reply_type):
            cls.reply_type._compile()
        cls._install({"decode_reply": cls.reply_type.unpack})  # one call less than the method above

    @classmethod
    def _echoes(cls) -> list[str]:
        """Return the pieces of a request that its reply repeats, as source."""
        pieces = []
        for name in cls.reply_type.layout.fixed:
            if name not in cls.layout.fixed:
                break
            start, end = cls.layout.spans[name]
            pieces.append(f"request[{REQUEST_HEADER + start}:{REQUEST_HEADER + end}]")
        return pieces


COMMANDS: dict[tuple[Kind, int], type[Command[Any]]] = {}
"""Every declared command by kind and opcode, in the order of declaration."""

C = TypeVar("C", bound=type)


@dataclass_transform(eq_default=True)
def reply(cls: C) -> C:
    """Declare a reply."""
    return cast("C", _slotted(cls))


@dataclass_transform(eq_default=True)
def counted_reply(count: str) -> Callable[[C], C]:
    """Declare a reply whose field `count` says how many bytes of its last field count; fewer are refused."""

    def declare(cls: C) -> C:
        made = _slotted(cls)
        made.layout.count = count
        return cast("C", made)

    return declare


@dataclass_transform(eq_default=True)
def direct(opcode: int, *, success: tuple[Status, ...] = (Status.OK,), since: str = OLDEST) -> Callable[[C], C]:
    """Declare a direct command (byte 0 = 0x00)."""
    return _declare(Kind.DIRECT, opcode, success, since)


@dataclass_transform(eq_default=True)
def system(opcode: int, *, success: tuple[Status, ...] = (Status.OK,), since: str = OLDEST) -> Callable[[C], C]:
    """Declare a system command (byte 0 = 0x01)."""
    return _declare(Kind.SYSTEM, opcode, success, since)


def _declare(kind: Kind, opcode: int, success: tuple[Status, ...], since: str) -> Callable[[C], C]:
    def declare(cls: C) -> C:
        made = _slotted(cls)
        made.kind, made.opcode, made.success, made.since = kind, opcode, success, since
        made.reply_type = made.__orig_bases__[0].__args__[0]
        if (kind, opcode) in COMMANDS:
            raise TypeError(f"{made.__name__}: opcode 0x{opcode:02X} is declared twice")
        COMMANDS[kind, opcode] = made
        return cast("C", made)

    return declare


def _slotted(cls: type) -> Any:  # noqa: ANN401 - a class like the one given
    """Recreate the class with a slot for each annotation; an existing class cannot get slots."""
    annotations = cls.__annotations__
    body = {name: value for name, value in vars(cls).items() if name not in ("__dict__", "__weakref__")}
    body |= {"__slots__": tuple(annotations), "__match_args__": tuple(annotations)}
    made: Any = type(cls)(cls.__name__, cls.__bases__, body)
    made.__qualname__ = cls.__qualname__
    made.layout = Layout(cls.__name__, annotations)
    return made


@reply
class Ack(Reply):
    """A reply without fields."""
