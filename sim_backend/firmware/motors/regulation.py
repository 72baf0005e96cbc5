"""The regulators, run every 101 passes per motor, or in a period that was set.

Source: docs/firmware.md sections 9.6 and 9.8.
"""

from __future__ import annotations

from math import isqrt

from sim_backend.firmware.cint import clamp, divide, s8, s16, s32
from sim_backend.firmware.motors.motor_control import PERIOD_MS, SPEED, SYNC, MotorControl
from sim_backend.firmware.versions import Version

WINDUP = 32_000
"""Limit of the position error, or of its product with P: see `Version.windup_by_gain`."""


class Regulators:
    """Regulation of the speed or position of single motors, and synchronisation of pairs.

    As in the firmware, there is one synchronisation state for all motors: three synchronised ones disturb each other.
    """

    __slots__ = ("_accumulated", "_old", "_turn_sum", "_wraps")

    def __init__(self, version: Version) -> None:
        self._wraps = version.wraps_sync_error
        self.reset()

    def reset(self) -> None:
        """Clear the synchronisation errors."""
        self._accumulated = self._old = self._turn_sum = 0

    def regulate(self, motor: MotorControl) -> None:
        """Regulate `motor` by the counts of its last period."""
        if motor.regulation & motor.position_bit:
            _regulate_position(motor)
        elif motor.regulation & SPEED:
            _regulate_speed(motor)
        elif motor.regulation & SYNC and (partner := _follower(motor)):
            self._synchronise(motor, partner)

    def _synchronise(self, lead: MotorControl, follow: MotorControl) -> None:
        p_gain, i_gain, d_gain = (gain // 32 for gain in lead.gains)
        self._turn_sum += 2 * _turn_rate(lead, follow)
        difference = lead.block - follow.block
        error = clamp((s16(difference) if self._wraps else difference) + self._turn_sum, 500)
        p = error * p_gain
        d = (error - self._old) * d_gain
        self._old = error
        self._accumulated = clamp(self._accumulated + error, 900)
        correction = divide(p + self._accumulated * i_gain + d, 4)
        lead.actual_speed = clamp(lead.target_speed - correction, 100)
        follow.actual_speed = clamp(follow.target_speed + correction, 100)
        if lead.turn:
            for motor in (lead, follow):
                motor.actual_speed = clamp(motor.actual_speed, abs(motor.target_speed))


def _follower(lead: MotorControl) -> MotorControl | None:
    """Return the higher port synchronised with `lead`: A regulates for B (else C), B for C, C never."""
    for other in lead.others:
        if other.index > lead.index and other.regulation & SYNC:
            return other
    return None


def _turn_rate(lead: MotorControl, follow: MotorControl) -> int:
    """Return the wanted difference of the pair's counts per period."""
    turn = lead.turn
    if not turn:
        return 0
    if not lead.block and not follow.block:
        return turn
    if lead.target_speed >= 0:
        product = follow.turn * follow.target_speed if turn > 0 else turn * lead.target_speed
    else:
        product = turn * -lead.target_speed if turn > 0 else follow.turn * -follow.target_speed
    return divide(product, 100)


def _regulate_speed(motor: MotorControl) -> None:
    p_gain = motor.gains[0]
    change, motor.speed_left = _in_period(motor, motor.target_speed, motor.speed_left)
    error = s16(motor.old_error - motor.delta) + change
    if p_gain or not motor.windup_by_gain:
        error = clamp(error, WINDUP // p_gain if motor.windup_by_gain else WINDUP)
    _drive(motor, error)


def _drive(motor: MotorControl, error: int) -> None:
    """Set the motor's PWM by the parts of the regulator."""
    p_gain, i_gain, d_gain = (gain // 32 for gain in motor.gains)
    p = error * p_gain
    d = (error - motor.old_error) * d_gain
    motor.old_error = error
    motor.accumulated_error = clamp(divide(3 * motor.accumulated_error + error, 4), 800)
    i = motor.accumulated_error * i_gain
    if motor.saturates:
        p, i = clamp(p, 100), clamp(i, 100)
    speed = divide(p + i + d, 2)
    if not -100 <= speed <= 100:
        speed = clamp(speed, 100)
        motor.overloaded = True
    motor.actual_speed = speed


def _regulate_position(motor: MotorControl) -> None:
    """Move the wanted position towards the limit, and the motor to it."""
    if not motor.max_speed:
        motor.position = motor.limit
    else:
        motor.target_speed = _speed_to(motor, s32(motor.limit - motor.position))
        move, motor.speed_left = _in_period(motor, motor.target_speed, motor.speed_left)
        motor.position = s32(motor.position + move)
    _drive(motor, clamp(s32(motor.position - motor.count), WINDUP))


def _speed_to(motor: MotorControl, way: int) -> int:
    """Return the speed on the way to a position: as fast as it can be left again by the largest acceleration."""
    if not motor.max_acceleration:
        return s8(_bounded(way, motor.max_speed))
    square = s32(2 * motor.max_acceleration * min(s32(abs(way)), WINDUP))
    speed = isqrt(square) if square >= 0 else -WINDUP
    wanted = _bounded(speed if way >= 0 else -speed, motor.max_speed)
    change, motor.acceleration_left = _in_period(motor, motor.max_acceleration, motor.acceleration_left)
    return s8(motor.target_speed + _bounded(wanted - motor.target_speed, change))


def _bounded(value: int, limit: int) -> int:
    """Limit a value in the firmware's order, which shows if the limit is negative."""
    return limit if value > limit else max(value, -limit)


def _in_period(motor: MotorControl, rate: int, left: int) -> tuple[int, int]:
    """Return the part of a rate per 100 ms that falls to one period, rounded, and the remainder, in hundredths."""
    whole = divide(rate * motor.period_ms, PERIOD_MS)
    left += rate * motor.period_ms - whole * PERIOD_MS
    if left > PERIOD_MS // 2:
        return whole + 1, left - PERIOD_MS
    if left < -(PERIOD_MS // 2):
        return whole - 1, left + PERIOD_MS
    return whole, left
