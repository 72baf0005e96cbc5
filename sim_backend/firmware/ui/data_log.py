"""The data log that the menus start, which samples into a file. Source: docs/firmware.md section 8.5."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from firmware_protocol.enums import SensorMode, SensorType
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.module import Clock
from sim_backend.firmware.motors.output import OutputModule
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.ui import screen_marks as marks
from sim_backend.firmware.ui.i2c_reader import DISTANCE, TEMPERATURE, I2CReader, I2CSensor
from sim_backend.firmware.ui.states import Programs

FILE = "Tmp.log"
"""The log until it is stored under another name."""

_PERIOD_MS = 100
_SAMPLED_MS, _WRITTEN_MS = 80, 99
"""In each period, when a sample is taken, and when it is written."""

_TURN = 360
"""Degrees of a rotation."""

_NO_VALUE = "-"


class Value(NamedTuple):
    """A value that can be logged.

    Attributes:
        sensor: Name of the sensor in the file.
        unit: What follows that name: `_` and the unit, if it has one.
        type: Type of the input; none for a motor.
        mode: Mode of the input.
        i2c: The I2C sensor, if it is one.
        text: What the file shows for the bytes of that sensor.
    """

    sensor: str
    unit: str = ""
    type: SensorType = SensorType.NONE
    mode: SensorMode = SensorMode.RAW
    i2c: I2CSensor | None = None
    text: Callable[[bytes], str] = str

    @property
    def is_motor(self) -> bool:
        """Whether it is one of motors."""
        return self.type is SensorType.NONE


_NO_ECHO = 255
_CM_PER_INCH = 2.54


def _cm(data: bytes) -> str:
    return _NO_VALUE if data[0] == _NO_ECHO else str(data[0])


def _inches(data: bytes) -> str:
    return _NO_VALUE if data[0] == _NO_ECHO else f"{data[0] / _CM_PER_INCH:.0f}"


def _celsius(data: bytes) -> str:
    """256 is one degree."""
    return _tenths(int.from_bytes(data, signed=True) * 10 / 256)


def _fahrenheit(data: bytes) -> str:
    """142 is one degree, rather than 256 / 1.8."""
    return _tenths((int.from_bytes(data, signed=True) * 10 + 320 * 142) / 142)


def _tenths(number: float) -> str:
    """Cut off a number of tenths."""
    return f"{int(number) / 10:.1f}"


_TEMPERATURE, _SOUND, _LIGHT, _ROTATION, _DISTANCE = (
    "NXT Temp Sensor",
    "Sound Sensor",
    "Light Sensor",
    "FP Rotation Sensor",
    "Distance Sensor",
)
_ROTATIONS = Value(_ROTATION, "_rot")

VALUES = (
    Value(_TEMPERATURE, "_C", SensorType.LOW_SPEED_9V, i2c=TEMPERATURE, text=_celsius),
    Value(_TEMPERATURE, "_F", SensorType.LOW_SPEED_9V, i2c=TEMPERATURE, text=_fahrenheit),
    Value(_SOUND, "_dB", SensorType.SOUND_DB, SensorMode.PERCENT),
    Value(_SOUND, "_dBa", SensorType.SOUND_DBA, SensorMode.PERCENT),
    Value(_LIGHT, "_on", SensorType.LIGHT_ACTIVE, SensorMode.PERCENT),
    Value(_LIGHT, "_off", SensorType.LIGHT_INACTIVE, SensorMode.PERCENT),
    _ROTATIONS,
    Value(_ROTATION, "_deg"),
    Value("Bumper", type=SensorType.SWITCH, mode=SensorMode.BOOLEAN),
    Value(_DISTANCE, "_in", SensorType.LOW_SPEED_9V, i2c=DISTANCE, text=_inches),
    Value(_DISTANCE, "_cm", SensorType.LOW_SPEED_9V, i2c=DISTANCE, text=_cm),
    Value("Color Detector", "_0", SensorType.COLOR_FULL),
)
"""The values, in the order of the menu."""

SENSOR_PORTS, MOTOR_PORTS = 4, 3
"""How many ports there are; the motors are numbered after the sensors."""


class DataLog:
    """A log of the menus: a file with the values of some ports, written from `begin` to `end`.

    Args:
        clock: The brick's time.
        loader: Stores the file.
        inputs: The sensors.
        outputs: The motors.
        i2c: Reads the I2C sensors.
        programs: Gives the brick's time, and the time that a telegram has set.
        screen: Shows the values.

    Attributes:
        fails: Whether it cannot go on: a sample could not be written.
        draws: Whether the next pass draws the chosen value and its neighbours.
    """

    def __init__(
        self,
        clock: Clock,
        loader: Loader,
        inputs: InputModule,
        outputs: OutputModule,
        i2c: I2CReader,
        programs: Programs,
        screen: ScreenRefresh,
    ) -> None:
        self._clock, self._loader, self._screen = clock, loader, screen
        self._inputs, self._outputs, self._i2c, self._programs = inputs, outputs, i2c, programs
        self.fails = self.draws = False
        self._values: list[tuple[int, Value]] = []
        self._sample: list[str] = []
        self._chosen = 0
        self._handle = self._started_ms = self._drawn_ms = 0

    def begin(self, items: dict[int, int]) -> tuple[bool, bool]:
        """Begin a file in all free flash, with ports and sensors; return whether it was opened, and begun.

        Args:
            items: For each port, 0 to 3 of sensors and 4 to 6 of motors, the index of its value in `VALUES`.
        """
        self._values = [(port, VALUES[item]) for port, item in sorted(items.items())]
        self._started_ms, self._chosen, self.fails = self._clock.now_ms, 0, False
        self._loader.delete(FILE)
        status, self._handle, _ = self._loader.create(FILE, self._loader.flash.free, appendable=True)
        programs = self._programs
        begun = not status and all(
            (
                self._write("Sync data", programs.sync_time, programs.sync_tick, programs.tick, _PERIOD_MS, -1),
                self._write("Sdata", *(f"{port + 1}_{each.sensor}{each.unit}" for port, each in self._values)),
                self._write("Time", *(each.sensor for _, each in self._values)),
            )
        )
        return not status, begun

    def go_on(self, *, writes: bool = True) -> int:
        """Set up the ports, take a sample, write it, or draw; return the time of the next call in ms.

        Args:
            writes: Whether a sample that is due is written; in the pass of exit it is not.
        """
        now_ms = self._clock.now_ms
        passed_ms = now_ms - self._started_ms
        if passed_ms == 1:
            self._set_up()
        elif passed_ms % self._i2c.step_ms == 0:
            self._keep_types()
            self._i2c.go_on(passed_ms)
        if passed_ms % _PERIOD_MS == _SAMPLED_MS:
            self._sample = [self._reading(port, value) for port, value in self._values]
        elif writes and passed_ms % _PERIOD_MS == _WRITTEN_MS:
            self.fails = not self._write(passed_ms - _WRITTEN_MS, *self._sample)
        if self.draws:
            self._screen.mark(marks.logged(len(self._values), self._chosen))
            self.draws, self._drawn_ms = False, now_ms
        elif (now_ms - self._drawn_ms) % _PERIOD_MS == 0:
            self._screen.mark(marks.LOG_TIME)
        events_ms = self._started_ms + _SAMPLED_MS, self._started_ms + _WRITTEN_MS, self._drawn_ms
        waits_ms = min((event_ms - now_ms) % _PERIOD_MS or _PERIOD_MS for event_ms in events_ms)
        return now_ms + min(waits_ms, self._i2c.step_ms - passed_ms % self._i2c.step_ms)

    def _set_up(self) -> None:
        """Set types and modes, and count motors from here on."""
        for port, value in self._values:
            if port >= SENSOR_PORTS:
                self._outputs.restart_count(port - SENSOR_PORTS)
            else:
                self._inputs.store(port, type=value.type, mode=value.mode)
        self._i2c.begin({port: value.i2c for port, value in self._values if value.i2c})
        self.draws = True

    def _keep_types(self) -> None:
        """Give the inputs their types and modes again, if they have got others."""
        for port, value in self._values:
            if port < SENSOR_PORTS:
                self._inputs.keep_type(port, value.type, value.mode)

    def choose(self, step: int) -> None:
        """Show the value to the left (-1) or right (1) from the next pass on.

        Two values stop at their ends. More are a ring, and look the same whichever is shown.
        """
        last = len(self._values) - 1
        self._chosen, self.draws = min(max(self._chosen + step, 0), last), True

    def _reading(self, port: int, value: Value) -> str:
        if port >= SENSOR_PORTS:
            count = self._outputs.controls[port - SENSOR_PORTS].count
            return f"{count / _TURN:.0f}" if value is _ROTATIONS else str(count)
        if value.i2c:
            data = self._i2c.data(port)
            return _NO_VALUE if data is None else value.text(data)
        sensor = self._inputs.ports[port]
        return _NO_VALUE if sensor.invalid else str(sensor.scaled)

    def _write(self, *columns: object) -> bool:
        """Write a line, and return whether it fits."""
        line = "\t".join(str(each) for each in columns) + "\r\n"
        return self._loader.write(self._handle, line.encode("ascii"))[1] == len(line)

    def end(self) -> None:
        """Close the file, and leave the inputs without types."""
        self._loader.crop(self._handle)
        self._inputs.drop_types()
