"""The descriptor of an array of a running program: ten bytes in the pool.

Source: docs/firmware.md section 8.1.
"""

from __future__ import annotations

import struct
from typing import NamedTuple

NOT_AN_OFFSET = NO_ARRAY = 0xFFFF
"""Offset of an array that never had an element, and the number that stands for no descriptor."""

OFFSET_MASK = 0xFFFF
"""Bits of an offset, and of the size of an array."""
DESCRIPTOR = struct.Struct("<HHHHH")
DESCRIPTOR_SIZE, LENGTH_AT = DESCRIPTOR.size, 4
INDEX = struct.Struct("<H")
"""Layout of a descriptor, and of the number of one."""


class Array(NamedTuple):
    """A descriptor; `back` and `link` are its neighbours in the list of arrays, which is the order in memory."""

    offset: int
    element: int
    length: int
    back: int
    link: int

    @property
    def size(self) -> int:
        """Size in bytes, of which 16 bits count."""
        return self.element * self.length & OFFSET_MASK
