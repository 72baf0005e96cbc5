"""The direct commands, 0x00 to 0x21. Source: docs/firmware.md section 4.

No ``from __future__ import annotations`` here: the declarations' annotations are read as objects.
"""

from firmware_protocol.telegram import Command, Reply, direct, reply
from firmware_protocol.wire import S8, S32, U32, OutputModeField, OutputPortField, RegulationModeField, RunStateField


@reply
class OutputState(Reply):
    """One motor, as of the firmware's previous 1 ms pass.

    Attributes:
        port: Echo of the port asked for.
        power: As commanded, percent, -100..100 (the wire allows -128..127).
        mode: As commanded.
        regulation: As commanded.
        turn_ratio: As commanded, -100..100.
        run_state: Live.
        tacho_limit: As commanded, degrees; 0 is no limit.
        tacho_count: Degrees since the last motor reset (basis of the limit).
        block_tacho_count: Degrees since the last block reset (basis of synchronisation).
        rotation_count: Degrees since the last rotation reset; the one for odometry.
    """

    port: OutputPortField
    power: S8
    mode: OutputModeField
    regulation: RegulationModeField
    turn_ratio: S8
    run_state: RunStateField
    tacho_limit: U32
    tacho_count: S32
    block_tacho_count: S32
    rotation_count: S32


@direct(0x06)
class GetOutputState(Command[OutputState]):
    """Read one motor. Ports other than A, B, C are refused with OUT_OF_RANGE and zeros."""

    port: OutputPortField
