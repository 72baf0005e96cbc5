"""How the firmware versions differ. Source: docs/firmware.md section 11.

Each field names a behaviour; modules read the field and never compare version numbers.
"""

from __future__ import annotations

from dataclasses import dataclass

from sim_backend.firmware.vm.dialect import Dialect, Timing
from sim_backend.firmware.vm.memory import Layout
from sim_backend.firmware.vm.rxe import Type


@dataclass(frozen=True)
class Version:
    """One firmware version.

    Attributes:
        major: As GetVersions reports it.
        minor: As GetVersions reports it.
        extended_commands: Whether it has the commands 0x19 to 0x21 and 0x8D, and the sync times in the Command map.
        color_sensor: Whether it has the colour sensor and its variables in the Input map.
        evaluates_every_type: Whether inputs of every type are read, not only analog ones.
        settles_by_pins: Whether a new type needs time to settle only if it sets the pins of the input differently.
        write_end_steps: For how many interrupts of the I2C timer after a write the firmware takes it for the end, if a
            read follows; otherwise it sees the end after the turn to reading.
        waits_for_clock: Whether an I2C transfer waits while a device holds the clock line low.
        stops_all_synchronised: Whether the end of a synchronised ramp-down in B or C stops every synchronised motor, or
            only the partner.
        strict_data_names: Whether data files may not have names of programs.
        writing_prevents_deletion: Whether a file cannot be deleted while it is being written.
        deletion_spares_found: Whether a listing that has just found a deleted file skips the next one.
        sectors: Flash sectors for files.
        directory_size: Maximum number of files.
        settings: Content of the settings file.
        pool: Layout of the memory pool of programs.
        dialect: What its interpreter of programs can do.
    """

    major: int
    minor: int
    extended_commands: bool
    color_sensor: bool
    evaluates_every_type: bool
    settles_by_pins: bool
    write_end_steps: int
    waits_for_clock: bool
    stops_all_synchronised: bool
    strict_data_names: bool
    writing_prevents_deletion: bool
    deletion_spares_found: bool
    sectors: int
    directory_size: int
    settings: bytes
    pool: Layout
    dialect: Dialect


VERSIONS = {
    "1.29": Version(
        major=1,
        minor=29,
        extended_commands=True,
        color_sensor=True,
        evaluates_every_type=False,
        settles_by_pins=False,
        write_end_steps=0,
        waits_for_clock=True,
        stops_all_synchronised=True,
        strict_data_names=True,
        writing_prevents_deletion=True,
        deletion_spares_found=True,
        sectors=477,
        directory_size=127,
        settings=bytes.fromhex("780104030000"),
        pool=Layout(clump=28, growth=25, doubly_linked=True),
        dialect=Dialect(
            Timing(instructions=54, turns=2_000),
            copies_arrays=True,
            system_calls=48,
            missing=frozenset(),
        ),
    ),
    "1.05": Version(
        major=1,
        minor=5,
        extended_commands=False,
        color_sensor=False,
        evaluates_every_type=True,
        settles_by_pins=True,
        write_end_steps=9,
        waits_for_clock=False,
        stops_all_synchronised=True,
        strict_data_names=False,
        writing_prevents_deletion=False,
        deletion_spares_found=False,
        sectors=491,
        directory_size=63,
        settings=bytes.fromhex("cb"),
        pool=Layout(clump=20, growth=5, doubly_linked=False, newest_type=Type.MUTEX),
        dialect=Dialect(
            Timing(instructions=1 << 30, turns=49),
            copies_arrays=False,
            system_calls=34,
            missing=frozenset({0x34, 0x36, 0x37}),
        ),
    ),
}
"""The firmware versions that can be simulated, the default first."""

FIRMWARES = tuple(VERSIONS)
