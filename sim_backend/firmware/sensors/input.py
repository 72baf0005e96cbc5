"""The input module: readings of the four input ports. Source: docs/firmware.md section 6."""

from __future__ import annotations

from collections.abc import Sequence

from firmware_protocol.enums import SensorType
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sensors.analog import FULL_SCALE, NORMALIZE
from sim_backend.firmware.sensors.color import ColorDevice
from sim_backend.firmware.sensors.input_pins import COLOR_PINS, LAMP_OFF, PIN_SETTINGS
from sim_backend.firmware.sensors.input_port import COLOR_EXIT, COLOR_TYPES, INVALID, SETTLING_COLOR, InputPort
from sim_backend.firmware.versions import Version

_SETTLING, _SETTLING_SOUND = 20, 300
_SOUND = (SensorType.SOUND_DB, SensorType.SOUND_DBA)
_DIGITAL = range(SensorType.LOW_SPEED, SensorType.COLOR_FULL)
_LAMPS = (*range(SensorType.COLOR_FULL, SensorType.COLOR_NONE), COLOR_EXIT)
"""Types after which a colour sensor must be switched off."""

_SILENT = frozenset({SensorType.NONE, SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V})
"""Types whose value is not read."""


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
        self._version = version
        self._silent: frozenset[int] = frozenset() if version.evaluates_every_type else _SILENT
        self._analog = frozenset(range(1 << 8) if version.evaluates_every_type else NORMALIZE)
        if version.reads_digital_raw:
            self._silent -= frozenset(_DIGITAL)
        reading = FULL_SCALE if version.evaluates_every_type else 0
        self.ports: Sequence[InputPort] = [
            InputPort(reading, frees_first_pin=version.frees_first_pin) for _ in range(4)
        ]
        self.due_ms = NEVER
        self._clock = clock
        self._last_ms = clock.now_ms
        self._watched: list[InputPort] = []

    def wake(self) -> None:
        """Run in the next pass: a type, mode or sensor changed."""
        self.due_ms = self._clock.now_ms + 1

    def store(self, number: int, **values: int) -> None:
        """Store attributes of a port, as a write to the map does; a new type or mode takes effect in the next pass."""
        for name, value in values.items():
            setattr(self.ports[number], name, int(value))
        self.wake()

    def keep_type(self, number: int, sensor_type: int, mode: int) -> None:
        """Give a port a type and mode, unless it has them."""
        port = self.ports[number]
        if (port.type, port.mode) != (sensor_type, mode):
            self.store(number, type=sensor_type, mode=mode)

    def drop_types(self) -> None:
        """Leave all ports without types."""
        for number in range(len(self.ports)):
            self.store(number, type=SensorType.NONE)

    def plug_in(self, port: InputPort, sensor: object) -> None:
        """Handle a changed sensor, or None; the calibration of a colour sensor is read first."""
        port.color.plug_in(sensor if isinstance(sensor, ColorDevice) else None)
        if port.type in COLOR_TYPES:
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
        woken = self.due_ms <= now_ms
        if not (woken or self._watched):
            return
        ports = self.ports if woken else self._watched
        self.due_ms, self._watched = NEVER, []
        for port in ports:
            if port.type == port.known_type and not (port.settling or port.invalid):  # nothing to settle
                if port.type in self._silent:
                    continue  # nothing to read: most ports in most passes
                if not woken and port.reads_the_same:
                    continue
                if port.type in self._analog:  # most of the others
                    self._watched.append(port)
                    counts = port.counts
                    if counts:
                        self.due_ms = min(self.due_ms, now_ms + 1)
                    if counts or woken:
                        port.read()
                    else:
                        port.read_again()
                    continue
            self._watched.append(port)
            self._update(port, passes)
            due = NEVER
            if port.invalid & INVALID:
                due = now_ms + port.settling
            elif port.type in NORMALIZE or port.type == SensorType.CUSTOM or self._version.evaluates_every_type:
                port.read()
                due = now_ms + 1 if port.counts else NEVER
            elif port.type in _DIGITAL and self._version.reads_digital_raw:
                port.raw = port.voltage
            elif port.color.device is not None and port.type in COLOR_TYPES:
                port.read_color(port.color.device)
            if self._version.color_sensor and (COLOR_EXIT in (port.type, port.known_type) or port.reads_calibration):
                due = now_ms + 1
            self.due_ms = min(self.due_ms, due)

    def _update(self, port: InputPort, passes: int) -> None:
        """Configure a port with a new type, or let it settle."""
        lacks_color_sensor = self._version.color_sensor and port.color.device is None
        if port.type != port.known_type:
            if lacks_color_sensor and port.type == SensorType.NONE and port.known_type in _LAMPS:
                port.type = COLOR_EXIT
                port.color.begin_reading()
                port.configure(NEVER, self._pins(COLOR_EXIT))
                return
            if port.type == COLOR_EXIT:
                port.color.begin_reading()
            if self._version.color_sensor and port.type in COLOR_TYPES:
                port.color.begin_calibration()
                if self._version.absent_color is not None:
                    port.scaled = self._version.absent_color
            port.configure(self._settling(port), self._pins(port.type))
        elif lacks_color_sensor and (port.type in COLOR_TYPES or port.type == COLOR_EXIT):
            port.await_color_sensor(passes, invalidates=self._version.absent_color is None)
        else:
            port.settle(passes)

    def _settling(self, port: InputPort) -> int | None:
        """Return the number of passes with invalid values after a change of type, or None if nothing must settle."""
        new, old = port.type, port.known_type
        if self._version.color_sensor and new in COLOR_TYPES:
            return SETTLING_COLOR
        if self._version.settles_by_pins and self._pins(new) == self._pins(old):
            return None
        return _SETTLING_SOUND if new in _SOUND else _SETTLING

    def _pins(self, sensor_type: int) -> int | None:
        """Return the pin setting of a type, or None if it leaves the pins as they are."""
        if self._version.settles_by_pins:
            return PIN_SETTINGS.get(sensor_type, LAMP_OFF)
        if sensor_type in COLOR_TYPES:
            return COLOR_PINS
        return PIN_SETTINGS.get(sensor_type, 0 if sensor_type < COLOR_EXIT else None)
