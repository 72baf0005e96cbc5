"""Random telegrams for the campaigns: well-formed ones with random fields, mutated ones, and random bytes."""

from __future__ import annotations

import resource
import struct
import sys
from random import Random
from typing import Any

from firmware_protocol.catalog import ALL_COMMANDS
from firmware_protocol.direct import GetInputValues, GetOutputState, SetInputMode, SetOutputState
from firmware_protocol.iomap import IO_MAPS
from firmware_protocol.layout import Layout
from firmware_protocol.system import IOMapRead, IOMapWrite
from firmware_protocol.telegram import NO_REPLY, Command
from firmware_protocol.wire import Block, Number, Scalar, Tail, Text, WireType

NAMES = (b"*.*", b"*.rxe", b"a.*", b"a.rxe", b"b.rso", b"c.txt", b"d", b"NVConfig.sys", b"", b"\xff.\xfe", b"n" * 20)
"""File names, patterns of names, and fields without a closing zero."""

SMALL = {"port": 5, "handle": 18, "size": 64, "box": 21, "remote_box": 21, "property": 5, "buffer": 3, "tx_length": 18}
"""Fields whose random values are mostly below these limits, so that many telegrams are executed."""

_BUSY = (SetOutputState, SetInputMode, IOMapWrite, IOMapRead, GetOutputState, GetInputValues)
_COMMANDS = (*ALL_COMMANDS, *_BUSY * 5)
"""All commands; those that change or show the state of motors and sensors occur more often."""

_MAPS = tuple(IO_MAPS.values())
_EDGES = (0, 0, 1, 1, 2, 3, 100, 101, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFF_FFFF, 0x8000_0000, 0xFFFF_FFFF)


def peak_memory_kb() -> int:
    """Return the peak memory use of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // (1024 if sys.platform == "darwin" else 1)


def random_request(rng: Random) -> bytes:
    """Return any request: mostly well-formed, some mutated, some of random bytes."""
    kind = rng.random()
    if kind < 0.05:
        return rng.randbytes(rng.randint(1, 70))
    telegram = well_formed(rng, rng.choice(_COMMANDS))
    return mutated(rng, telegram) if kind < 0.25 else telegram


def well_formed(rng: Random, command: type[Command[Any]]) -> bytes:
    """Return a request of this command with random fields; one in four requests no reply."""
    head = bytes((command.kind | (NO_REPLY if rng.random() < 0.25 else 0), command.opcode))
    if command in (IOMapRead, IOMapWrite) and rng.random() < 0.9:
        return head + _io_map_access(rng, write=command is IOMapWrite)
    return head + fields(rng, command.layout)


def fields(rng: Random, layout: Layout) -> bytes:
    """Return random bytes for the fields of a declaration."""
    return b"".join(_field(rng, name, wire) for name, wire in layout.wires.items())


def mutated(rng: Random, data: bytes) -> bytes:
    """Return `data` with a few bytes changed, removed or added; at least one byte is left."""
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 2, 4, 8))):
        at = rng.randrange(len(changed) + 1)
        match rng.randrange(5):
            case 0:
                changed[at : at + 1] = bytes([rng.choice((0, 1, 0x7F, 0x80, 0xFF, rng.randrange(256)))])
            case 1:
                changed[at:at] = rng.randbytes(rng.randint(1, 4))
            case 2:
                del changed[at : at + rng.randint(1, 4)]
            case 3:
                del changed[at:]
            case _ if at < len(changed):
                changed[at] ^= 1 << rng.randrange(8)
    return bytes(changed) or b"\0"


def _io_map_access(rng: Random, *, write: bool) -> bytes:
    """Return the fields of a request for one variable of a map, or for some bytes from it on."""
    layout = rng.choice(_MAPS)
    name, field = rng.choice(tuple(layout.fields.items()))
    spot = layout.field(name, rng.randrange(field.copies))
    size = min(spot.size, 50) if rng.random() < 0.7 else rng.randint(0, 60)
    data = _number(rng, size) if write and size in (1, 2, 4) else rng.randbytes(size)
    return struct.pack("<IHH", spot.module_id, spot.offset, size) + (data if write else b"")


def _field(rng: Random, name: str, wire: WireType) -> bytes:
    match wire:
        case Scalar() | Number():
            size = struct.calcsize("<" + wire.code)
            if name in SMALL and rng.random() < 0.9:
                return rng.randrange(SMALL[name]).to_bytes(size, "little")
            return _number(rng, size)
        case Text():
            text = rng.choice(NAMES) if rng.random() < 0.8 else rng.randbytes(rng.randint(0, wire.size))
            return text[: wire.size].ljust(wire.size, b"\0")
        case Block():
            return rng.randbytes(wire.size)
        case Tail():
            data = rng.randbytes(min(rng.choice((0, 1, 4, 16, 59, 61, 126)), wire.limit))
            return data[:-1] + b"\0" if data and rng.random() < 0.5 else data


def _number(rng: Random, size: int) -> bytes:
    value = rng.choice(_EDGES) if rng.random() < 0.6 else rng.getrandbits(8 * size)
    return (value & (1 << 8 * size) - 1).to_bytes(size, "little")
