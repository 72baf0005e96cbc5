"""Generate encoding and decoding functions from a declaration's fields.

A program on a slow computer exchanges a hundred telegrams per second while it also detects faces, so this code is
generated per declaration, as `dataclasses` generates ``__init__``: three times as fast as a loop over the fields. It is
generated when a declaration is first used, so that importing ninety of them costs little.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from functools import cached_property
from typing import Any

from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.wire import Number, Scalar, Tail, WireType

Functions = dict[str, Callable[..., Any]]


class Layout:
    """The fields of one declaration.

    Attributes:
        owner: Name of the declaration.
        wires: Wire type of each field, in order, by name.
        units: Unit of each field by name, for people; empty where it has none.
        tail: Name of the open-ended last field, or empty.
        count: Name of the field that says how many bytes of the last field count, or empty.
    """

    def __init__(self, owner: str, annotations: dict[str, Any]) -> None:
        self.owner = owner
        self.wires: dict[str, WireType] = {name: hint.__metadata__[0] for name, hint in annotations.items()}
        self.units: dict[str, str] = {name: "".join(hint.__metadata__[1:]) for name, hint in annotations.items()}
        tails = [name for name, wire in self.wires.items() if isinstance(wire, Tail)]
        if tails and tails != [*self.wires][-1:]:
            raise TypeError(f"{owner}: only the last field may take the rest of the telegram")
        self.tail = tails[0] if tails else ""
        self.count = ""

    @cached_property
    def fixed(self) -> dict[str, Any]:
        """The fields without the tail."""
        return {name: wire for name, wire in self.wires.items() if name != self.tail}

    @cached_property
    def codes(self) -> str:
        """`struct` format of the fixed part, without the byte order."""
        return "".join(wire.code for wire in self.fixed.values())

    @cached_property
    def size(self) -> int:
        """Bytes of the fixed part; a tail adds to it."""
        return struct.calcsize("<" + self.codes)

    @cached_property
    def spans(self) -> dict[str, tuple[int, int]]:
        """First byte and end of each fixed field, from the start of the fields."""
        spans, start = {}, 0
        for name, wire in self.fixed.items():
            end = start + struct.calcsize("<" + wire.code)
            spans[name] = (start, end)
            start = end
        return spans

    def init(self) -> str:
        """Return the source of ``__init__``."""
        body = "".join(f"\n    self.{name} = {name}" for name in self.wires) or "\n    pass"
        return f"def __init__({', '.join(['self', *self.wires])}):{body}\n"

    def packer(self, signature: str, head: str) -> str:
        """Return the source of a method that packs `head` (expressions separated by commas) and the fields."""
        values = [
            f"self.{name}" if isinstance(wire, Scalar | Number) else f"to_{name}(self.{name})"
            for name, wire in self.fixed.items()
        ]
        rest = f" + to_{self.tail}(self.{self.tail})" if self.tail else ""
        return (
            f"def {signature}:\n"
            f"    try:\n        return pack({', '.join([*filter(None, [head]), *values])}){rest}\n"
            f"    except packing_errors as reason:\n        raise value_error(self, reason) from None\n"
        )

    def unpacker(self, name: str, header: int, *, exact: bool) -> str:
        """Return the source of a function that makes an instance from a telegram with a header of `header` bytes."""
        raw = [f"self.{n}" if isinstance(w, Scalar) else f"raw_{n}" for n, w in self.fixed.items()]
        lines = [
            f"if len(telegram) {'!=' if exact and not self.tail else '<'} {header + self.size}:",
            f"    raise size_error(telegram, {header})",
            "self = new(cls)",
        ]
        if raw:
            lines.append(f"{', '.join(raw)}, = unpack_from(telegram, {header})")
        for field, wire in self.fixed.items():
            if isinstance(wire, Number):
                lines.append(f"self.{field} = members_{field}[raw_{field}]")
            elif not isinstance(wire, Scalar):
                lines.append(f"self.{field} = from_{field}(raw_{field})")
        if self.tail:
            lines.append(f"self.{self.tail} = bytes(telegram[{header + self.size}:])")
        if self.count:
            lines += [f"if len(self.{[*self.wires][-1]}) < self.{self.count}:", "    raise count_error(telegram)"]
        return f"def {name}(telegram):\n    " + "\n    ".join([*lines, "return self"]) + "\n"

    def compile(self, cls: type, head_codes: str, source: str) -> Functions:
        """Compile `source`, made of the sources above, and return its functions."""
        scope: dict[str, Any] = {
            "cls": cls,
            "new": object.__new__,
            "pack": struct.Struct("<" + head_codes + self.codes).pack,
            "unpack_from": struct.Struct("<" + self.codes).unpack_from,
            "packing_errors": (struct.error, TypeError, ValueError),
            "value_error": self.value_error,
            "size_error": self.size_error,
            "count_error": self.count_error,
        }
        for name, wire in self.wires.items():
            scope[f"to_{name}"] = wire.to_wire
            if isinstance(wire, Number):
                scope[f"members_{name}"] = wire.members
            elif not isinstance(wire, Scalar | Tail):
                scope[f"from_{name}"] = wire.from_wire
        functions: Functions = {}
        exec(source, scope, functions)  # noqa: S102 - built from declared field names only
        for name, function in functions.items():
            function.__qualname__ = f"{self.owner}.{name}"
        return functions

    def value_error(self, instance: object, error: Exception) -> LocalProtocolError:
        """Return an error that names the field of `instance` that does not fit."""
        for name, wire in self.wires.items():
            try:
                wire.to_wire(getattr(instance, name))
            except ValueError as reason:
                return LocalProtocolError(f"{self.owner}.{name} {reason}.")
        return LocalProtocolError(f"{self.owner}: {error}.")

    def count_error(self, telegram: bytes) -> RemoteProtocolError:
        """Return the error for a telegram with fewer bytes than its own count."""
        return RemoteProtocolError(f"{self.owner} counts more bytes in {self.count} than it has", bytes(telegram))

    def size_error(self, telegram: bytes, header: int) -> RemoteProtocolError:
        """Return the error for a telegram of the wrong length."""
        number = f"at least {self.size}" if self.tail else f"{self.size}"
        got = max(0, len(telegram) - header)
        return RemoteProtocolError(f"{self.owner} takes {number} bytes after its header, not {got}", bytes(telegram))
