"""How types of sensors set the digital pins and the battery voltage of a port. Source: docs/firmware.md section 6."""

from __future__ import annotations

from firmware_protocol.enums import SensorType

LAMP_OFF = 7
"""Setting of the pins with which a light sensor's lamp is off."""

PIN_SETTINGS: dict[int, int] = {
    SensorType.NONE: 0, SensorType.SWITCH: 0, SensorType.TEMPERATURE: 0,
    SensorType.REFLECTION: 1, SensorType.ANGLE: 1,
    SensorType.LIGHT_ACTIVE: 2, SensorType.SOUND_DB: 2,
    SensorType.SOUND_DBA: 3, SensorType.CUSTOM: 4, SensorType.LOW_SPEED: 5, SensorType.LOW_SPEED_9V: 6,
    SensorType.LIGHT_INACTIVE: LAMP_OFF,
}  # fmt: skip
"""Types with the same number set the pins of the input alike."""

SUPPLY = {1: 0x01, 6: 0x10}
"""Battery voltage by the setting of the pins: in pulses, or all the time."""

CUSTOM_SUPPLY = {1: 0x10, 2: 0x01}
"""Battery voltage of a custom sensor by CustomActive of the map."""

COLOR_PINS = 8
"""Setting of the pins for a colour sensor."""

LEVELS: tuple[tuple[bool | None, bool | None], ...] = (
    (None, None), (False, False), (True, False), (False, True), (None, None), (True, True), (True, True),
    (False, False), (True, None),
)  # fmt: skip
"""Levels of the two pins by their setting; None is an input."""
