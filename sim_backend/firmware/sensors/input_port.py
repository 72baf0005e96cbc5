"""One input port: its configuration and its readings. Source: docs/firmware.md section 6; the map is in section 5.2."""

from __future__ import annotations

from typing import Protocol

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.cint import s16
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
from sim_backend.firmware.sensors.input_pins import CUSTOM_SUPPLY, LEVELS, SUPPLY

DEBOUNCE = 100
"""Passes without counting after each counted edge."""

INVALID = 0x01
"""Bit of the validity byte that the firmware sets and clears; the byte's other bits stay as written."""

COLOR_EXIT = 18
"""Type of a port whose colour sensor is being switched off: until the converter reads more than `EXIT_RAW`."""

_PINS = 0x03
_COUNTING = (SensorMode.TRANSITION_COUNT, SensorMode.PERIOD_COUNT, SensorMode.ANGLE_STEPS)
COLOR_TYPES = range(SensorType.COLOR_FULL, SensorType.COLOR_NONE + 1)
SETTLING_COLOR = 400
"""Passes with invalid values after a change to a type of the colour sensor, or after its calibration was not read."""

EXIT_RAW = 50

_AGAIN = 2
"""Pass in which the reading of a calibration begins that the map said was over."""


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
            self.zero_divisions += not self.custom_full_scale and raw >= self.custom_zero_offset
            self._scale(full_scale(raw, self.custom_zero_offset, self.custom_full_scale))
        else:
            normalize = NORMALIZE.get(self.type)
            self._scale(normalize(raw) if normalize else raw)

    @property
    def reads_calibration(self) -> bool:
        """Whether a pass can change something in the reading of a calibration."""
        reads = self.settling or self.color.state == CALIBRATING
        return bool(reads and self.type in COLOR_TYPES and self.color.device is None)

    def await_color_sensor(self, passes: int, *, invalidates: bool) -> None:
        """Advance by `passes` without a colour sensor, while the port's type still waits for the sensor's calibration.

        A pass checks for the sensor while the values settle, and if they are valid, which a write to the map can cause.

        Args:
            passes: Since the last time.
            invalidates: Whether the values are invalid as long as nothing looks like a sensor.
        """
        settles = self.settling > 0
        self.settle(passes)
        self.color.begin_pass()
        if settles:
            self._look_for_color_sensor(invalidates=invalidates)
        if self.type == self.known_type and not self.invalid & INVALID:
            self._look_for_color_sensor(invalidates=invalidates)

    def _look_for_color_sensor(self, *, invalidates: bool) -> None:
        """Look for a missing colour sensor; a low converter value looks like one, whose calibration is read."""
        color, absent = self.color, self.voltage > EXIT_RAW
        if color.state == OFF and invalidates and self.type != COLOR_EXIT:
            self.invalid, self.settling = INVALID, SETTLING_COLOR
        if self.type == COLOR_EXIT or color.state == CALIBRATING:
            fails = self._step()
            if fails and not absent:
                self.settling = SETTLING_COLOR
        elif color.state != OFF:
            self._read_absent_color(absent=absent)
        if self.type == COLOR_EXIT:
            self.type = SensorType.NONE if absent else COLOR_EXIT  # the exit starts again: it never ends
        elif absent:
            color.state = OFF
        elif color.state == OFF:
            color.begin_calibration()

    def _read_absent_color(self, *, absent: bool) -> None:
        """Read a missing sensor whose calibration the map says was read; a low converter value looks like a sensor."""
        if self.type != SensorType.COLOR_FULL:
            self.raw = 0
            if not absent and self.pins.level(0):
                self.color.begin_calibration(_AGAIN)
            elif not absent:
                self._scale(background(self.raw))
        elif not absent:
            self.scaled = self.color.read_nothing(self.mode)

    def _step(self) -> bool:
        """Do a step of reading a calibration, which begins with a clock; return whether the reading fails."""
        level, failed = self.color.step()
        if level is not None:
            self.pins.set_pin(0, level)
            if self.type == COLOR_EXIT:
                self.pins.set_pin(1, None)
        return failed

    def read_color(self, device: ColorDevice) -> None:
        """Read the colour sensor: the colour, or the brightness with one lamp on."""
        self.color.state = 0
        if self.type == SensorType.COLOR_FULL:
            self.scaled = self.color.measure(device, self.mode)
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
