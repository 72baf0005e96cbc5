"""Snapshots of a whole brick: motors, input ports, battery, link. Shown by ``nxtdrive monitor``."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from firmware_protocol.direct import GetInputValues, GetOutputState
from firmware_protocol.enums import InputPort, OutputMode, OutputPort
from firmware_protocol.errors import BrickError
from nxtdrive.brick import Brick
from nxtdrive.sensors import Measuring
from nxtdrive.sensors.kinds import in_words, plain

SENSOR_PORTS = (1, 2, 3, 4)
MOTOR_PORTS = (OutputPort.A, OutputPort.B, OutputPort.C)


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
        raw: Converter value, 0..1023; meaningless for digital sensors.
        value: Measurement of the named sensor, in its unit; None for other ports, and without an echo.
        text: The value with its quantity and unit, or why there is none.
    """

    port: int
    type: str
    raw: int
    value: object
    text: str


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


def look(brick: Brick, sensors: Mapping[int, Measuring[Any]]) -> Snapshot:
    """Read everything once.

    Args:
        brick: An open brick.
        sensors: Sensor by port. Other ports are read as they are configured, without disturbing a program's sensors.

    Raises:
        LinkError: The link is lost; also when a named sensor gives no valid values.
    """
    return Snapshot(
        time_s=round(brick.now(), 3),
        battery_mv=round(brick.battery_v * 1000),
        latency_ms=round(brick.link.latency_s * 1000, 1),
        motors=tuple(_motor(brick, port) for port in MOTOR_PORTS),
        sensors=tuple(_sensor(brick, port, sensors.get(port)) for port in SENSOR_PORTS),
    )


def watch(brick: Brick, sensors: Mapping[int, Measuring[Any]], every_s: float) -> Iterator[Snapshot]:
    """Yield snapshots forever; errors as for `look`.

    Args:
        brick: An open brick.
        sensors: As for `look`.
        every_s: Time between snapshots; one takes some ten requests, which may last longer over a slow link.
    """
    due = brick.now()
    while True:
        yield look(brick, sensors)
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


def _sensor(brick: Brick, port: int, sensor: Measuring[Any] | None) -> SensorState:
    value, text = None, ""
    if sensor is not None:
        try:
            value = sensor.value
            text = f"{sensor.quantity} {in_words(value, sensor.unit)}"
        except BrickError as error:
            text = error.status.label
    values = brick.request(GetInputValues(InputPort(port - 1)))
    if sensor is None and values.valid:
        text = str(values.scaled)
    return SensorState(port, values.type.label, values.raw, plain(value), text)
