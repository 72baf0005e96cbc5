"""The page of the menus that shows the value of a sensor or motor. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from typing import NamedTuple

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.ui.data_log import SENSOR_PORTS
from sim_backend.firmware.ui.i2c_reader import DISTANCE, TEMPERATURE, I2CReader, I2CSensor


class _Sensor(NamedTuple):
    """A sensor whose value can be shown. Mode None leaves that of the input."""

    type: SensorType
    mode: SensorMode | None
    i2c: I2CSensor | None = None


_SOUND_AND_LIGHT = (
    _Sensor(SensorType.SOUND_DB, SensorMode.PERCENT),
    _Sensor(SensorType.SOUND_DBA, SensorMode.PERCENT),
    _Sensor(SensorType.LIGHT_ACTIVE, SensorMode.PERCENT),
    _Sensor(SensorType.LIGHT_INACTIVE, SensorMode.PERCENT),
)
_TEMPERATURE = _Sensor(SensorType.LOW_SPEED_9V, SensorMode.RAW, TEMPERATURE)
_DISTANCE = _Sensor(SensorType.LOW_SPEED_9V, SensorMode.RAW, DISTANCE)
_TOUCH = _Sensor(SensorType.SWITCH, SensorMode.BOOLEAN)
_OLD_DISTANCE = _Sensor(SensorType.LOW_SPEED_9V, None, DISTANCE)
_MOTOR = None

_Value = _Sensor | None
_Values = tuple[_Value, ...]

_VALUES: _Values = (
    *_SOUND_AND_LIGHT,
    *(_TEMPERATURE, _TEMPERATURE),
    *(_MOTOR, _MOTOR),
    _TOUCH,
    *(_DISTANCE, _DISTANCE),
    _Sensor(SensorType.COLOR_FULL, SensorMode.RAW),
)
_OLD_VALUES: _Values = (
    *_SOUND_AND_LIGHT,
    _Sensor(SensorType.REFLECTION, SensorMode.PERCENT),
    _Sensor(SensorType.TEMPERATURE, SensorMode.CELSIUS),
    _Sensor(SensorType.TEMPERATURE, SensorMode.FAHRENHEIT),
    _Sensor(SensorType.ANGLE, SensorMode.ANGLE_STEPS),
    *(_MOTOR, _MOTOR),
    _TOUCH,
    *(_OLD_DISTANCE, _OLD_DISTANCE),
)
"""The values that can be shown; those of firmware without a data log."""

_PERIOD_MS, _OLD_PERIOD_MS = 200, 250


def shown_values(*, modern: bool) -> _Values:
    """Return the values that can be shown; None is one of motors."""
    return _VALUES if modern else _OLD_VALUES


class SensorView:
    """The value that is shown.

    Args:
        inputs: The inputs.
        outputs: The motors.
        i2c: Reads the I2C sensors.
        modern: Whether the firmware has a data log and the newer sensors.

    Attributes:
        item: The item of the value to show.
        sets_up: Whether the port is set up in the next pass.
        modern: Whether ports are set up one pass after the beginning of the page, and keep their types.
        period_ms: Time from one drawing of the value to the next.
        step_ms: Period in which the page checks its ports.
    """

    def __init__(self, inputs: InputModule, outputs: OutputModule, i2c: I2CReader, *, modern: bool) -> None:
        self._inputs, self._outputs, self._i2c, self.step_ms = inputs, outputs, i2c, i2c.step_ms
        self.sets_up = False
        self.modern, self.period_ms = modern, _PERIOD_MS if modern else _OLD_PERIOD_MS
        self._values, self.item = shown_values(modern=modern), 0
        self._ports: dict[int, _Value] = {}
        self._only_counts = False

    def choose(self, port: int) -> None:
        """Show the value of a port, if it is one of that value; old firmware shows no other one."""
        value = self._values[self.item]
        if not self.modern:
            self.clear()
        if (value is _MOTOR) == (port >= SENSOR_PORTS):
            self._ports[port] = value

    def clear(self) -> None:
        """Forget the ports that were shown."""
        self._ports.clear()

    def set_up_again(self) -> None:
        """Set up the ports again in the next pass; old firmware only counts motors again."""
        self.sets_up, self._only_counts = True, not self.modern

    def set_up(self) -> None:
        """Set types and modes of the inputs that were shown, and count such motors from here on."""
        self.sets_up, only_counts, self._only_counts = False, self._only_counts, False
        for port, value in self._ports.items():
            if value is _MOTOR:
                self._outputs.restart_count(port - SENSOR_PORTS)
            elif only_counts:
                return
            elif value.mode is None:
                self._inputs.store(port, type=value.type)
            else:
                self._inputs.store(port, type=value.type, mode=value.mode)
        self._i2c.begin({port: value.i2c for port, value in self._ports.items() if value and value.i2c})

    def check_ports(self, passed_ms: int) -> None:
        """Give the inputs that were shown their types and modes again, if they have got others, and read I2C sensors.

        Args:
            passed_ms: Time since the page began, a multiple of `step_ms`.
        """
        for port, value in self._ports.items() if self.modern else ():
            if value and value.mode is not None:
                self._inputs.keep_type(port, value.type, value.mode)
        self._i2c.go_on(passed_ms)

    def end(self) -> None:
        """Leave the page: the inputs have no types then, whatever was shown."""
        self._inputs.drop_types()
