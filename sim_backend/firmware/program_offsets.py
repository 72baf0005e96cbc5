"""Where the variables of a program are in the Command map. Source: docs/firmware.md section 8.1."""

from __future__ import annotations

from firmware_protocol.iomap import COMMAND
from sim_backend.firmware.vm.array_descriptor import NOT_AN_OFFSET
from sim_backend.firmware.vm.memory import Memory

_POOL_AT = COMMAND.field("MemoryPool").offset
"""Offset of the memory pool in the IO map."""


class ProgramOffsets:
    """The offsets in the map of the last program; they can be overwritten, which has no effect on the program.

    Args:
        keeps: Whether they still show after the program, see `Dialect.keeps_offsets`.
    """

    def __init__(self, *, keeps: bool) -> None:
        self._keeps, self._runs = keeps, False
        self._memory: Memory | None = None
        self._variables: int | None = None
        self._descriptors: int | None = None
        self._written_at = 0

    def load(self, memory: Memory) -> None:
        """Show those of a program that is being loaded."""
        self._memory, self._variables, self._descriptors = memory, None, None

    def start(self) -> None:
        """Note that the program runs."""
        self._runs = True

    def end(self) -> None:
        """Note the end of the program."""
        self._runs = False
        if not self._keeps:
            self._variables = self._descriptors = None

    @property
    def variables(self) -> int:
        """Offset of the variables in the IO map."""
        return self._in_map(0) if self._variables is None else self._variables

    @variables.setter
    def variables(self, offset: int) -> None:
        self._variables = offset

    @property
    def descriptors(self) -> int:
        """Offset of the array descriptors in the IO map; one that was written shows until the descriptors move."""
        at = self._descriptors_at
        if at != self._written_at:
            self._descriptors = None
        return self._in_map(at) if self._descriptors is None else self._descriptors

    @descriptors.setter
    def descriptors(self, offset: int) -> None:
        self._descriptors, self._written_at = offset, self._descriptors_at

    @property
    def _descriptors_at(self) -> int:
        return 0 if self._memory is None else self._memory.descriptors

    def _in_map(self, offset: int) -> int:
        if self._memory is None or not (self._runs or self._keeps):
            return NOT_AN_OFFSET
        return _POOL_AT + self._memory.base + offset & 0xFFFF
