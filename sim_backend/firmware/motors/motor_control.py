"""One motor inside the firmware: run states, ramps, tacho limits. Source: docs/firmware.md sections 9.1 to 9.5 and 9.7.

The regulators that turn errors into PWM are in `regulation`. Arithmetic follows the firmware: integers, division
towards zero, fixed widths where they matter.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntFlag

from firmware_protocol.enums import OutputMode, RegulationMode, RunState
from sim_backend.firmware.cint import divide, s8, s16, s32
from sim_backend.firmware.versions import Version

IDLE, RAMP_UP, RUNNING = int(RunState.IDLE), int(RunState.RAMP_UP), int(RunState.RUNNING)
RAMP_DOWN, HOLD = int(RunState.RAMP_DOWN), int(RunState.HOLD)
MOTOR_ON, BRAKE, REGULATED = int(OutputMode.MOTOR_ON), int(OutputMode.BRAKE), int(OutputMode.REGULATED)
SPEED, SYNC = int(RegulationMode.SPEED), int(RegulationMode.SYNC)
POSITION = int(RegulationMode.POSITION)
"""The bit takes precedence over the others."""

PERIOD_MS = 100
"""Passes that must elapse before the next regulation, unless a command to firmware 1.32 has changed it."""

NO_PERIOD = 0xFF
"""A period that never ends: the counter has eight bits."""

_RAMP_AT_PERCENT = 80
"""Part of the distance to the limit after which a motor ramps down by option."""

COUNT_WRAP = 10_000_000
"""A motor without a limit restarts its count beyond this many degrees."""

STALL_PASSES = 100
"""Passes without progress after which an unregulated ramp-up increases its power."""

CREEP = 10
"""Lowest speed at the start or end of a ramp, percent."""


class MotorOption(IntFlag):
    """Options of firmware 1.32."""

    HOLD_AT_LIMIT = 0x10
    RAMP_DOWN_TO_LIMIT = 0x20


_HOLDS_AT_LIMIT, RAMPS_TO_LIMIT = int(MotorOption.HOLD_AT_LIMIT), int(MotorOption.RAMP_DOWN_TO_LIMIT)
"""Plain integers: a flag's operators would take as long as the rest of a pass."""


class RegulationOption(IntFlag):
    """Options of firmware 1.32 for all regulators."""

    NO_SATURATION = 1


class MotorControl:
    """State of one motor, as the firmware's output driver keeps it.

    Attributes:
        index: 0..2 for A..C.
        stops_all_synchronised: See `Version`; never for A.
        windup_by_gain: See `Version`.
        position_bit: The regulator bit of a position; 0 in firmware that regulates none.
        others: The other two motors.
        set_speed: Final speed of the motion, percent.
        target_speed: Speed for this pass, percent.
        actual_speed: PWM of the motor, percent.
        turn: Turn ratio, percent.
        gains: P, I and D gains.
        elapsed: Passes since the last regulation.
        run_state: Phase of the motion.
        regulation: Active regulator bits (speed, synchronisation, position).
        position: The present target of the regulation to a position, degrees.
        max_speed: Limit of speed in regulation to a position, degrees in 100 ms; 0 for none.
        max_acceleration: Change of that speed in 100 ms; 0 for any.
        speed_left, acceleration_left: Parts of a degree, in hundredths, that periods other than 100 ms left over.
        period_ms: Passes that must elapse before the next regulation.
        saturates: Whether the parts of a regulator are limited, not only their sum.
        options: See `MotorOption`.
        brake: Whether the windings are shorted in the PWM's off-phase.
        overloaded: Whether the regulator requested more than 100 %.
        forever: Whether no tacho limit is active.
        delta: Counts since the last regulation.
        count: TachoCount, degrees.
        limit: Absolute target of the tacho limit, degrees.
        block: BlockTachoCount, degrees.
        rotation: RotationCount, degrees.
        fresh: Counts that arrived since the last pass.
        zero_divisions: How often a ramp divided by zero; the result on the brick's processor is unknown, here it is 0.
    """

    def __init__(self, index: int, version: Version) -> None:
        self.index = index
        self.stops_all_synchronised = version.stops_all_synchronised and index > 0
        self.windup_by_gain = version.windup_by_gain
        self.position_bit = POSITION if version.regulates_position else 0
        self.others: Sequence[MotorControl] = ()
        self.gains = (96, 32, 32)
        self.set_speed = self.target_speed = self.actual_speed = self.turn = 0
        self.elapsed = self.run_state = self.regulation = 0
        self.brake = self.overloaded = False
        self.forever = True
        self.accumulated_error = self.old_error = self.delta = self.fresh = 0
        self.count = self.limit = self.block = self.rotation = 0
        self.ramp_start = self.ramp_old = 0
        self.up_step = self.up_counter = self.down_step = self.down_counter = 0
        self.zero_divisions = 0
        self.position = self.speed_left = self.acceleration_left = self.options = 0
        self.max_speed, self.max_acceleration = 80, 20
        self.period_ms, self.saturates = PERIOD_MS, True

    @property
    def at_rest(self) -> bool:
        """Whether a pass without new counts changes nothing but the regulation timer."""
        return (
            not (self.actual_speed or self.target_speed or self.set_speed or self.regulation or self.fresh)
            and self.run_state in (IDLE, RUNNING)
            and self.count <= COUNT_WRAP
        )

    @property
    def partner(self) -> MotorControl | None:
        """The motor this one is synchronised with: the first other one in synchronisation."""
        for other in self.others:
            if other.regulation & SYNC:
                return other
        return None

    def reset_count(self) -> None:
        """Zero TachoCount and the base of the tacho limit, for a synchronised pair on both motors."""
        pair: list[MotorControl] = [self]
        if self.regulation & SYNC and (partner := self.partner):
            pair.append(partner)
        for motor in pair:
            motor.count = motor.limit = motor.position = 0
        self.forever = False

    def set_limit(self, limit: int, options: int) -> None:
        """Move the target of the tacho limit by `limit` degrees in the direction of motion; 0 removes the limit.

        In regulation to a position it is that position, and the options stay as they were.
        """
        if self.regulation & self.position_bit:
            self.forever, self.limit = False, limit
            return
        self.forever = not limit
        self.options = options if limit else 0
        if limit:
            direction = self.set_speed or self.target_speed
            self.limit = s32(self.limit + limit if direction > 0 else self.limit - limit)

    def enable_regulation(self, regulation: int) -> None:
        """Activate regulator bits; speed regulation from rest starts with cleared errors."""
        self.regulation = regulation
        if self.run_state != RAMP_DOWN and regulation & SPEED and not self.set_speed:
            self.accumulated_error = self.old_error = self.speed_left = 0

    def set_motion(self, run_state: int, speed: int, turn: int) -> None:
        """Start a motion; see `setSpeed` in docs/firmware.md section 9.1."""
        if (self.set_speed, self.run_state, self.turn) == (speed, run_state, turn) and run_state != IDLE:
            return
        if not self.target_speed:
            self.accumulated_error = self.old_error = self.speed_left = self.elapsed = self.delta = self.fresh = 0
        if run_state == IDLE:
            self.regulation = 0
        elif run_state == RUNNING:
            self.set_speed = self.target_speed = speed
            self.turn = turn
            run_state = RUNNING if speed else HOLD
        elif run_state in (RAMP_UP, RAMP_DOWN):
            run_state = self._start_ramp(run_state, speed, turn)
        self.run_state = run_state
        self.overloaded = False

    def _start_ramp(self, run_state: int, speed: int, turn: int) -> int:
        if run_state == RAMP_UP:
            faster = self.set_speed < speed if speed > 0 else self.set_speed > speed
            ramps = not self.set_speed or faster
        else:
            ramps = self.set_speed > speed if self.target_speed >= 0 else self.set_speed < speed
        if not ramps:
            return RUNNING
        self._begin_ramp(run_state, speed)
        self.turn = turn
        return run_state

    def _begin_ramp(self, run_state: int, speed: int) -> None:
        self.set_speed = speed
        if run_state == RAMP_UP:
            self.up_step = self.up_counter = 0
        else:
            self.down_step = self.down_counter = 0
        self.ramp_start = self.count

    def advance(self) -> bool:
        """Run one pass of the motor, up to regulation.

        Returns:
            Whether the regulation period is over.
        """
        fresh = self.fresh
        if fresh:
            self.fresh = 0
            self.delta += fresh
            self.count += fresh
            self.block += fresh
            self.rotation += fresh
        elapsed = self.elapsed = self.elapsed + 1 & 0xFF
        state = self.run_state
        if state != IDLE:
            if state == RAMP_UP:
                self._ramp_up()
                state = self.run_state
            if state == RAMP_DOWN:
                self._ramp_down()
                state = self.run_state
            if state == RUNNING:
                self._run()
                state = self.run_state
        if state == IDLE:
            self.brake = False
            if self.actual_speed or self.target_speed or self.set_speed:
                self._coast()
        elif state == HOLD:
            self._hold()
            return False
        return elapsed > self.period_ms

    def _run(self) -> None:
        regulation = self.regulation
        if regulation & self.position_bit:
            return
        if self.forever:
            if self.count > COUNT_WRAP:
                self.count = 0
            if self.target_speed:
                self.limit = self.count
        elif regulation & SYNC:
            self._check_synchronised_limit()
        elif speed := self.set_speed:
            limit = self._threshold(self)
            if self.count >= limit if speed > 0 else self.count <= limit:
                self._end_run()
                regulation = self.regulation
        if not regulation:
            self.actual_speed = self.target_speed

    def _end_run(self) -> None:
        """Stop at the limit, or slow down to it."""
        if self.options & RAMPS_TO_LIMIT:
            self.run_state, self.set_speed = RAMP_DOWN, 0
        else:
            self._rest()

    def _threshold(self, motor: MotorControl) -> int:
        """Return the count of a motor at which this one's motion ends, or ramps down by its option."""
        ramps = self.options & RAMPS_TO_LIMIT
        return divide(motor.limit * _RAMP_AT_PERCENT, 100) if ramps else motor.limit

    def _rest(self) -> None:
        """Stop, or hold by regulation of the speed 0."""
        self.run_state = self._at_limit
        self.regulation = SPEED if self.run_state == HOLD else 0

    @property
    def _at_limit(self) -> int:
        """Run state after the limit was reached."""
        return HOLD if self.options & _HOLDS_AT_LIMIT else IDLE

    @property
    def _at_synchronised_limit(self) -> int:
        return RAMP_DOWN if self.options & RAMPS_TO_LIMIT else self._at_limit

    def _coast(self) -> None:
        if speed := self.actual_speed:
            self.actual_speed = speed - 1 if speed > 0 else speed + 1
        if speed := self.target_speed:
            self.target_speed = speed - 1 if speed > 0 else speed + 1
        if speed := self.set_speed:
            self.set_speed = speed - 1 if speed > 0 else speed + 1

    def _hold(self) -> None:
        self.set_speed = self.actual_speed = self.target_speed = self.elapsed = self.delta = self.speed_left = 0
        self.run_state = RUNNING

    def _ramp_up(self) -> None:
        sign = 1 if self.set_speed > 0 else -1
        if not self.target_speed:
            self.target_speed = CREEP * sign
        else:
            if not self.up_step:
                steps = self.set_speed - self.target_speed
                self.up_step = self._counts_per_percent(self.limit - self.ramp_start, steps, sign)
                self.ramp_old = self.count
            if (self.count - self.ramp_old - self.up_step) * sign > 0:
                self.target_speed = s8(self.target_speed + sign)
                self.ramp_old, self.up_counter = self.count, 0
            elif not self.regulation & SPEED:
                self.up_counter += 1
                if self.up_counter > STALL_PASSES:
                    self.up_counter = 0
                    self.target_speed = s8(self.target_speed + sign)
        if (s32(self.count - sign * self.ramp_start) - s32(self.limit - sign * self.ramp_start)) * sign >= 0:
            self.target_speed, self.run_state = self.set_speed, self._at_limit
        elif (self.target_speed - self.set_speed) * sign > 0:
            self.target_speed = self.set_speed
        if not self.regulation:
            self.actual_speed = self.target_speed

    def _ramp_down(self) -> None:
        sign = 1 if self.target_speed > 0 else -1
        if not self.down_step:
            steps = self.target_speed - self.set_speed
            if not self.set_speed and abs(self.target_speed) > CREEP:
                steps -= CREEP * sign
            self.down_step = self._counts_per_percent(self.limit - self.count, steps, sign)
            self.ramp_old = self.count
        if (self.count - self.ramp_old - self.down_step) * sign > 0:
            self._slow_down(sign)
        elif not self.regulation & SPEED:
            self.down_counter += 1
            if self.down_counter > (30 * sign * self.down_step & 0xFFFF):
                self.down_counter = 20 * sign * self.down_step & 0xFFFF
                self.target_speed = s8(self.target_speed + sign)
        if self._reached_ramp_end():
            self._end_ramp_down()
        if not self.regulation:
            self.actual_speed = self.target_speed

    def _counts_per_percent(self, counts: int, steps: int, sign: int) -> int:
        self.zero_divisions += not steps
        return s16(sign * divide(s32(counts), steps))

    def _slow_down(self, sign: int) -> None:
        slower = s8(self.target_speed - sign)
        self.target_speed = slower if slower * sign >= CREEP else CREEP * sign
        self.ramp_old, self.down_counter = self.count, 0
        partner = self.partner if self.turn else None
        if partner:
            if self.target_speed >= 0 and partner.actual_speed < 0:
                partner.target_speed = s8(partner.target_speed - 1)
            elif self.target_speed < 0 and partner.actual_speed > 0:
                partner.target_speed = s8(partner.target_speed + 1)

    def _reached_ramp_end(self) -> bool:
        if self.regulation & SYNC and self.turn:
            self._check_synchronised_limit()
            return self.run_state != RAMP_DOWN
        return self.count >= self.limit if self.target_speed > 0 else self.count <= self.limit

    def _end_ramp_down(self) -> None:
        if self.regulation & SYNC:
            pair = [self, self.partner] if not self.stops_all_synchronised else [self, *self.others]
            for motor in pair:
                if motor is self or (motor and motor.regulation & SYNC):
                    motor.set_speed = motor.target_speed = motor.actual_speed = 0
                    motor._rest()
            return
        if not self.set_speed:
            self.target_speed = self.actual_speed = 0
        self._rest()

    def _check_synchronised_limit(self) -> None:
        partner = self.partner
        if partner is None:
            return
        if not self.turn:
            motors = (self, partner)
            if self.set_speed > 0:
                reached = any(motor.count >= self._threshold(motor) for motor in motors)
            elif self.set_speed < 0:
                reached = any(motor.count <= self._threshold(motor) for motor in motors)
            else:
                reached = False
        else:
            reached = self._outer_reached_limit(partner)
        if reached:
            self.run_state, partner.run_state = self._at_synchronised_limit, partner._at_synchronised_limit

    def _outer_reached_limit(self, partner: MotorControl) -> bool:
        """Return whether the faster motor of a turning pair reached its limit; the slower one then gets its counts."""
        first, second = (partner, self) if self.turn > 0 else (self, partner)
        if first.target_speed >= 0:
            outer, inner = first, second
            reached = outer.count >= self._threshold(outer)
        else:
            outer, inner = second, first
            reached = outer.count <= self._threshold(outer)
        if reached:
            inner.count, inner.limit = outer.count, self._threshold(outer)
        return reached
