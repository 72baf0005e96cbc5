"""The input module: readings of the four input ports. Source: docs/firmware.md section 6; the map is in section 5.2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.analog import FULL_SCALE, LEVEL, NORMALIZE, band, boolean, step
from sim_backend.firmware.cint import s16
from sim_backend.firmware.color import ColorDevice, ColorPort, background
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.versions import Version

DEBOUNCE = 100
"""Passes without counting after each counted edge."""

_MODE = 0xE0
_SLOPE = 0x1F
_COUNTING = (SensorMode.TRANSITION_COUNT, SensorMode.PERIOD_COUNT, SensorMode.ANGLE_STEPS)
_SETTLING = 20
_SETTLING_SOUND = 300
_SETTLING_COLOR = 400
_SOUND = (SensorType.SOUND_DB, SensorType.SOUND_DBA)
_COLOR = range(SensorType.COLOR_FULL, SensorType.COLOR_NONE + 1)
_PLAIN = (SensorType.NONE, SensorType.SWITCH, SensorType.TEMPERATURE)
"""Types that share one pin configuration."""


class AnalogSensor(Protocol):
    """A sensor on the converter of an input port."""

    def raw(self) -> int:
        """The converter's value now, 0..1023."""


class InputPort:
    """One input port.

    Attributes:
        sensor: The sensor, or None for an open port.
        type: As commanded.
        known_type: The type that the port is configured for.
        mode: As commanded.
        raw: Converter value, 0..1023.
        normalized: 0..1023.
        scaled: Value in the mode.
        boolean: Whether "pressed".
        invalid: Whether the values are not yet those of the type.
        custom_zero_offset, custom_full_scale, custom_active: For `SensorType.CUSTOM`; stored only.
        pin_directions, pins_in, pins_out: The two digital lines.
        color: Values of a colour sensor.
    """

    def __init__(self, reading: int) -> None:
        self.sensor: AnalogSensor | None = None
        self.type = self.known_type = int(SensorType.NONE)
        self.mode = int(SensorMode.RAW)
        self.raw = self.normalized = self.scaled = reading
        self.boolean = 0
        self.invalid = False
        self.custom_zero_offset = self.custom_full_scale = self.custom_active = 0
        self.pin_directions, self.pins_in, self.pins_out = 0, 3, 0
        self.color = ColorPort()
        self._settling = self._band = self._debounce = self._last = 0

    @property
    def counts(self) -> bool:
        """Whether the values depend on earlier readings, so that no pass may be skipped."""
        return bool(self.mode & _SLOPE) or self.mode & _MODE in _COUNTING

    def settle(self, passes: int) -> int:
        """Accept the new type; the values stay invalid for `passes` passes."""
        self.known_type = self.type
        self._settling = passes
        return passes

    def wait(self, passes: int) -> int:
        """Advance by `passes`; returns the remaining settling passes, -1 when it is over."""
        left = self._settling - passes
        self._settling = max(left, 0)
        return left

    def reset(self) -> None:
        """Reset type, mode and values; the type counts as changed only if it was different."""
        self.type, self.mode, self.invalid = int(SensorType.NONE), int(SensorMode.RAW), True
        self.raw = self.normalized = self.scaled = self.boolean = 0

    def read(self) -> None:
        """Read and scale the sensor's value."""
        self.raw = raw = self.sensor.raw() if self.sensor is not None else FULL_SCALE
        normalize = NORMALIZE.get(self.type)
        self._scale(normalize(raw) if normalize else raw)

    def read_color(self, device: ColorDevice) -> None:
        """Read the colour sensor: the colour, or the brightness with one lamp on."""
        if self.type == SensorType.COLOR_FULL:
            self.scaled = self.color.look(device, self.mode)
            return
        self.raw = device.lit(self.type - SensorType.COLOR_RED)
        self._scale(background(self.raw))

    def _scale(self, normalized: int) -> None:
        before = self.normalized
        self.normalized = normalized
        self.boolean = boolean(normalized, self.mode & _SLOPE, before, self.boolean)
        mode = self.mode & _MODE
        if level := LEVEL.get(mode):
            self.scaled = level(normalized)
        elif mode == SensorMode.BOOLEAN:
            self.scaled = self.boolean
        elif mode == SensorMode.ANGLE_STEPS:
            now = band(normalized)
            self.scaled = s16(self.scaled + step(self._band, now))
            self._band = now
        else:
            self._count_edge(mode)

    def _count_edge(self, mode: int) -> None:
        if self._debounce:
            self._debounce -= 1
        elif self.boolean != self._last:
            self._last = self.boolean
            self._debounce = DEBOUNCE
            if mode == SensorMode.TRANSITION_COUNT or not self.boolean:
                self.scaled = s16(self.scaled + 1)


class InputModule:
    """Four input ports.

    Attributes:
        due_ms: See `Module`.
        ports: Ports 1 to 4.
    """

    def __init__(self, clock: Clock, version: Version) -> None:
        """Make the module of a brick that has just booted.

        Args:
            clock: The brick's time.
            version: The firmware version.
        """
        self._evaluates_all = version.evaluates_every_type
        self.ports: Sequence[InputPort] = [InputPort(FULL_SCALE if self._evaluates_all else 0) for _ in range(4)]
        self.due_ms = NEVER
        self._clock = clock
        self._last_ms = clock.now_ms

    def wake(self) -> None:
        """Run in the next pass: a type, mode or sensor changed."""
        self.due_ms = self._clock.now_ms + 1

    def set_mode(self, port: InputPort, sensor_type: int, mode: int) -> None:
        """Set type and mode; the values are invalid until a later pass."""
        port.type, port.mode, port.invalid = sensor_type, mode, True
        self.wake()

    def plug_in(self, port: InputPort, sensor: object) -> None:
        """Handle a changed sensor, or None; the calibration of a colour sensor is read first."""
        port.color.plug_in(sensor if isinstance(sensor, ColorDevice) else None)
        if port.type in _COLOR:
            port.known_type = SensorType.NONE
        self.wake()

    def reset(self) -> None:
        """Reset all types, modes and values."""
        for port in self.ports:
            port.reset()
        self.wake()

    def run(self, now_ms: int) -> None:
        """Read the sensors; skipped passes count for settling only."""
        passes, self._last_ms = now_ms - self._last_ms, now_ms
        due = NEVER
        for port in self.ports:
            if port.type != port.known_type:
                port.invalid = True
                left = port.settle(self._settling(port))
            else:
                left = port.wait(passes) if port.invalid else -1
            if left >= 0:
                due = min(due, now_ms + left + 1)
                continue
            port.invalid = False
            if port.type in NORMALIZE or self._evaluates_all:
                port.read()
                if port.counts:
                    due = now_ms + 1
            elif port.color.device is not None and port.type in _COLOR:
                port.read_color(port.color.device)
        self.due_ms = due

    def _settling(self, port: InputPort) -> int:
        """Number of passes after a change of type in which the values are invalid."""
        new, old = port.type, port.known_type
        if self._evaluates_all:
            if new in _PLAIN and old in _PLAIN:
                return 0
            return _SETTLING_SOUND if new in _SOUND and old in _SOUND else _SETTLING
        if new in _COLOR:
            return NEVER if port.color.device is None else _SETTLING_COLOR
        return _SETTLING_SOUND if new in _SOUND else _SETTLING
