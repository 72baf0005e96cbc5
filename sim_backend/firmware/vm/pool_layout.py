"""How the memory pool of programs is laid out. Source: docs/firmware.md section 8.1."""

from __future__ import annotations

from typing import NamedTuple


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
