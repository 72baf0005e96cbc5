"""The page of the menus that shows the value of a sensor or motor. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.sensors.input import InputModule

VIEW = 3
"""Item of the main menu."""

_PAGE_LEVEL = 3
"""Items that lead to the page: view, kind of value, and the port."""

_SOUND_AND_LIGHT = (
    (SensorType.SOUND_DB, SensorMode.PERCENT),
    (SensorType.SOUND_DBA, SensorMode.PERCENT),
    (SensorType.LIGHT_ACTIVE, SensorMode.PERCENT),
    (SensorType.LIGHT_INACTIVE, SensorMode.PERCENT),
)
_I2C = (SensorType.LOW_SPEED_9V, SensorMode.RAW)
_TOUCH = (SensorType.SWITCH, SensorMode.BOOLEAN)
_OLD_I2C = (SensorType.LOW_SPEED_9V, None)
_MOTOR = None

_Value = tuple[SensorType, SensorMode | None] | None
_Values = tuple[_Value, ...]

_VALUES: _Values = (
    *_SOUND_AND_LIGHT,
    _I2C,
    _I2C,
    _MOTOR,
    _MOTOR,
    _TOUCH,
    _I2C,
    _I2C,
    (SensorType.COLOR_FULL, SensorMode.RAW),
)
_OLD_VALUES: _Values = (
    *_SOUND_AND_LIGHT,
    (SensorType.REFLECTION, SensorMode.PERCENT),
    (SensorType.TEMPERATURE, SensorMode.CELSIUS),
    (SensorType.TEMPERATURE, SensorMode.FAHRENHEIT),
    (SensorType.ANGLE, SensorMode.ANGLE_STEPS),
    *(_MOTOR, _MOTOR, _TOUCH, _OLD_I2C, _OLD_I2C),
)
"""Type and mode of the values that can be shown; None leaves the mode. The second table has neither colour nor log."""

_INCHES = 4
"""Item that is drawn in three passes; in old firmware the first one is."""

_SENSOR_PORTS, _MOTOR_PORTS = 4, 3
_PERIOD_MS, _OLD_PERIOD_MS = 200, 250


class SensorView:
    """The value that is shown.

    Args:
        inputs: The inputs.
        outputs: The motors.
        modern: Whether the firmware has a data log and the newer sensors.

    Attributes:
        chosen: Whether the page is about to be shown, or its port to be set up.
        shown: Whether the page is shown.
        modern: Whether ports are set up one pass after the beginning of the page, and keep their types.
        period_ms: Time from one drawing of the value to the next.
    """

    def __init__(self, inputs: InputModule, outputs: OutputModule, *, modern: bool) -> None:
        self._inputs, self._outputs = inputs, outputs
        self.chosen = self.shown = False
        self.modern, self.period_ms = modern, _PERIOD_MS if modern else _OLD_PERIOD_MS
        self._values, self._slow = (_VALUES, _INCHES) if modern else (_OLD_VALUES, 0)
        self._ports: dict[int, _Value] = {}

    def items(self, menu: tuple[int, ...]) -> int:
        """Return the number of items of a menu below View, 0 of another one."""
        if menu[:1] != (VIEW,) or len(menu) >= _PAGE_LEVEL:
            return 0
        if len(menu) == 1:
            return len(self._values)
        return _SENSOR_PORTS if self._values[menu[1] % len(self._values)] else _MOTOR_PORTS

    def is_slow(self, place: tuple[int, ...]) -> bool:
        """Return whether a place in the menus is an item of View that is drawn in three passes."""
        return place == (VIEW, self._slow)

    def opens(self, place: tuple[int, ...]) -> bool:
        """Return whether a place in the menus leads to the page, and choose it then."""
        if place[:1] != (VIEW,) or len(place) != _PAGE_LEVEL:
            return False
        self.chosen, (_, item, port) = True, place
        value = self._values[item]
        if not self.modern or any((value is _MOTOR) != (other is _MOTOR) for other in self._ports.values()):
            self.clear()
        self._ports[port] = value
        return True

    def clear(self) -> None:
        """Forget the ports that were shown."""
        self._ports.clear()

    def set_up(self) -> None:
        """Set types and modes of the inputs that were shown, or count their motors from here on."""
        self.chosen = False
        for port, value in self._ports.items():
            if value is _MOTOR:
                self._outputs.restart_count(port)
            elif value[1] is None:
                self._inputs.store(port, type=value[0])
            else:
                self._inputs.store(port, type=value[0], mode=value[1])

    def keep_types(self) -> None:
        """Give the inputs that were shown their types and modes again, if they have got others."""
        for port, value in self._ports.items() if self.modern else ():
            if value and value[1] is not None:
                self._inputs.keep_type(port, value[0], value[1])

    def end(self) -> None:
        """Leave the page: the inputs have no types then, whatever was shown."""
        self.shown = False
        self._inputs.drop_types()
