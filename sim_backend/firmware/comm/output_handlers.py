"""Handlers of the motor commands. Source: docs/firmware.md section 4."""

from __future__ import annotations

from firmware_protocol import direct
from firmware_protocol.enums import OutputMode, RegulationMode, RunState
from firmware_protocol.iomap import OutputFlag
from firmware_protocol.status import Status
from firmware_protocol.wire import Members
from sim_backend.firmware.comm.handler_result import (
    DONE,
    OUT_OF_RANGE,
    HandlerResult,
    handles,
    refuse_with_zeros,
    reply_with,
)
from sim_backend.firmware.motors.output import COMMAND, OutputModule

_OPTIONS = 0xF0
"""Bits of the mode that are options."""

_MODES, _REGULATIONS, _RUN_STATES = Members(OutputMode), Members(RegulationMode), Members(RunState)


class OutputHandlers:
    """The motor commands."""

    def __init__(self, output: OutputModule) -> None:
        self._output = output

    @handles(direct.SetOutputState)
    def set_output_state(self, command: direct.SetOutputState) -> HandlerResult:
        """Store the command for the next pass; only the port is checked."""
        chosen = self._output.chosen(command.port)
        for output in chosen:
            output.power, output.mode = command.power, int(command.mode)
            output.regulation, output.turn = int(command.regulation), command.turn_ratio
            output.run_state, output.tacho_limit = int(command.run_state), command.tacho_limit
            output.flags |= COMMAND
            if self._output.regulates_position:
                output.options = int(command.mode) & _OPTIONS
        self._output.wake()
        return DONE if chosen else OUT_OF_RANGE

    @handles(direct.GetOutputState)
    def get_output_state(self, command: direct.GetOutputState) -> HandlerResult:
        """Return the commanded values, and the counters of the previous pass."""
        if command.port >= len(self._output.outputs):
            return refuse_with_zeros(direct.GetOutputState, Status.OUT_OF_RANGE)
        output = self._output.outputs[command.port]
        return reply_with(
            direct.OutputState(
                command.port,
                output.power,
                _MODES[output.mode],
                _REGULATIONS[output.regulation],
                output.turn,
                _RUN_STATES[output.run_state],
                output.tacho_limit,
                output.count,
                output.block,
                output.rotation,
            )
        )

    @handles(direct.ResetMotorPosition)
    def reset_motor_position(self, command: direct.ResetMotorPosition) -> HandlerResult:
        """Zero the block count or the rotation count in the next pass."""
        return self._raise(
            command.port, OutputFlag.RESET_BLOCK_COUNT if command.relative else OutputFlag.RESET_ROTATION_COUNT
        )

    @handles(direct.UpdateResetCount)
    def update_reset_count(self, command: direct.UpdateResetCount) -> HandlerResult:
        """Zero the tacho count and the base of the tacho limit in the next pass."""
        return self._raise(command.port, OutputFlag.RESET_TACHO_COUNT)

    def _raise(self, port: int, flag: OutputFlag) -> HandlerResult:
        if port >= len(self._output.outputs):
            return OUT_OF_RANGE
        self._output.outputs[port].flags |= int(flag)
        self._output.wake()
        return DONE
