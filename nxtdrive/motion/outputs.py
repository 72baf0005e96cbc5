"""Output ports at the level of the firmware: leased motion, rest, and consistent readings.

**The lease.** Neither a pulled cable nor a dead PC stops a motor: the firmware keeps executing the last command. So
every motion has a tacho limit a little way ahead, which a running program keeps moving on. Limits count from the last
target and add up (docs/firmware.md section 1, fact 12), so the limit must be set afresh each time, without disturbing
the regulator. One write to the output module's IO map does both in a single pass of the firmware: it resets
TachoCount and the base of the limit, and sets speed, limit and mode (docs/firmware.md sections 5.2 and 9.1). It works
on every firmware, an unchanged speed does not disturb the regulator, and RotationCount, which odometry uses, is not
touched.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from firmware_protocol.direct import GetOutputState, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.iomap import OUTPUT, OutputFlag
from firmware_protocol.system import IO_MAP_READ_HEADER, IOMapRead, IOMapWrite
from nxtdrive.link.link import Link

FULL_SPEED_DEG_S = 100 / 0.101
"""Regulated speed at 100 %: 100 counts of one degree per regulation period of 101 ms. Source: docs/firmware.md 9.6."""
SLOWEST_DEG_S = 10.0
"""Lowest regulated speed, and the resolution of speeds: one percent."""

_COMMAND = struct.Struct("<IhBBbbBBBBBBb")
"""TachoLimit, spare, Flags, Mode, Speed, ActualSpeed, P, I, D, RunState, RegMode, Overloaded, SyncTurn."""
_GAINS = (96, 32, 32)
_COUNT_SIZE = 4
_UPDATE = OutputFlag.MODE | OutputFlag.SPEED | OutputFlag.TACHO_LIMIT | OutputFlag.RESET_TACHO_COUNT

_DRIVEN = OutputMode.MOTOR_ON | OutputMode.BRAKE
_HELD = OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED


def driven(port: OutputPort, power: int, lease_deg: int, *, regulated: bool) -> IOMapWrite:
    """Run a motor for at most `lease_deg` degrees from here; then it coasts.

    Args:
        port: A, B or C.
        power: Percent, -100..100; if regulated, percent of `FULL_SPEED_DEG_S`.
        lease_deg: At least 1.
        regulated: Whether the firmware regulates the speed; else it sets the power.
    """
    mode = _HELD if regulated else _DRIVEN
    regulation = RegulationMode.SPEED if regulated else RegulationMode.IDLE
    data = _COMMAND.pack(
        max(1, lease_deg), 0, _UPDATE, mode, power, 0, *_GAINS, RunState.RUNNING, regulation, 0, 0
    )  # fmt: skip
    return IOMapWrite.put(OUTPUT.module_id, OUTPUT.field("TachoLimit", port).offset, data)


def braked(port: OutputPort) -> SetOutputState:
    """Stop a motor now by shorting its windings."""
    return SetOutputState(port, 0, _DRIVEN, RegulationMode.IDLE, 0, RunState.RUNNING, 0)


def held(port: OutputPort) -> SetOutputState:
    """Stop a motor now and have the firmware hold its position.

    The turn ratio has no effect on a single motor, but it makes this command differ from a brake. Otherwise the
    firmware would take it for a repetition of a brake just before, and turn the motor back by what it turned while
    braking (docs/firmware.md section 9.1).
    """
    return SetOutputState(port, 0, _HELD, RegulationMode.SPEED, 1, RunState.RUNNING, 0)


def coasting(port: OutputPort) -> SetOutputState:
    """Switch a motor off; it coasts."""
    return SetOutputState(port, 0, OutputMode(0), RegulationMode.IDLE, 0, RunState.IDLE, 0)


@dataclass(frozen=True, slots=True)
class Sample:
    """Rotation counts read at one time.

    Attributes:
        angles_deg: One per port.
        time_s: Time of the reading on the link's clock: half way between request and reply.
        delay_s: Round trip of the reading; a command sent now acts about this long after `time_s`.
        transport: What it came over; another one than the last reading's means that the link was lost in between.
    """

    angles_deg: tuple[int, ...]
    time_s: float
    delay_s: float
    transport: object


def sample(link: Link, *ports: OutputPort) -> Sample:
    """Read the RotationCount of one or several motors.

    Neighbouring ports are read from the IO map in one telegram, so both counts are of the same millisecond. If that
    does not fit into a telegram (A and C over USB), the ports are read one after the other.
    """
    before = link.now()
    starts = [OUTPUT.field("RotationCount", port).offset for port in ports]
    first, size = min(starts), max(starts) - min(starts) + _COUNT_SIZE
    if len(ports) > 1 and IO_MAP_READ_HEADER + size <= link.max_telegram:
        data = link.request(IOMapRead(OUTPUT.module_id, first, size)).data
        angles = tuple(_count(data, start - first) for start in starts)
    else:
        angles = tuple(link.request(GetOutputState(port)).rotation_count for port in ports)
    after = link.now()
    return Sample(angles, (before + after) / 2, after - before, link.transport)


def _count(data: bytes, start: int) -> int:
    return int.from_bytes(data[start : start + _COUNT_SIZE], "little", signed=True)
