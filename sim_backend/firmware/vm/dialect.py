"""How the interpreters of the firmware versions differ. Source: docs/firmware.md section 8."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

from sim_backend.firmware.vm.clump_records import ADDRESSES, RecordFormat
from sim_backend.firmware.vm.rxe import Type

ENHANCED = frozenset({*range(0x0A, 0x11), *range(0x64, 0x8A)})
"""Opcodes that only firmware 1.32 has."""


class Timing(NamedTuple):
    """The amount of code that runs in a pass of one millisecond.

    Attributes:
        instructions: Instructions per pass, however they are distributed.
        turns: Turns per pass; one that reads the time counts as two. Where instructions are counted, it only ends
            a pass in which clumps call each other and nothing else.
    """

    instructions: int
    turns: int


class Dialect(NamedTuple):
    """How the interpreters of the firmware versions differ.

    Attributes:
        timing: See `Timing`.
        copies_arrays: Whether an operation of one array copies it unchanged if the target has the same integer type.
        builds_at_once: Whether BUILD copies arrays of integers at once, and ARRINIT leaves out offsets of elements.
        accepts_mixed_comparisons: Whether a jump that holds for equal values is also made if an array or cluster is
            compared with something else, which otherwise is an error.
        system_calls: Number of system calls.
        missing: Opcodes that it lacks.
        has_fields: Whether an argument can be a field of a port.
        checks_short_forms: Whether the size of an instruction in a short form counts, and forms that do not exist add.
        runs_past_end: Whether the instruction directly after a clump belongs to it, too; then a clump that ends before
            it begins has no end.
        keeps_offsets: Whether the Command map still shows after a program where its variables and descriptors were.
        shows_faults: Whether ProgStatus shows why a program could not start or ended with an error, not only that.
        decimals: Largest number of decimals of a float that becomes a text.
        crops_files: Whether a data file that a program leaves open ends after what was written.
        limits_volume: Whether the volume of a sound that a program plays is at most 4.
        cuts_exponents: Whether the zeros at the end of a text with an exponent are cut off as if they were decimals.
        float_remainder: Whether the remainder of floats is a float, not an integer.
        wide: Types in which a float from 2^31 to 2^32 is stored as an unsigned number.
        signed_constants: Whether the constant of SET has a sign if its target has one, and a float does not take it.
        enhanced_calls: Whether it has the community's system calls, and texts are drawn at every height.
        scans_integers: Whether a text is read as an integer, without 0x and exponent, if the target is not a float.
        replaces_arrays: Whether an array can replace an element that is an array.
        map_limit: Largest number of bytes of an IO map that one call reads or writes.
        misses_jumps: Whether a conditional jump that compares, in a clump that compares arrays or clusters, leads to a
            wrong place if it is not made.
        records: How the records of clumps are laid out.
        late_tick_ends_pass: Whether a pass ends with its first turn while the Tick of the Command map is behind.
        abort_stops_tick: Whether the Tick of the Command map leaves out the pass in which a program is aborted.
        searches_calibrations: Whether the start of a program looks for files of calibrations.
        port_groups: The motors that are set by a number, not one in an array, that is not one port's.
    """

    timing: Timing
    copies_arrays: bool
    builds_at_once: bool
    system_calls: int
    missing: frozenset[int]
    has_fields: bool = False
    accepts_mixed_comparisons: bool = False
    checks_short_forms: bool = False
    runs_past_end: bool = False
    keeps_offsets: bool = True
    shows_faults: bool = False
    decimals: int = 2
    crops_files: bool = True
    limits_volume: bool = True
    cuts_exponents: bool = False
    float_remainder: bool = False
    wide: tuple[int, ...] = (Type.ULONG, Type.SLONG)
    signed_constants: bool = False
    replaces_arrays: bool = False
    enhanced_calls: bool = False
    scans_integers: bool = False
    map_limit: int = 64
    misses_jumps: bool = False
    records: RecordFormat = ADDRESSES
    late_tick_ends_pass: bool = False
    abort_stops_tick: bool = True
    searches_calibrations: bool = True
    port_groups: Mapping[int, Sequence[int]] = MappingProxyType({})
