"""How the interpreters of the firmware versions differ. Source: docs/firmware.md section 8."""

from __future__ import annotations

from typing import NamedTuple


class Timing(NamedTuple):
    """How much runs in a pass of one millisecond.

    Attributes:
        instructions: Instructions per pass, however they are distributed.
        turns: Turns per pass; one that asks for the time counts for two. Where instructions are counted, it only ends
            a pass in which clumps call each other and nothing else.
    """

    instructions: int
    turns: int


class Dialect(NamedTuple):
    """How the interpreters of the firmware versions differ.

    Attributes:
        timing: See `Timing`.
        copies_arrays: Whether an operation of one array copies it unchanged if the target has the same type.
        system_calls: Number of system calls.
        missing: Opcodes that it does not have.
        checks_short_forms: Whether the size of an instruction in a short form counts, and forms that do not exist add.
        runs_past_end: Whether the instruction directly behind a clump belongs to it, too; then a clump that ends before
            it begins has no end.
        shows_offsets: Whether the Command map tells where the program's variables and array descriptors are.
        tells_faults: Whether ProgStatus tells why a program cannot be started, not only that.
    """

    timing: Timing
    copies_arrays: bool
    system_calls: int
    missing: frozenset[int]
    checks_short_forms: bool = False
    runs_past_end: bool = False
    shows_offsets: bool = True
    tells_faults: bool = False
