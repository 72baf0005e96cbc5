"""The input module: readings of the four input ports. Source: docs/firmware.md section 6; the map is in section 5.2."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.cint import s16
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sensors.analog import (
    FULL_SCALE,
    LEVEL,
    MODE_BITS,
    NORMALIZE,
    SLOPE_BITS,
    RotationDisc,
    boolean,
    full_scale,
)
from sim_backend.firmware.sensors.color import CALIBRATING, OFF, ColorDevice, ColorPort, background
from sim_backend.firmware.sensors.i2c_wires import Wires
from sim_backend.firmware.sensors.input_pins import COLOR_PINS, CUSTOM_SUPPLY, LAMP_OFF, LEVELS, PIN_SETTINGS, SUPPLY
from sim_backend.firmware.versions import Version

DEBOUNCE = 100
"""Passes without counting after each counted edge."""

INVALID = 0x01
"""Bit of the validity byte that the firmware sets and clears; the byte's other bits stay as written."""

COLOR_EXIT = 18
"""Type of a port whose colour sensor is being switched off: until the converter reads more than `_EXIT_RAW`."""

_PINS = 0x03
_COUNTING = (SensorMode.TRANSITION_COUNT, SensorMode.PERIOD_COUNT, SensorMode.ANGLE_STEPS)
_SETTLING, _SETTLING_SOUND, _SETTLING_COLOR = 20, 300, 400
_SOUND = (SensorType.SOUND_DB, SensorType.SOUND_DBA)
COLOR_TYPES = range(SensorType.COLOR_FULL, SensorType.COLOR_NONE + 1)
_DIGITAL = range(SensorType.LOW_SPEED, SensorType.COLOR_FULL)
_EXIT_RAW = 50
_LAMPS = (*range(SensorType.COLOR_FULL, SensorType.COLOR_NONE), COLOR_EXIT)
"""Types after which a colour sensor must be switched off."""

_CALIBRATION_CLOCK = (True, False, True, False)
"""Levels of the first pin in the passes in which the calibration of a colour sensor is read; the last one stays."""

_SILENT = frozenset({SensorType.NONE, SensorType.LOW_SPEED, SensorType.LOW_SPEED_9V})
"""Types whose value is not read."""


class AnalogSensor(Protocol):
    """A sensor on the converter of an input port."""

    def raw(self) -> int:
        """Return the converter's value now, 0..1023."""


_DRIVEN = (SensorType.CUSTOM, *COLOR_TYPES)
"""Types whose values depend on the pins or take several passes, even without a sensor."""


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
        invalid: Whether the values are not yet those of the type: see `INVALID`.
        pins: The two digital pins, of which digital sensors make clock and data line; set by the low speed module.
        settling: Remaining passes until the values of a new type are valid.
        custom_zero_offset, custom_full_scale: Scale of `SensorType.CUSTOM`: raw value of 0, percent of the converter's.
        custom_active: Supply of `SensorType.CUSTOM`, see `CUSTOM_SUPPLY`.
        pin_directions, pins_in, pins_out: The two digital lines; only `SensorType.CUSTOM` uses them.
        supply: Battery voltage on the port: 1 in pulses, 0x10 all the time, or 0.
        color: Values of a colour sensor.
        zero_divisions: How often a percentage of 0 divided; the result on a brick is unknown, here it is 0.
    """

    pins: Wires

    def __init__(self, reading: int, *, frees_first_pin: bool) -> None:
        self.sensor: AnalogSensor | None = None
        self.type = self.known_type = int(SensorType.NONE)
        self.mode = int(SensorMode.RAW)
        self.raw = self.normalized = self.scaled = reading
        self.boolean = self.invalid = self.settling = 0
        self.custom_zero_offset = self.custom_full_scale = self.custom_active = 0
        self.pin_directions, self.pins_in, self.pins_out, self.supply = 0, 3, 0, 0
        self.color = ColorPort()
        self._inputs = (0, 1) if frees_first_pin else (1,)
        self._disc = RotationDisc()
        self._debounce = self._edges = self.zero_divisions = 0

    @property
    def voltage(self) -> int:
        """The converter's value now, 0..1023."""
        return self.sensor.raw() if self.sensor is not None else FULL_SCALE

    @property
    def counts(self) -> bool:
        """Whether the values depend on earlier readings, or passes are counted, so that none may be skipped."""
        divides_by_zero = self.type == SensorType.CUSTOM and not self.custom_full_scale
        return divides_by_zero or bool(self.mode & SLOPE_BITS) or self.mode & MODE_BITS in _COUNTING

    @property
    def reads_the_same(self) -> bool:
        """Whether another pass reads the same values, unless the module wakes up."""
        return self.sensor is None and self.type not in _DRIVEN and not self.counts

    def configure(self, settling: int | None, pins: int | None) -> None:
        """Accept the new type, with cleared counters.

        Args:
            settling: Passes in which the values are invalid; None leaves that unchanged.
            pins: Setting of the pins, see `PIN_SETTINGS`; None leaves them.
        """
        self.known_type = self.type
        if settling is not None:
            self.settling = settling
            self.invalid = INVALID
        self.supply = self.supply if pins is None else SUPPLY.get(pins, 0)
        if self.type == SensorType.CUSTOM:
            self._set_pins()
        elif pins is not None:
            for pin, level in enumerate(LEVELS[pins]):
                self.pins.set_pin(pin, level)
        self._disc = RotationDisc()
        self._debounce = self._edges = 0

    def _set_pins(self) -> None:
        """Set supply and pins as the map says; the first pin keeps its level as an output in most versions."""
        self.supply = CUSTOM_SUPPLY.get(self.custom_active, 0)
        for pin in range(2):
            if self.pin_directions >> pin & 1:
                self.pins.set_pin(pin, bool(self.pins_out >> pin & 1))
            elif pin in self._inputs:
                self.pins.set_pin(pin, None)

    def settle(self, passes: int) -> None:
        """Advance by `passes` without a change of type."""
        self.settling = max(self.settling - passes, 0)
        if not self.settling:
            self.invalid &= ~INVALID

    def reset(self) -> None:
        """Reset type, mode and values, but for the boolean; the type counts as changed only if it was different."""
        self.type, self.mode, self.invalid = int(SensorType.NONE), int(SensorMode.RAW), INVALID
        self.raw = self.normalized = self.scaled = 0

    def read(self) -> None:
        """Read and scale the sensor's value."""
        self._convert(self.voltage)

    def read_again(self) -> None:
        """Read the value in a pass that did not wake up the module: only another voltage changes anything."""
        raw = self.voltage
        if raw != self.raw or self.type in _DRIVEN:
            self._convert(raw)

    def _convert(self, raw: int) -> None:
        self.raw = raw
        if self.type == SensorType.CUSTOM:
            self._set_pins()
            levels = self.pins.level(0) | self.pins.level(1) << 1
            self.pins_in = self.pins_in & ~_PINS | levels
            self.zero_divisions += not self.custom_full_scale
            self._scale(full_scale(raw, self.custom_zero_offset, self.custom_full_scale))
        else:
            normalize = NORMALIZE.get(self.type)
            self._scale(normalize(raw) if normalize else raw)

    @property
    def reads_calibration(self) -> bool:
        """Whether a pass can change something in the reading of a calibration."""
        reads = self.settling or self.color.state == CALIBRATING
        return self.awaits_calibration or bool(reads and self.type in COLOR_TYPES and self.color.device is None)

    @property
    def awaits_calibration(self) -> bool:
        """Whether the first pin is about to change while the calibration of a colour sensor is awaited."""
        color = self.color
        awaits = self.type == COLOR_EXIT or (self.type in COLOR_TYPES and color.state == CALIBRATING)
        return awaits and color.waited < len(_CALIBRATION_CLOCK)

    def ask_for_calibration(self) -> None:
        """Output the next level of the clock with which a colour sensor, or the end of its use, begins."""
        if self.awaits_calibration:
            self.pins.set_pin(0, _CALIBRATION_CLOCK[self.color.waited])
            if self.type == COLOR_EXIT:
                self.pins.set_pin(1, None)
            self.color.waited += 1

    def await_calibration(self) -> None:
        """Wait for the calibration of a missing colour sensor; a low converter value looks like one."""
        self.settling = NEVER
        self.invalid = INVALID
        self.read_calibration()

    def read_calibration(self) -> bool:
        """Continue the calibration of a missing colour sensor; return whether it fails and begins again."""
        color = self.color
        self.ask_for_calibration()
        failed = color.state == CALIBRATING and color.fails()
        if self.voltage > _EXIT_RAW:
            color.state = OFF
            return False
        if color.state == OFF:
            color.begin_calibration()
        return failed

    def read_color(self, device: ColorDevice) -> None:
        """Read the colour sensor: the colour, or the brightness with one lamp on."""
        self.color.state = 0
        if self.type == SensorType.COLOR_FULL:
            self.scaled = self.color.look(device, self.mode)
            return
        self.raw = device.lit(self.type - SensorType.COLOR_RED)
        self._scale(background(self.raw))

    def _scale(self, normalized: int) -> None:
        before, pressed = self.normalized, self.boolean
        self.normalized = normalized
        self.boolean = boolean(normalized, self.mode & SLOPE_BITS, before)
        mode = self.mode & MODE_BITS
        if level := LEVEL.get(mode):
            self.scaled = level(normalized)
        elif mode == SensorMode.BOOLEAN:
            self.scaled = self.boolean
        elif mode == SensorMode.ANGLE_STEPS:
            self.scaled = s16(self.scaled + self._disc.turn(normalized))
        elif self._debounce:
            self._debounce -= 1
        elif self.boolean != pressed:
            self._debounce = DEBOUNCE
            self.scaled = s16(self.scaled + self._counted(mode))

    def _counted(self, mode: int) -> bool:
        """Return whether the edge counts: as a transition every edge, as a period the second or a later falling one."""
        if mode == SensorMode.TRANSITION_COUNT:
            return True
        self._edges += 1
        if self._edges < 2 or self.boolean:
            return False
        self._edges = 0
        return True


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
                port.color.begin_exit()
                port.configure(NEVER, self._pins(COLOR_EXIT))
                return
            if port.type == COLOR_EXIT:
                port.color.begin_exit()
            if self._version.color_sensor and port.type in COLOR_TYPES:
                port.color.begin_calibration()
                if self._version.absent_color is not None:
                    port.scaled = self._version.absent_color
            port.configure(self._settling(port), self._pins(port.type))
        elif lacks_color_sensor and port.type == COLOR_EXIT:
            port.ask_for_calibration()
            reads = port.color.go_on_with_exit()
            if port.voltage > _EXIT_RAW:
                port.type = SensorType.NONE  # which starts the exit again: without a sensor it never ends
            elif reads:
                port.settle(passes)
        elif lacks_color_sensor and port.type in COLOR_TYPES:
            self._miss_color_sensor(port, passes)
        else:
            port.settle(passes)

    def _miss_color_sensor(self, port: InputPort, passes: int) -> None:
        """Handle a type of the colour sensor on a port without one."""
        if self._version.absent_color is None:
            port.await_calibration()
            return
        port.settle(passes)
        if port.read_calibration():
            port.settling = _SETTLING_COLOR

    def _settling(self, port: InputPort) -> int | None:
        """Return the number of passes with invalid values after a change of type, or None if nothing must settle."""
        new, old = port.type, port.known_type
        if self._version.color_sensor and new in COLOR_TYPES:
            absent = port.color.device is None and self._version.absent_color is None
            return 1 if absent else _SETTLING_COLOR
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
