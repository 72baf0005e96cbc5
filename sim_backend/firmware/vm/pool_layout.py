"""How the memory pool of programs is laid out. Source: docs/firmware.md section 8.1."""

from __future__ import annotations

from typing import NamedTuple

POOL_SIZE = 32_768
_FILL = bytes.fromhex("efbeadde")
_AFTER_POOL = 0xA0000
"""Bytes of memory after the pool: numbers of descriptors have 16 bits."""


class Layout(NamedTuple):
    """Differences between firmwares.

    Attributes:
        clump: Pool bytes per clump.
        fire_count: Which of them is the number of clumps that must end before it starts.
        growth: Number of descriptors added at once.
        doubly_linked: Whether the descriptors are linked in both directions, and half as many free ones are added when
            a program is loaded.
        types: The type as which it reads each number of a type.
        called: Which pool byte of a clump is the number of the clump that it has called; 0 if there is none.
    """

    clump: int
    fire_count: int
    growth: int
    doubly_linked: bool
    types: bytes
    called: int = 0


def fresh_pool(after: bytes = b"\0") -> bytearray:
    """Return a pool as the firmware prepares it, and the memory after it, which damaged programs reach.

    Args:
        after: The bytes that repeat there.
    """
    return bytearray(_FILL * (POOL_SIZE // len(_FILL)) + (after * (_AFTER_POOL // len(after) + 1))[:_AFTER_POOL])
