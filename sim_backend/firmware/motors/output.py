"""The output module: motor commands, applied and regulated in passes of 1 ms.

Source: docs/firmware.md section 9; the map's layout is in section 5.2.
"""

from __future__ import annotations

from typing import Protocol

from firmware_protocol.iomap import OutputFlag
from sim_backend.firmware.cint import s32
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.motors.motor_control import (
    BRAKE,
    IDLE,
    MOTOR_ON,
    RAMP_DOWN,
    REGULATED,
    SPEED,
    SYNC,
    MotorControl,
    RegulationOption,
)
from sim_backend.firmware.motors.motor_passes import rest, roll
from sim_backend.firmware.motors.regulation import Regulators
from sim_backend.firmware.versions import Version


class MotorPlant(Protocol):
    """The motor on an output port, with its load.

    A plant may have a property ``at_rest: bool``, true when a step without PWM changes nothing; the simulated brick
    then skips the milliseconds in which nothing moves. Plants without it are stepped every millisecond.
    """

    def step(self, pwm: int, brake: bool) -> int:
        """Run one millisecond under `pwm` (-100..100 percent; `brake`: windings shorted when off).

        Returns:
            New tacho counts in this millisecond, whole degrees.
        """


_STAYS = int(OutputFlag.PENDING)
"""The flag that the firmware never clears; while it is set, RunState stays as written."""

COMMAND = int(OutputFlag.MODE | OutputFlag.SPEED | OutputFlag.TACHO_LIMIT)
_RESET_COUNT, _RESET_BLOCK, _RESET_ROTATION = (
    int(OutputFlag.RESET_TACHO_COUNT),
    int(OutputFlag.RESET_BLOCK_COUNT),
    int(OutputFlag.RESET_ROTATION_COUNT),
)
_SPEED, _LIMIT, _MODE, _PID = (
    int(OutputFlag.SPEED),
    int(OutputFlag.TACHO_LIMIT),
    int(OutputFlag.MODE),
    int(OutputFlag.PID),
)


class _Reported:
    """A value of the control, which each pass stores in the map; one that is written there stays until then."""

    def __init__(self, name: str) -> None:
        self._name = name

    def __get__(self, output: Output, owner: type[Output]) -> int:
        value: int = getattr(output.control, self._name)
        return output.written.get(self._name, value) if output.written_ms == output.clock.now_ms else value

    def __set__(self, output: Output, value: int) -> None:
        if output.written_ms != output.clock.now_ms:
            output.written, output.written_ms = {}, output.clock.now_ms
        output.written[self._name] = value


class Output:
    """One output port: the command, the motor's control and the plant.

    Attributes:
        control: Control of the motor.
        plant: The motor, or None.
        flags: `firmware_protocol.iomap.OutputFlag` bits waiting for the next pass.
        mode: As commanded.
        power: As commanded, percent.
        p_gain, i_gain, d_gain: Regulator gains; active after `OutputFlag.PID`.
        run_state: As commanded until the next pass, then live.
        regulation: As commanded.
        turn: As commanded, percent.
        options: `motor_control.MotorOption` bits; active with `OutputFlag.MODE`.
        max_speed, max_acceleration: Of the regulation to a position, degrees in 100 ms; active with `OutputFlag.PID`.
        tacho_limit: As commanded, degrees.
        written: Reported values that were written, by name.
        written_ms: The pass of these.
        clock: The brick's time.
    """

    count, block, rotation = _Reported("count"), _Reported("block"), _Reported("rotation")
    actual_speed, overloaded = _Reported("actual_speed"), _Reported("overloaded")

    def __init__(self, control: MotorControl, clock: Clock) -> None:
        self.control, self.clock = control, clock
        self.written: dict[str, int] = {}
        self.written_ms = NEVER
        self.plant: MotorPlant | None = None
        self.p_gain, self.i_gain, self.d_gain = control.gains
        self.mode = self.power = self.run_state = self.regulation = self.turn = self.tacho_limit = self.flags = 0
        self.options = self.max_speed = self.max_acceleration = 0

    def step(self) -> None:
        """Step the plant by one millisecond, at the end of a pass."""
        control, plant = self.control, self.plant
        if not self.flags & _STAYS:
            self.run_state = control.run_state
        if plant is not None:
            control.fresh = plant.step(control.actual_speed, control.brake)

    @property
    def at_rest(self) -> bool:
        """Whether the next pass would change nothing here."""
        return (
            not self.flags & ~_STAYS
            and self.control.at_rest
            and (self.plant is None or getattr(self.plant, "at_rest", False))
        )


class OutputModule:
    """Three outputs and their regulators.

    Attributes:
        due_ms: See `Module`.
        outputs: Ports A, B, C.
        common_byte: Byte 96 of the map: the period of regulation in ms if positions are regulated, else without effect.
        regulation_options: Byte 97 of the map, `motor_control.RegulationOption`; without effect like the byte before.
        regulates_position: See `Version`.
    """

    def __init__(self, clock: Clock, version: Version) -> None:
        """Make the module of a brick that has just booted.

        Args:
            clock: The brick's time.
            version: The firmware version.
        """
        self.controls = [MotorControl(i, version) for i in range(3)]
        for control in self.controls:
            control.others = [other for other in self.controls if other is not control]
        self.outputs = [Output(control, clock) for control in self.controls]
        self.due_ms = NEVER
        self._regulators = Regulators(version)
        self._groups = version.port_groups
        self.regulates_position = version.regulates_position
        self._common_byte = self._regulation_options = 0
        self._clock = clock
        self._last_ms, self._woken = clock.now_ms, False
        for control in self.controls:
            rest(control, clock.now_ms)  # the period of regulation counts from power-on

    @property
    def common_byte(self) -> int:
        """See the class."""
        return self._common_byte

    @common_byte.setter
    def common_byte(self, value: int) -> None:
        self._common_byte = value
        if self.regulates_position:
            for control in self.controls:
                control.period_ms = value

    @property
    def regulation_options(self) -> int:
        """See the class."""
        return self._regulation_options

    @regulation_options.setter
    def regulation_options(self, value: int) -> None:
        self._regulation_options = value
        if self.regulates_position:
            for control in self.controls:
                control.saturates = not value & RegulationOption.NO_SATURATION

    def chosen(self, port: int) -> list[Output]:
        """Return the outputs for a number: one port, or a group of this version of the firmware."""
        ports = [port] if port < len(self.outputs) else self._groups.get(port, ())
        return [self.outputs[index] for index in ports]

    def restart_count(self, port: int) -> None:
        """Zero TachoCount of a motor, after the counts of the next pass."""
        control = self.controls[port]
        control.reset_count()
        control.count -= control.fresh

    def wake(self) -> None:
        """Run in the next pass: a command was given or a plant moved."""
        self.due_ms, self._woken = self._clock.now_ms + 1, True

    def reset(self) -> None:
        """Stop all motors and zero their counters in the next pass."""
        for output in self.outputs:
            output.mode = output.power = output.regulation = output.turn = output.run_state = output.tacho_limit = 0
            output.flags = COMMAND | _RESET_COUNT | _RESET_BLOCK | _RESET_ROTATION
        self.wake()

    def run(self, now_ms: int) -> None:
        """Apply commands, regulate, and step the plants by one millisecond."""
        slept = now_ms - self._last_ms - 1
        if slept > 0:  # all motors were at rest
            for control in self.controls:
                rest(control, slept)
        outputs = self.outputs
        for output in outputs:
            if output.flags & ~_STAYS:
                self._apply(output)
        for control in self.controls:
            self._advance(control)
        for output in outputs:
            output.step()
        self._end(now_ms)

    def run_ahead(self, now_ms: int, last_ms: int) -> None:
        """Run the passes from `now_ms` to `last_ms`, in which no other module has work.

        Motors that are not regulated by each other take all passes one motor after the other.
        """
        a, b, c = self.outputs
        while now_ms <= last_ms and self.due_ms <= now_ms:
            commanded = self._woken or (a.flags | b.flags | c.flags) & ~_STAYS or self._last_ms + 1 < now_ms
            if commanded or (a.control.regulation | b.control.regulation | c.control.regulation) & ~SPEED:
                self.run(now_ms)
                now_ms += 1
            else:
                for output in self.outputs:
                    self._run_alone(output, last_ms - now_ms + 1)
                self._end(last_ms)
                return

    def _run_alone(self, output: Output, passes: int) -> None:
        control, plant = output.control, output.plant
        if output.at_rest:
            rest(control, passes)
            return
        while passes:
            rolled = roll(control, plant.step, passes) if plant is not None else 0
            passes -= rolled
            if not rolled:
                self._advance(control)
                output.step()
                passes -= 1

    def _advance(self, control: MotorControl) -> None:
        if control.advance():
            control.elapsed = 0
            self._regulators.regulate(control)
            control.delta = 0

    def _end(self, now_ms: int) -> None:
        """End a pass: the next one is due while something moves, or a command came."""
        self._last_ms = now_ms
        a, b, c = self.controls
        turns = a.actual_speed or b.actual_speed or c.actual_speed
        woken, self._woken = self._woken, False  # a program that sets a motor is likely to do so again
        self.due_ms = now_ms + 1 if turns or woken or not all(output.at_rest for output in self.outputs) else NEVER

    def _apply(self, output: Output) -> None:
        """Apply the flagged values in the firmware's order (docs/firmware.md section 9.1)."""
        control, flags = output.control, output.flags
        if flags & _RESET_ROTATION:
            control.rotation = 0
        if flags & _RESET_COUNT:
            control.reset_count()
        if flags & _RESET_BLOCK:
            control.block = 0
        if flags & _SPEED and output.mode & MOTOR_ON:
            control.set_motion(output.run_state, output.power, output.turn)
        if flags & _MODE:
            self._apply_mode(output)
        if flags & _LIMIT:
            control.set_limit(s32(output.tacho_limit), output.options if self.regulates_position else 0)
        if flags & _PID:
            control.gains = (output.p_gain, output.i_gain, output.d_gain)
            control.max_speed, control.max_acceleration = output.max_speed, output.max_acceleration
        output.flags &= _STAYS

    def _apply_mode(self, output: Output) -> None:
        control = output.control
        control.brake = bool(output.mode & BRAKE)
        if not output.mode & MOTOR_ON:
            control.set_motion(IDLE, 0, 0)
        elif output.mode & REGULATED:
            control.enable_regulation(output.regulation)
            if output.regulation & SYNC and control.run_state != RAMP_DOWN:
                self._regulators.reset()
        else:
            control.regulation = 0
