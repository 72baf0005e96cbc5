"""How the firmware versions differ. Source: docs/firmware.md section 11.

Each field names a behaviour; modules read the field and never compare version numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

from firmware_protocol import iomap
from sim_backend.firmware.vm.clump_records import WITH_POINTS, WORDS
from sim_backend.firmware.vm.dialect import ENHANCED, Dialect, Timing
from sim_backend.firmware.vm.pool_layout import Layout
from sim_backend.firmware.vm.rxe import Type


@dataclass(frozen=True)
class Version:
    """One firmware version.

    Attributes:
        major: As GetVersions reports it.
        minor: As GetVersions reports it.
        commands_since: The firmware versions whose commands it has (docs/protocol.md marks them).
        data_log: Whether the main menu has an item for the data log, whose files are .log (else .rdt).
        enter_keeps_program: Whether exit does not stop a program when it is pressed together with enter.
        color_sensor: Whether it has the colour sensor and its variables in the Input map.
        evaluates_every_type: Whether inputs of every type are read, not only analog ones.
        absent_color: Value of a type of the colour sensor without a sensor, valid after the sensor's time to settle;
            None if the value is kept and never valid.
        reads_digital_raw: Whether the converter's value is also shown for types of digital sensors.
        settles_by_pins: Whether a new type needs time to settle only if it sets the pins of the input differently.
        frees_first_pin: Whether the first digital pin of a custom sensor can become an input; else it stays an output.
        ends_write_early: Whether the I2C bus treats the end of the bytes written as the end of the write although a
            read follows; otherwise it waits for the acknowledge of the read address.
        waits_for_clock: Whether an I2C transfer waits while a device holds the clock line low.
        suspends_reads: Whether a message suspends an I2C read that was cut short at once; otherwise when it is sent.
        resends_messages: Whether an I2C message without acknowledge is sent again; otherwise the bytes after it are.
        counts_full_ring: Whether an idle port counts the 16 bytes of a full receive ring; otherwise it counts none.
        write_options: Whether LSWrite takes ports modulo 4, with options in higher bits; otherwise it refuses others.
        ends_high_speed: Whether the state of the high speed port becomes 6 after a request was executed.
        high_speed_modulus: Modulus of the place from which bytes of the high speed port are fetched, in a ring of
            128.
        end_restores_screen: Whether the pass after the end of a program switches the display and its refresh on.
        stops_all_synchronised: Whether the end of a synchronised ramp-down in B or C stops every synchronised motor,
            or only the partner.
        windup_by_gain: Whether the limit of the position error in speed regulation is divided by the P gain.
        wraps_sync_error: Whether the difference of two synchronised motors' counts has only 16 bits.
        regulates_position: Whether motors can be regulated to a position, with options in the upper four bits of their
            mode, and with a period that can be changed.
        port_groups: The motors that SetOutputState sets by a number that is not one port's.
        ignores_leading_extension: Whether a name that begins with the extension of a program has none.
        strict_data_names: Whether data files may not have names of programs.
        writing_prevents_deletion: Whether a file cannot be deleted while it is being written.
        deletion_spares_found: Whether a listing that has just found a deleted file skips the next one.
        linear_data_files: Whether data files are contiguous, too.
        counts_written: Whether the bytes of a file that is opened to write count as read; otherwise no count changes.
        sectors: Flash sectors for files.
        flash_start: Address of the first of these.
        directory_size: Maximum number of files.
        settings: Content of the settings file.
        free_flash_at: Where the free flash is, after the field for a pattern of modules.
        pool: Layout of the memory pool of programs.
        dialect: Properties of its interpreter of programs.
        map_sizes: Sizes of the IO maps that differ from their declaration, by module.
        map_presets: Bytes of IO maps that are set at power-on, by module and offset.
    """

    major: int
    minor: int
    commands_since: Collection[str]
    data_log: bool
    enter_keeps_program: bool
    color_sensor: bool
    evaluates_every_type: bool
    absent_color: int | None
    reads_digital_raw: bool
    settles_by_pins: bool
    frees_first_pin: bool
    ends_write_early: bool
    waits_for_clock: bool
    suspends_reads: bool
    resends_messages: bool
    counts_full_ring: bool
    write_options: bool
    ends_high_speed: bool
    high_speed_modulus: int
    end_restores_screen: bool
    stops_all_synchronised: bool
    windup_by_gain: bool
    wraps_sync_error: bool
    regulates_position: bool
    port_groups: Mapping[int, Sequence[int]]
    ignores_leading_extension: bool
    strict_data_names: bool
    writing_prevents_deletion: bool
    deletion_spares_found: bool
    linear_data_files: bool
    counts_written: bool
    flash_start: int
    sectors: int
    directory_size: int
    settings: bytes
    free_flash_at: int
    pool: Layout
    dialect: Dialect
    map_sizes: Mapping[str, int]
    map_presets: Mapping[str, Mapping[int, bytes]]


_KNOWN_TYPES = bytes(range(Type.NOTHING)).ljust(256, bytes([Type.UNKNOWN]))
_TYPES_1_05 = bytes([Type.NOTHING, *range(1, Type.FLOAT)]).ljust(256, bytes([Type.NOTHING]))

_V1_29 = Version(
    major=1,
    minor=29,
    commands_since=("1.05", "1.28"),
    data_log=True,
    enter_keeps_program=False,
    color_sensor=True,
    evaluates_every_type=False,
    absent_color=None,
    reads_digital_raw=False,
    settles_by_pins=False,
    frees_first_pin=False,
    ends_write_early=False,
    waits_for_clock=True,
    suspends_reads=True,
    resends_messages=False,
    counts_full_ring=False,
    write_options=False,
    ends_high_speed=False,
    high_speed_modulus=64,
    end_restores_screen=False,
    stops_all_synchronised=True,
    windup_by_gain=True,
    wraps_sync_error=False,
    regulates_position=False,
    port_groups={0xFF: (0, 1, 2)},
    ignores_leading_extension=True,
    strict_data_names=True,
    writing_prevents_deletion=True,
    deletion_spares_found=True,
    linear_data_files=False,
    counts_written=False,
    flash_start=0x122100,
    sectors=477,
    directory_size=127,
    settings=bytes.fromhex("780104030000"),
    free_flash_at=8,
    pool=Layout(clump=28, fire_count=13, growth=25, doubly_linked=True, types=_KNOWN_TYPES),
    dialect=Dialect(
        Timing(instructions=54, turns=2_000),
        copies_arrays=True,
        builds_at_once=True,
        system_calls=48,
        missing=ENHANCED,
    ),
    map_sizes={},
    map_presets={},
)

_V1_05 = replace(
    _V1_29,
    minor=5,
    commands_since=("1.05",),
    data_log=False,
    color_sensor=False,
    evaluates_every_type=True,
    settles_by_pins=True,
    ends_write_early=True,
    waits_for_clock=False,
    suspends_reads=False,
    wraps_sync_error=True,
    ignores_leading_extension=False,
    strict_data_names=False,
    writing_prevents_deletion=False,
    deletion_spares_found=False,
    linear_data_files=True,
    flash_start=0x121400,
    sectors=491,
    directory_size=63,
    settings=bytes.fromhex("cb"),
    pool=Layout(clump=20, fire_count=7, growth=5, doubly_linked=False, types=_TYPES_1_05),
    dialect=Dialect(
        Timing(instructions=1 << 30, turns=49),
        copies_arrays=False,
        builds_at_once=False,
        system_calls=34,
        missing=ENHANCED | {0x34, 0x36, 0x37},
        crops_files=False,
        limits_volume=False,
        has_fields=True,
        accepts_mixed_comparisons=True,
        checks_short_forms=True,
        runs_past_end=True,
        records=WORDS,
        late_tick_ends_pass=True,
        abort_stops_tick=False,
        searches_calibrations=False,
        scans_integers=True,
    ),
    map_sizes={"Command.mod": iomap.COMMAND.size_1_05, "Input.mod": iomap.INPUT.size_1_05},
)

_PORT_GROUPS = {3: (0, 1), 4: (0, 2), 5: (1, 2), 6: (0, 1, 2)}
_BELOW_ALL = 0xF9
"""Added to a group's number, it gives another number of the same group in SetOutputState, 255 for all motors."""

_V1_32 = replace(
    _V1_29,
    minor=32,
    enter_keeps_program=True,
    frees_first_pin=True,
    commands_since=("1.05", "1.28", "1.32"),
    absent_color=1,
    reads_digital_raw=True,
    windup_by_gain=False,
    regulates_position=True,
    port_groups=_PORT_GROUPS | {_BELOW_ALL + number: ports for number, ports in _PORT_GROUPS.items()},
    ends_high_speed=True,
    high_speed_modulus=128,
    end_restores_screen=True,
    stops_all_synchronised=False,
    counts_written=True,
    resends_messages=True,
    counts_full_ring=True,
    write_options=True,
    flash_start=0x126400,
    sectors=410,
    free_flash_at=12,
    pool=_V1_29.pool._replace(clump=48, called=29),
    dialect=_V1_29.dialect._replace(
        port_groups=_PORT_GROUPS,
        copies_arrays=False,
        missing=frozenset(),
        records=WITH_POINTS,
        shows_faults=True,
        keeps_offsets=False,
        decimals=4,
        cuts_exponents=True,
        float_remainder=True,
        wide=(Type.ULONG,),
        signed_constants=True,
        replaces_arrays=True,
        enhanced_calls=True,
        scans_integers=True,
        map_limit=800,
        misses_jumps=True,
        system_calls=100,
    ),
    map_sizes={"Comm.mod": 1900, "Input.mod": 420, "Low Speed.mod": 172, "Ui.mod": 44},
    map_presets={
        "Comm.mod": {1892: b"\x0f", 1896: bytes.fromhex("c0080002")},
        "Display.mod": {1719: b"\x5a"},
        "Output.mod": {30: b"\x50\x14", 62: b"\x50\x14", 94: b"\x50\x14", 96: b"\x64"},
        "Ui.mod": {40: b"\x01"},
    },
)

VERSIONS = {"1.29": _V1_29, "1.05": _V1_05, "1.32": _V1_32}
"""The firmware versions that can be simulated, the default first."""

FIRMWARES = tuple(VERSIONS)
