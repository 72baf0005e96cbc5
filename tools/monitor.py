"""Snapshots of a whole brick: motors, input ports, battery, link. Shown by ``nxtdrive monitor``."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from firmware_protocol.direct import GetInputValues, GetOutputState, InputValues, SetInputMode
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, SensorMode, SensorType
from firmware_protocol.errors import BrickError, LinkError, RemoteProtocolError, SensorTimeout
from nxtdrive.brick import Brick
from nxtdrive.ports import MOTOR_PORTS, SENSOR_PORTS, SensorPort, output_port
from nxtdrive.sensors import QuantitySensor, identify
from nxtdrive.sensors.kinds import KINDS, in_words, kind_of, make_sensor, plain

DIGITAL = "I2C sensor (digital)"
TYPES = {
    SensorType.NONE: "not set up",
    SensorType.SWITCH: "touch sensor",
    SensorType.TEMPERATURE: "temperature sensor (RCX)",
    SensorType.REFLECTION: "light sensor (RCX)",
    SensorType.ANGLE: "rotation sensor (RCX)",
    SensorType.LIGHT_ACTIVE: "light sensor, lamp on",
    SensorType.LIGHT_INACTIVE: "light sensor, lamp off",
    SensorType.SOUND_DB: "sound sensor (dB)",
    SensorType.SOUND_DBA: "sound sensor (dBA)",
    SensorType.CUSTOM: "sensor of another maker",
    SensorType.LOW_SPEED: DIGITAL,
    SensorType.LOW_SPEED_9V: DIGITAL,
    SensorType.HIGH_SPEED: "RS-485 device",
    SensorType.COLOR_FULL: "color sensor",
    SensorType.COLOR_RED: "color sensor, red lamp",
    SensorType.COLOR_GREEN: "color sensor, green lamp",
    SensorType.COLOR_BLUE: "color sensor, blue lamp",
    SensorType.COLOR_NONE: "color sensor, lamp off",
}
"""What an input port is set up for, in plain words."""
_WITHOUT_CONVERTER = frozenset(
    kind.label for kind, name in TYPES.items() if name in (DIGITAL, TYPES[SensorType.NONE], "RS-485 device")
)
MODE_BITS = 0xE0
"""The other bits of a sensor mode are a slope. Source: docs/firmware.md section 6."""
UNITS: dict[int, str] = {SensorMode.PERCENT: " %", SensorMode.CELSIUS: " °C", SensorMode.FAHRENHEIT: " °F"}


@dataclass(frozen=True, slots=True)
class Digital:
    """A digital sensor that has identified itself.

    Attributes:
        name: Its name, for people.
        sensor: The driver's object for it; None if the driver has no class for it.
    """

    name: str
    sensor: QuantitySensor[Any] | None


@dataclass(frozen=True, slots=True)
class MotorState:
    """State of a motor.

    Attributes:
        port: A, B or C.
        power: Percent, as last commanded.
        state: Off, braking, running, ramping up or down.
        angle_deg: Angle since the last reset.
    """

    port: str
    power: int
    state: str
    angle_deg: int


@dataclass(frozen=True, slots=True)
class SensorState:
    """State of an input port.

    Attributes:
        port: 1 to 4.
        type: Sensor type that the firmware is configured for.
        name: What is plugged in, as far as it is known, in plain words.
        raw: Converter value, 0..1023; meaningless for digital sensors.
        value: Measurement of the named sensor, in its unit; None for other ports, and without an echo.
        text: The value with its quantity and unit, or why there is none.
    """

    port: int
    type: str
    name: str
    raw: int
    value: object
    text: str

    @property
    def analog(self) -> bool:
        """Whether the port is set up for an analog sensor, whose converter value has a meaning."""
        return self.type not in _WITHOUT_CONVERTER


@dataclass(frozen=True, slots=True)
class Snapshot:
    """State of a brick at one time.

    Attributes:
        time_s: Time on the link's clock.
        battery_mv: Battery voltage.
        latency_ms: Round trip of the link, median of the latest requests.
        motors: A, B, C.
        sensors: 1 to 4.
    """

    time_s: float
    battery_mv: int
    latency_ms: float
    motors: tuple[MotorState, ...]
    sensors: tuple[SensorState, ...]


HISTORY_S = 60.0
"""Time that a plot of the latest readings spans."""


@dataclass(frozen=True, slots=True)
class Plot:
    """The latest readings of one motor or sensor.

    Attributes:
        heights: Mean reading of each of the equal parts of the last `HISTORY_S`, the latest last; 0..1, or None.
        lowest: Reading at height 0.
        highest: Reading at height 1.
    """

    heights: list[float | None]
    lowest: float
    highest: float


class History:
    """The readings of the last minute by port: a motor's angle, a sensor's value, else its converter value."""

    def __init__(self) -> None:
        self._readings: dict[str, deque[tuple[float, float]]] = {}
        self._now_s = 0.0

    def add(self, snapshot: Snapshot) -> None:
        """Note the readings of a snapshot and forget the oldest."""
        self._now_s = snapshot.time_s
        numbers: dict[str, float | None] = {motor.port: motor.angle_deg for motor in snapshot.motors}
        numbers |= {str(sensor.port): _number(sensor) for sensor in snapshot.sensors}
        for port, number in numbers.items():
            readings = self._readings.setdefault(port, deque())
            if number is not None:
                readings.append((snapshot.time_s, number))
            while readings and readings[0][0] <= snapshot.time_s - HISTORY_S:
                readings.popleft()

    def plot(self, port: str, width: int) -> Plot | None:
        """Return a plot of `width` parts, or None without a reading in the last minute."""
        readings = self._readings.get(port)
        if not readings:
            return None
        parts: list[list[float]] = [[] for _ in range(width)]
        for time_s, number in readings:
            age = min(width - 1, int((self._now_s - time_s) / HISTORY_S * width))
            parts[width - 1 - age].append(number)
        means = [sum(part) / len(part) if part else None for part in parts]
        lowest, highest = (limit(number for _, number in readings) for limit in (min, max))
        span = highest - lowest or 1.0
        return Plot([None if mean is None else (mean - lowest) / span for mean in means], lowest, highest)


def _number(sensor: SensorState) -> float | None:
    """Return the number to plot: the measurement, or the converter value of a sensor without one."""
    if isinstance(sensor.value, int | float):
        return float(sensor.value)
    return float(sensor.raw) if sensor.analog and sensor.value is None else None


def identify_sensors(brick: Brick, ports: Collection[int]) -> dict[int, Digital]:
    """Find out which digital sensors are plugged in; other ports are left as they are configured.

    While a program runs on the brick, its sensors are left alone and nothing is found.

    Args:
        brick: An open brick.
        ports: The ports to look at.

    Raises:
        LinkError: The link is lost.
    """
    found: dict[int, Digital] = {}
    if brick.programs.running is not None:
        return found
    for port in (port for port in SENSOR_PORTS if port in ports):
        before = brick.request(GetInputValues(InputPort(port - 1)))
        if TYPES.get(before.type) not in (DIGITAL, TYPES[SensorType.NONE]):
            continue
        try:
            identity = identify(brick.link, port)
        except BrickError:
            identity = None
        if identity is None:
            brick.request(SetInputMode(InputPort(port - 1), before.type, before.mode))
        elif identity.kind in KINDS:
            found[port] = Digital(f"{identity.kind} sensor", make_sensor(identity.kind, brick.link, port))
        else:
            found[port] = Digital(f"{identity.vendor} {identity.product} (digital)".strip(), None)
    return found


def look(
    brick: Brick, sensors: Mapping[int, QuantitySensor[Any]], identified: Mapping[int, Digital] | None = None
) -> Snapshot:
    """Read everything once.

    Args:
        brick: An open brick.
        sensors: Sensor by port. Other ports are read as they are configured, without disturbing a program's sensors.
        identified: As from `identify_sensors`; not used while a program runs on the brick.

    Raises:
        LinkError: The link is lost; also when a named sensor gives no valid values.
    """
    digital = identified if identified and brick.programs.running is None else {}
    return Snapshot(
        time_s=round(brick.now(), 3),
        battery_mv=round(brick.battery_v * 1000),
        latency_ms=round(brick.link.latency_s * 1000, 1),
        motors=tuple(_motor(brick, output_port(port)) for port in MOTOR_PORTS),
        sensors=tuple(_sensor(brick, port, sensors.get(port), digital.get(port)) for port in SENSOR_PORTS),
    )


def watch(
    brick: Brick,
    sensors: Mapping[int, QuantitySensor[Any]],
    every_s: float,
    *,
    identified: Mapping[int, Digital] | None = None,
    on_loss: Callable[[str], object] | None = None,
) -> Iterator[Snapshot]:
    """Yield snapshots forever; errors as for `look`, unless there is `on_loss`.

    Args:
        brick: An open brick; one that reconnects comes back after a lost link.
        sensors: As for `look`.
        every_s: Time between snapshots; one takes about ten requests, which may last longer over a slow link.
        identified: As for `look`.
        on_loss: Called once with the error, in words, when the brick no longer answers. There are no snapshots
            then until it answers again.
    """
    due, lost = brick.now(), False
    while True:
        try:
            snapshot = look(brick, sensors, identified)
        except (LinkError, RemoteProtocolError) as error:
            if on_loss is None:
                raise
            if not lost:
                on_loss(str(error))
            lost = True
        else:
            lost = False
            yield snapshot
        due = max(due + every_s, brick.now())
        brick.sleep(due - brick.now())


def _motor(brick: Brick, port: OutputPort) -> MotorState:
    state = brick.request(GetOutputState(port))
    if not state.mode & OutputMode.MOTOR_ON:
        doing = "off"
    elif not state.power and state.mode & OutputMode.BRAKE:
        doing = "braking"
    else:
        doing = state.run_state.label
    return MotorState(port.name, state.power, doing, state.rotation_count)


def _sensor(brick: Brick, port: SensorPort, named: QuantitySensor[Any] | None, digital: Digital | None) -> SensorState:
    sensor = named or (digital.sensor if digital else None)
    value, text = None, ""
    if sensor is not None:
        try:
            value = sensor.value
            text = f"{sensor.quantity}: {in_words(value, sensor.unit)}"
        except (BrickError, SensorTimeout):
            text = "does not answer: is it plugged in?"
    values = brick.request(GetInputValues(InputPort(port - 1)))
    if sensor is None and digital is None and values.valid:
        text = _scaled(values)
    name = TYPES.get(values.type, values.type.label)
    if name == DIGITAL:
        name = digital.name if digital else f"{kind_of(sensor)} sensor" if sensor else DIGITAL
    return SensorState(port, values.type.label, name, values.raw, plain(value), text)


def _scaled(values: InputValues) -> str:
    """Return the value as the firmware has scaled it, in words; nothing for ports without an analog sensor."""
    if values.type.label in _WITHOUT_CONVERTER:
        return ""
    mode = values.mode & MODE_BITS
    if mode == SensorMode.BOOLEAN:
        return "yes" if values.scaled else "no"
    number = values.scaled / 10 if mode in (SensorMode.CELSIUS, SensorMode.FAHRENHEIT) else values.scaled
    return f"{number:g}{UNITS.get(mode, '')}"
