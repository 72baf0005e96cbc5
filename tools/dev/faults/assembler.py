"""Assemble programs for the simulated brick.

Source of the format: LEGO's executable file specification, as for `sim_backend.firmware.vm.rxe`, which reads it.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from functools import partial

from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.numbers import SCALARS
from sim_backend.firmware.vm.rxe import SIZES, Type

Words = list[int]
"""Words of code of one instruction."""

_SCALAR_SIZE = 4
_SIZED = (0x18, 0x21, 0x31)
"""Instructions with any number of arguments: build an array, join texts, set an output."""
_LONG = 14
"""Instructions from this size on carry it in a word of their own."""


class Variables:
    """The variable table of a program, its static values and its arrays.

    Attributes:
        table: Type, flag of a zero first value, and data of each variable.
        static: First values of the scalars.
        arrays: Element size and first content of the arrays.
    """

    def __init__(self) -> None:
        self.table: list[tuple[int, int, int]] = []
        self.static = b""
        self.arrays: list[tuple[int, bytes]] = []

    def number(self, value: float = 0, kind: Type = Type.SLONG) -> int:
        """Add a number, in four bytes of its own; returns its index."""
        self.table.append((kind, 0, len(self.static)))
        whole = struct.pack("<f", value) if kind == Type.FLOAT else struct.pack("<I", int(value) & 0xFFFF_FFFF)
        self.static += whole[: SIZES[kind]].ljust(_SCALAR_SIZE, b"\0")
        return len(self.table) - 1

    def array(self, values: Sequence[float], kind: Type) -> int:
        """Add an array of numbers; returns its index."""
        self.table += [(Type.ARRAY, 0, len(self.static)), (kind, 1, 0)]
        self.arrays.append((SIZES[kind], b"".join(SCALARS[kind].pack(value) for value in values)))
        self.static += struct.pack("<HH", len(self.arrays), 0)
        return len(self.table) - 2

    def text(self, content: bytes = b"\0") -> int:
        """Add a text, with its closing zero; returns its index."""
        return self.array(content, Type.UBYTE)

    def call(self, *members: int | bytes) -> tuple[int, list[int]]:
        """Add the cluster of a system call, of numbers and texts; returns its index and those of its members."""
        self.table.append((Type.CLUSTER, 0, len(members)))
        cluster = len(self.table) - 1
        return cluster, [self.text(m) if isinstance(m, bytes) else self.number(m) for m in members]


def instruction(opcode: int, *arguments: int, flags: int = 0) -> Words:
    """Return the words of an instruction."""
    size = 2 + 2 * len(arguments)
    if size < _LONG and opcode not in _SIZED:
        return [size << 12 | flags << 8 | opcode, *(argument & 0xFFFF for argument in arguments)]
    return [0xE000 | flags << 8 | opcode, size + 2, *(argument & 0xFFFF for argument in arguments)]


def assemble(
    variables: Variables,
    *clumps: Sequence[Words],
    version: int = 5,
    fire: Sequence[int] = (),
    dependents: Sequence[Sequence[int]] = (),
) -> bytes:
    """Return the program file.

    Args:
        variables: Its variables.
        clumps: The instructions of each clump.
        version: Minor version of the format.
        fire: Fire count of each clump.
        dependents: Dependents of each clump.
    """
    if not variables.table:
        variables.number()
    static = variables.static.ljust(-(-len(variables.static) // 4) * 4, b"\0")
    values = b"".join(
        static[data : data + SIZES[kind]] for kind, zero, data in variables.table if not zero and kind != Type.CLUSTER
    )
    dynamic = _dynamic(variables, len(static))
    defaults = values + dynamic
    records = lists = b""
    code: Words = []
    for i, clump in enumerate(clumps):
        own = bytes(dependents[i]) if i < len(dependents) else b""
        records += struct.pack("<BBH", fire[i] if i < len(fire) else 0, len(own), len(code))
        lists += own
        code += [word for line in clump for word in line]
    header = struct.pack("<14sBB", b"MindstormsNXT", 0, version) + struct.pack(
        "<11H", len(variables.table), len(static) + len(dynamic), len(static), len(defaults), len(values), len(dynamic),
        0, len(variables.arrays), len(static), len(clumps), len(code),
    )  # fmt: skip
    body = header + b"".join(struct.pack("<BBH", *entry) for entry in variables.table) + defaults
    body += bytes(len(body) % 2) + records + lists
    return body + bytes(len(body) % 2) + struct.pack(f"<{len(code)}H", *code)


def _dynamic(variables: Variables, start: int) -> bytes:
    """Return the array descriptors and the arrays, which follow the static values."""
    count = len(variables.arrays) + 1
    offset, heap = start + 10 * count, b""
    descriptors = struct.pack("<5H", start, 10, count, 0xFFFF, 1 if variables.arrays else 0xFFFF)
    for number, (element, content) in enumerate(variables.arrays, 1):
        link = number + 1 if number < len(variables.arrays) else 0xFFFF
        descriptors += struct.pack("<5H", offset + len(heap), element, len(content) // element, number - 1, link)
        heap += content
    return descriptors + heap


def sample_program() -> bytes:
    """Return a program that counts in a loop, sends the count to mailbox 10, turns motor A and reads mailbox 1."""
    variables = Variables()
    count, one, port, power, run = (variables.number(value) for value in (0, 1, 0, 50, 0x20))
    send, (_, _, text) = variables.call(0, 10, b"\0")
    fetch, _ = variables.call(0, 1, 1, b"\0")
    lines = [
        instruction(0x00, count, count, one),
        instruction(0x1F, text, count),
        instruction(0x28, 26, send),
        instruction(0x31, port, 2, power, 6, run, 1, one),
        instruction(0x28, 27, fetch),
    ]
    size = sum(map(len, lines))
    return assemble(variables, [*lines, instruction(0x25, -size)])


def store(brick: SimBrick, name: str, content: bytes, *, linear: bool = False) -> None:
    """Put a file on a simulated brick, as a download does."""
    create = partial(brick.loader.create, linear=True) if linear else brick.loader.create_by_telegram
    handle = create(name, len(content)).handle
    brick.loader.write(handle, content)
    brick.loader.close(handle)
