"""Checks of the brick: its state, and whether motors and sensors respond."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from firmware_protocol.direct import GetInputValues, KeepAlive
from firmware_protocol.enums import InputPort
from firmware_protocol.errors import NXTError
from nxtdrive.brick import LOW_BATTERY_MV, Brick
from nxtdrive.ports import MOTOR_PORTS, SENSOR_PORTS, MotorPort, SensorPort
from nxtdrive.sensors import identify
from nxtdrive.sensors.kinds import in_words, make_sensor

from .finding import Finding, ok, problem, warning

if TYPE_CHECKING:
    from behaviors.mission import Mission

KNOWN_FIRMWARE = ("1.05", "1.29", "1.32")
"""All were compared with the firmware's own code. Source: docs/firmware.md."""
FLAT_MV = 6100
"""Voltage below which the brick itself warns of flat alkaline cells. Source: docs/firmware.md section 8."""
FIRST_SAMPLE_S = 0.2
"""Time in which a brick that was just switched on measures its battery. Source: docs/firmware.md section 10."""
SLOW_LINK_MS = 120.0
"""Bluetooth has 30 to 65 ms; much more means radio interference."""
SHORT_SLEEP_MIN = 2
LITTLE_FLASH = 8_000

WIGGLE_POWER, WIGGLE_S, SETTLE_S = 50, 0.35, 0.25
TURNED_DEG = 20
"""A motor that is plugged in and free turns several times as far; a few degrees are play."""

DIGITAL = {"ultrasonic": "ultrasonic sensor", "compass": "compass"}
"""Digital sensors that a mission may need, in words."""


def examine(brick: Brick) -> Iterator[Finding]:
    """Run the checks that move nothing."""
    brick.sleep(FIRST_SAMPLE_S)
    info = brick.info()
    yield ok("brick", f"{info.name}, {brick.link.transport.address}")
    latency_ms = brick.link.latency_s * 1000
    if latency_ms > SLOW_LINK_MS:
        yield warning("link", f"replies take {latency_ms:.0f} ms.", "Bring the brick nearer, or use USB.")
    else:
        yield ok("link", f"replies take {latency_ms:.0f} ms")
    yield firmware(info.firmware)
    yield battery(info.battery_mv)
    if info.free_flash < LITTLE_FLASH:
        yield warning("flash", f"{info.free_flash} bytes free.", "Delete files from the brick that you do not need.")
    else:
        yield ok("flash", f"{info.free_flash} bytes free")
    yield sleep_timer(brick.request(KeepAlive()).sleep_ms)


def firmware(version: str) -> Finding:
    """Check whether the driver supports this firmware."""
    if version == "1.05":
        return warning("firmware", "1.05 does not read colour sensors.", "Install LEGO's firmware 1.29 on the brick.")
    if version not in KNOWN_FIRMWARE:
        known = ", ".join(KNOWN_FIRMWARE)
        return warning("firmware", f"{version}; {known} are known to work.", "Try it; if it fails, install 1.29.")
    return ok("firmware", version)


def battery(voltage_mv: int) -> Finding:
    """Check whether the voltage is sufficient for motors."""
    text = f"{voltage_mv / 1000:.2f} V"
    if voltage_mv < FLAT_MV:
        return problem("battery", f"{text}: flat.", "Charge it, or insert fresh batteries.")
    if voltage_mv < LOW_BATTERY_MV:
        return warning("battery", f"{text}: low, motors are slow.", "Charge a rechargeable pack now.")
    return ok("battery", text)


def sleep_timer(sleep_ms: int) -> Finding:
    """Report when the brick switches itself off; while the driver is connected it stays awake."""
    minutes = sleep_ms // 60_000
    if not sleep_ms:
        return ok("sleep timer", "never switches itself off")
    if minutes <= SHORT_SLEEP_MIN:
        remedy = "If it is off when you come back: Settings, Sleep on the brick."
        return warning("sleep timer", f"off after {minutes} min without a keep-alive.", remedy)
    return ok("sleep timer", f"off after {minutes} min without a keep-alive")


def wiggle(brick: Brick, mission: Mission) -> Iterator[Finding]:
    """Turn each motor a little, back and forth, and identify the sensors.

    Args:
        brick: An open brick.
        mission: Describes the robot: a part that is missing is a problem.
    """
    robot = mission.robot
    for motor in MOTOR_PORTS:
        yield _motor(brick, motor, needed=motor in (robot.left, robot.right))
    needed = {robot.ultrasonic: "ultrasonic", robot.compass: "compass"}
    for port in SENSOR_PORTS:
        yield _touch(brick, port) if port == robot.touch else _digital(brick, port, needed.get(port, ""))


def _motor(brick: Brick, port: MotorPort, *, needed: bool) -> Finding:
    topic, motor = f"motor {port}", brick.motor(port)
    turned = []
    for power in (WIGGLE_POWER, -WIGGLE_POWER):
        before = motor.angle
        motor.dc(power)
        brick.sleep(WIGGLE_S)
        motor.brake()
        brick.sleep(SETTLE_S)
        turned.append(motor.angle - before)
    motor.stop()
    if min(abs(angle) for angle in turned) >= TURNED_DEG:
        return ok(topic, f"turned by {turned[0]:+.0f}° and {turned[1]:+.0f}°")
    if needed:
        return problem(topic, "does not turn.", "Is its cable plugged in at both ends? Can the wheel turn freely?")
    return ok(topic, "nothing turns there, and nothing is needed there")


def _touch(brick: Brick, port: SensorPort) -> Finding:
    topic = f"sensor {port}"
    if brick.touch(port).pressed:
        return warning(topic, "the bumper is pressed.", "Is the bumper jammed? Free it.")
    return ok(topic, "the bumper is free, or nothing is plugged in: press it during `nxtdrive sensor watch`")


def _digital(brick: Brick, port: SensorPort, needed: str) -> Finding:
    """Check a port with a digital sensor of the kind `needed`, or if that is empty with any sensor or none."""
    topic = f"sensor {port}"
    try:
        identity = identify(brick.link, port)
    except NXTError as error:
        return problem(topic, error.args[0], error.remedy or "Plug the sensor in again.")
    kind = identity.kind if identity else ""
    if needed and kind != needed:
        return problem(topic, f"no {DIGITAL[needed]} answers.", "Is its cable plugged in at both ends?")
    if identity is None:
        raw = brick.request(GetInputValues(InputPort(port - 1))).raw
        return ok(topic, f"nothing digital (raw value {raw})")
    if needed:
        sensor = make_sensor(needed, brick.link, port)
        return ok(topic, f"{identity.vendor} {identity.product} measures {in_words(sensor.value, sensor.unit)}")
    return ok(topic, f"{identity.vendor} {identity.product} {identity.version}".strip())
