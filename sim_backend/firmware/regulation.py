"""The two regulators, run every 101 passes per motor. Source: docs/firmware.md section 9.6."""

from __future__ import annotations

from sim_backend.firmware.cint import clamp, divide, s16
from sim_backend.firmware.motor_control import SPEED, SYNC, MotorControl

WINDUP = 32_000
"""Limit of the position error, or of its product with P: see `Version.windup_by_gain`."""


class Regulators:
    """Speed regulation of single motors and synchronisation of pairs.

    As in the firmware, there is one synchronisation state for all motors: three synchronised ones disturb each other.
    """

    __slots__ = ("_accumulated", "_old", "_turn_sum")

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Clear the synchronisation errors."""
        self._accumulated = self._old = self._turn_sum = 0

    def regulate(self, motor: MotorControl) -> None:
        """Regulate `motor` by the counts of its last period."""
        if motor.regulation & SPEED:
            _regulate_speed(motor)
        elif motor.regulation & SYNC and (partner := _follower(motor)):
            self._synchronise(motor, partner)

    def _synchronise(self, lead: MotorControl, follow: MotorControl) -> None:
        p_gain, i_gain, d_gain = (gain // 32 for gain in lead.gains)
        self._turn_sum += 2 * _turn_rate(lead, follow)
        error = clamp(lead.block - follow.block + self._turn_sum, 500)
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
    """The higher port synchronised with `lead`: A regulates for B (else C), B for C, C never."""
    for other in lead.others:
        if other.index > lead.index and other.regulation & SYNC:
            return other
    return None


def _turn_rate(lead: MotorControl, follow: MotorControl) -> int:
    """Wanted difference of the pair's counts per period."""
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
    p_gain, i_gain, d_gain = motor.gains
    old = motor.old_error
    error = s16(old - motor.delta) + motor.target_speed
    if p_gain or not motor.windup_by_gain:
        error = clamp(error, WINDUP // p_gain if motor.windup_by_gain else WINDUP)
    p = clamp(error * (p_gain // 32), 100)
    d = (error - old) * (d_gain // 32)
    motor.old_error = error
    motor.accumulated_error = accumulated = clamp(divide(3 * motor.accumulated_error + error, 4), 800)
    i = clamp(accumulated * (i_gain // 32), 100)
    speed = divide(p + i + d, 2)
    if not -100 <= speed <= 100:
        speed = clamp(speed, 100)
        motor.overloaded = True
    motor.actual_speed = speed
