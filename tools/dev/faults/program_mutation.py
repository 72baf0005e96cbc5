"""Damage compiled programs where it matters: header, variables, array descriptors, clumps, instructions, operands."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import NamedTuple

COMPILED = Path(__file__).parents[3] / "tests" / "golden" / "programs"
"""Programs compiled from NXC and NBC."""

_ODD = (0, 1, 2, 3, 0xFF, 0x100, 0x7FFF, 0x8000, 0xC000, 0xC200, 0xFFFF)
_HEADER, _TABLE, _ENTRY, _CLUMP, _DESCRIPTOR = 16, 38, 4, 4, 10
_LONG = 0xE


class _Parts(NamedTuple):
    """Offsets of the parts of a program; the table begins at `_TABLE`."""

    numbers: tuple[int, ...]
    descriptors: int
    clumps: int
    code: int
    instructions: tuple[int, ...]


def compiled_programs() -> list[bytes]:
    """Return the files of all compiled programs."""
    return [path.read_bytes() for path in sorted(COMPILED.glob("*.rxe"))]


def damaged(random: Random, content: bytes) -> bytes:
    """Return a program damaged in one to three places."""
    parts, result = _parts(content), bytearray(content)
    for _ in range(random.choice((1, 1, 1, 1, 2, 2, 3))):
        random.choice(_WAYS)(random, parts, result)
    return bytes(result)


def _parts(content: bytes) -> _Parts:
    numbers = struct.unpack_from("<11H", content, _HEADER)
    values = _TABLE + _ENTRY * numbers[0]
    clumps, code = values + numbers[3] + numbers[3] % 2, len(content) - 2 * numbers[10]
    starts, at = [], code
    while at < len(content):
        starts.append(at)
        (word,) = struct.unpack_from("<H", content, at)
        size = word >> 12
        if size == _LONG:
            (size,) = struct.unpack_from("<H", content, at + 2)
        at += max(size & ~1, 2)
    return _Parts(numbers, values + numbers[4], clumps, code, tuple(starts))


def _put(content: bytearray, at: int, value: int) -> None:
    if 0 <= at <= len(content) - 2:
        struct.pack_into("<H", content, at, value & 0xFFFF)


def _variable(random: Random, parts: _Parts) -> int:
    """Draw the number of a variable; the first one is named where the program has none."""
    return random.randrange(max(parts.numbers[0], 1))


def _number(random: Random, parts: _Parts) -> int:
    return random.choice((random.choice(_ODD), random.getrandbits(16), *[_variable(random, parts)] * 2))


def _flip(random: Random, _: _Parts, content: bytearray) -> None:
    if content:
        content[random.randrange(len(content))] ^= 1 << random.randrange(8)


def _resize(random: Random, _: _Parts, content: bytearray) -> None:
    if random.random() < 0.5:
        del content[random.randint(0, len(content)) :]
    else:
        content += bytes(random.randint(1, 8))


def _change_header(random: Random, parts: _Parts, content: bytearray) -> None:
    field = random.randrange(len(parts.numbers))
    new = random.choice((*(parts.numbers[field] + step for step in (-4, -2, -1, 1, 2, 4)), random.choice(_ODD)))
    _put(content, _HEADER + 2 * field, new)


def _change_variable(random: Random, parts: _Parts, content: bytearray) -> None:
    at = _TABLE + _ENTRY * _variable(random, parts)
    if at + _ENTRY > len(content):
        return
    part = random.random()
    if part < 0.4:
        content[at] = random.choice((*range(12), 255))
    elif part < 0.5:
        content[at + 1] ^= 1
    else:
        _put(content, at + 2, random.choice((random.randrange(200), _number(random, parts))))


def _change_descriptor(random: Random, parts: _Parts, content: bytearray) -> None:
    count = parts.numbers[5] // _DESCRIPTOR
    if count:
        number = random.randrange(min(count, 12))
        _put(content, parts.descriptors + _DESCRIPTOR * number + 2 * random.randrange(5), _number(random, parts))


def _change_clump(random: Random, parts: _Parts, content: bytearray) -> None:
    at = parts.clumps + random.randrange(_CLUMP * parts.numbers[9])
    if at < len(content):
        content[at] = random.choice((0, 1, 2, 255, content[at] ^ 1, random.randrange(256)))


def _change_opcode(random: Random, parts: _Parts, content: bytearray) -> None:
    at = random.choice(parts.instructions)
    if at + 2 > len(content):
        return
    if random.random() < 0.7:
        content[at] = random.randrange(0x38)
    else:
        content[at + 1] ^= 1 << random.randrange(8)


def _change_operand(random: Random, parts: _Parts, content: bytearray) -> None:
    at = random.choice(parts.instructions) + 2 * random.randint(1, 3)
    _put(content, at, _number(random, parts))


def _swap(random: Random, _: _Parts, content: bytearray) -> None:
    size = random.choice((2, 4, 8, 10, 20, 40))
    if len(content) < _TABLE + 2 * size:
        return
    one, other = sorted(random.randrange(_TABLE, len(content) - size, 2) for _ in range(2))
    if other - one >= size:
        first = content[one : one + size]
        content[one : one + size] = content[other : other + size]
        content[other : other + size] = first


_WAYS: tuple[Callable[[Random, _Parts, bytearray], None], ...] = (
    *(_flip, _flip, _resize, _change_header, _change_variable, _change_variable, _change_descriptor),
    *(_change_descriptor, _change_clump, _change_opcode, _change_opcode, _change_operand, _change_operand),
    *(_change_operand, _swap),
)
