"""Several passes of one motor at once, where nothing else has work and no other motor regulates it.

Source: docs/firmware.md sections 9.2 and 9.3.
"""

from __future__ import annotations

from collections.abc import Callable
from math import inf

from sim_backend.firmware.motors.motor_control import (
    COUNT_WRAP,
    IDLE,
    NO_PERIOD,
    RAMPS_TO_LIMIT,
    RUNNING,
    SPEED,
    MotorControl,
)


def rest(motor: MotorControl, passes: int) -> None:
    """Run passes at rest: only the regulation timer continues, and an idle motor ends its brake."""
    if motor.run_state == IDLE:
        motor.brake = False
    period = motor.period_ms + 1
    elapsed = min(motor.elapsed, motor.period_ms) + passes
    if elapsed >= period and motor.period_ms < NO_PERIOD:
        motor.delta = 0
    motor.elapsed = elapsed % period


def roll(motor: MotorControl, step: Callable[[int, bool], int], passes: int) -> int:
    """Run passes with the plant's steps as long as nothing but counts changes.

    Args:
        motor: It is not synchronised.
        step: See `output.MotorPlant`.
        passes: Number of passes at most.

    Returns:
        The number of passes run; 0 if the next one may change more.
    """
    regulation, forever, speed = motor.regulation, motor.forever, motor.set_speed
    steady = regulation == SPEED or (not regulation and motor.actual_speed == motor.target_speed)
    if motor.run_state != RUNNING or not steady or motor.options & RAMPS_TO_LIMIT:
        return 0
    least = motor.limit if not forever and speed < 0 else -inf
    most = COUNT_WRAP + 1 if forever else motor.limit if speed > 0 else inf
    pwm, brake, count, fresh = motor.actual_speed, motor.brake, motor.count, motor.fresh
    passes, done = min(passes, motor.period_ms - motor.elapsed), 0
    while done < passes and least < count + fresh < most:
        count += fresh
        fresh = step(pwm, brake)
        done += 1
    counts = count - motor.count
    motor.count, motor.fresh = count, fresh
    motor.delta += counts
    motor.block += counts
    motor.rotation += counts
    motor.elapsed += done
    if done and forever and motor.target_speed:
        motor.limit = count
    return done
