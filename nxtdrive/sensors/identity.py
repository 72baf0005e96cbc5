"""Identification of digital sensors; most store their name."""

from __future__ import annotations

from dataclasses import dataclass

from firmware_protocol.errors import BrickError
from firmware_protocol.status import Status
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort
from nxtdrive.sensors.digital import Temperature
from nxtdrive.sensors.i2c import I2CSensor

_VERSION, _VENDOR, _PRODUCT = 0x00, 0x08, 0x10
_TEXT_SIZE = 8
"""Source: LEGO's Hardware Developer Kit, which requires these registers of every sensor at address 0x02."""

_KINDS = {("LEGO", "Sonar"): "ultrasonic", ("HiTechnc", "Compass"): "compass"}


@dataclass(frozen=True, slots=True)
class Identity:
    """The stored identity of a digital sensor.

    Attributes:
        version: Such as ``V1.0``.
        vendor: Such as ``LEGO``.
        product: Such as ``Sonar``.
        kind: Its kind as in `nxtdrive.sensors.kinds`; ``i2c`` for one that is not listed there.
    """

    version: str
    vendor: str
    product: str
    kind: str


def identify(link: Link, port: SensorPort) -> Identity | None:
    """Identify the digital sensor on a port.

    This changes the port's type: set up other sensors again.

    Returns:
        None if no digital sensor answers; touch, light and sound sensors are not digital.
    """
    try:
        sensor = I2CSensor(link, port)
        version, vendor, product = (_text(sensor, register) for register in (_VERSION, _VENDOR, _PRODUCT))
    except BrickError as error:
        _no_answer(error)
        return _without_identity(link, port)
    return Identity(version, vendor, product, _KINDS.get((vendor, product), "i2c"))


def _without_identity(link: Link, port: SensorPort) -> Identity | None:
    """Look for LEGO's temperature sensor, which has another address and no name."""
    try:
        I2CSensor(link, port, Temperature.address).read(1, 1)
    except BrickError as error:
        _no_answer(error)
        return None
    return Identity("", "LEGO", "Temperature", "temperature")


def _text(sensor: I2CSensor, register: int) -> str:
    raw = sensor.read(register, _TEXT_SIZE).split(b"\0", 1)[0]
    return "".join(character for character in raw.decode("latin-1") if character.isprintable()).strip()


def _no_answer(error: BrickError) -> None:
    if error.status is not Status.BUS_ERROR:
        raise error
