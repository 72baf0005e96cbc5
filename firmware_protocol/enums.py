"""Named numbers on the wire.

All enums here are *open*: a number without a name becomes an unnamed member instead of an exception, so that whatever
was on the wire can be reported. Source of all values: docs/firmware.md sections 4 to 6.
"""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import Self


class OpenEnum(IntEnum):
    """An integer enum that accepts unknown numbers as members named ``UNKNOWN_0xNN``."""

    @classmethod
    def _missing_(cls, value: object) -> Self | None:
        if not isinstance(value, int):
            return None
        member = int.__new__(cls, value)
        member._name_ = f"UNKNOWN_0x{value & 0xFF:02X}" if -128 <= value <= 255 else f"UNKNOWN_{value}"
        member._value_ = value
        return member

    @property
    def known(self) -> bool:
        """Whether this number has a name in the protocol."""
        return self._value_ in type(self)._value2member_map_

    @property
    def label(self) -> str:
        """The name in lower case with spaces, for people."""
        return self.name.lower().replace("_", " ") if self.known else f"unknown 0x{self._value_ & 0xFF:02X}"


class InputPort(OpenEnum):
    """Where sensors are plugged in; the wire counts from 0, the brick's case from 1."""

    IN_1 = 0
    IN_2 = 1
    IN_3 = 2
    IN_4 = 3


class OutputPort(OpenEnum):
    """Where motors are plugged in."""

    A = 0
    B = 1
    C = 2
    ALL = 0xFF


class OutputMode(IntFlag):
    """Bits of SetOutputState's mode byte."""

    MOTOR_ON = 0x01
    BRAKE = 0x02
    REGULATED = 0x04


class RegulationMode(OpenEnum):
    """What the firmware regulates; 4 exists only in the community firmware."""

    IDLE = 0
    SPEED = 1
    SYNC = 2
    POSITION = 4


class RunState(OpenEnum):
    """Phase of a motor's motion."""

    IDLE = 0x00
    RAMP_UP = 0x10
    RUNNING = 0x20
    RAMP_DOWN = 0x40
    HOLD = 0x60


class SensorType(OpenEnum):
    """Type of the sensor on an input port, as set by SetInputMode."""

    NONE = 0
    SWITCH = 1
    TEMPERATURE = 2
    REFLECTION = 3
    ANGLE = 4
    LIGHT_ACTIVE = 5
    LIGHT_INACTIVE = 6
    SOUND_DB = 7
    SOUND_DBA = 8
    CUSTOM = 9
    LOW_SPEED = 10
    LOW_SPEED_9V = 11
    HIGH_SPEED = 12
    COLOR_FULL = 13
    COLOR_RED = 14
    COLOR_GREEN = 15
    COLOR_BLUE = 16
    COLOR_NONE = 17


class SensorMode(OpenEnum):
    """How a raw value becomes the scaled one; the low five bits are the slope and may be added."""

    RAW = 0x00
    BOOLEAN = 0x20
    TRANSITION_COUNT = 0x40
    PERIOD_COUNT = 0x60
    PERCENT = 0x80
    CELSIUS = 0xA0
    FAHRENHEIT = 0xC0
    ANGLE_STEPS = 0xE0


class InterpreterState(OpenEnum):
    """What the interpreter of firmware 1.32 does with the program."""

    IDLE = 0
    RUNNING = 1
    STEP = 2
    PAUSED = 3
    STOPPING = 4
    ENDED = 5


class Property(OpenEnum):
    """What SetProperty and GetProperty address."""

    BLUETOOTH = 0
    VOLUME = 1
    SLEEP_TIME = 2
    DEBUGGING = 15  # 1.32
