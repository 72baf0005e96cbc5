"""Numbers as programs store them. Source: docs/firmware.md section 8.2."""

from __future__ import annotations

import struct
from collections.abc import Mapping

from sim_backend.firmware.vm.rxe import Type

Number = int | float

SCALARS: Mapping[int, struct.Struct] = {
    Type.VOID: struct.Struct("<B"),
    Type.UBYTE: struct.Struct("<B"),
    Type.SBYTE: struct.Struct("<b"),
    Type.UWORD: struct.Struct("<H"),
    Type.SWORD: struct.Struct("<h"),
    Type.ULONG: struct.Struct("<I"),
    Type.SLONG: struct.Struct("<i"),
    Type.FLOAT: struct.Struct("<f"),
}
"""Layout of each type whose variables are read and written as numbers."""

SIGNED = (Type.SBYTE, Type.SWORD, Type.SLONG)
"""Integer types with a sign."""


def single(value: float) -> float:
    """Return the nearest number of single precision; infinite if it is too large."""
    try:
        return float(SCALARS[Type.FLOAT].unpack(SCALARS[Type.FLOAT].pack(value))[0])
    except OverflowError:
        return float("inf") if value > 0 else float("-inf")
