"""What the motor commands do. Source: docs/firmware.md section 4."""

from __future__ import annotations

from firmware_protocol.direct import (
    GetOutputState,
    OutputState,
    ResetMotorPosition,
    SetOutputState,
    UpdateResetCount,
)
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.iomap import OutputFlag
from firmware_protocol.status import Status
from sim_backend.firmware.answer import DONE, OUT_OF_RANGE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.output import COMMAND, OutputModule


class OutputHandlers:
    """The motor commands."""

    def __init__(self, output: OutputModule) -> None:
        self._output = output

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            SetOutputState: self.set_output_state,
            GetOutputState: self.get_output_state,
            ResetMotorPosition: self.reset_motor_position,
            UpdateResetCount: self.update_reset_count,
        }

    def set_output_state(self, command: SetOutputState) -> Answer:
        """Store the command for the next pass; only the port is checked."""
        if command.port == OutputPort.ALL:
            chosen = self._output.outputs
        elif command.port < len(self._output.outputs):
            chosen = [self._output.outputs[command.port]]
        else:
            return OUT_OF_RANGE
        for output in chosen:
            output.power, output.mode = command.power, int(command.mode)
            output.regulation, output.turn = int(command.regulation), command.turn_ratio
            output.run_state, output.tacho_limit = int(command.run_state), command.tacho_limit
            output.flags |= COMMAND
        self._output.wake()
        return DONE

    def get_output_state(self, command: GetOutputState) -> Answer:
        """What was commanded, and the counters of the previous pass."""
        if command.port >= len(self._output.outputs):
            return refuse_with_zeros(GetOutputState, Status.OUT_OF_RANGE)
        output = self._output.outputs[command.port]
        control = output.control
        return answer(
            OutputState(
                command.port,
                output.power,
                OutputMode(output.mode),
                RegulationMode(output.regulation),
                output.turn,
                RunState(output.run_state),
                output.tacho_limit,
                control.count,
                control.block,
                control.rotation,
            )
        )

    def reset_motor_position(self, command: ResetMotorPosition) -> Answer:
        """Zero the block count or the rotation count in the next pass."""
        return self._raise(
            command.port, OutputFlag.RESET_BLOCK_COUNT if command.relative else OutputFlag.RESET_ROTATION_COUNT
        )

    def update_reset_count(self, command: UpdateResetCount) -> Answer:
        """Zero the tacho count and the base of the tacho limit in the next pass."""
        return self._raise(command.port, OutputFlag.RESET_TACHO_COUNT)

    def _raise(self, port: int, flag: OutputFlag) -> Answer:
        if port >= len(self._output.outputs):
            return OUT_OF_RANGE
        self._output.outputs[port].flags |= int(flag)
        self._output.wake()
        return DONE
