"""What the sensor commands do, analog and I2C. Source: docs/firmware.md section 4 and 7."""

from __future__ import annotations

from firmware_protocol.direct import (
    LS_LIMIT,
    GetInputValues,
    InputValues,
    LSData,
    LSGetStatus,
    LSRead,
    LSStatus,
    LSWrite,
    ResetInputScaledValue,
    SetInputMode,
)
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.status import Status
from sim_backend.firmware.answer import DONE, OUT_OF_RANGE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.input import InputModule
from sim_backend.firmware.low_speed import LowSpeedModule


class InputHandlers:
    """The commands for the four input ports."""

    def __init__(self, inputs: InputModule, low_speed: LowSpeedModule) -> None:
        self._input, self._low_speed = inputs, low_speed

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            SetInputMode: self.set_input_mode,
            GetInputValues: self.get_input_values,
            ResetInputScaledValue: self.reset_scaled_value,
            LSGetStatus: self.ls_get_status,
            LSWrite: self.ls_write,
            LSRead: self.ls_read,
        }

    def set_input_mode(self, command: SetInputMode) -> Answer:
        """Store type and mode as they are; only the port is checked."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        self._input.set_mode(self._input.ports[command.port], int(command.type), int(command.mode))
        return DONE

    def get_input_values(self, command: GetInputValues) -> Answer:
        """The values of the previous pass."""
        if not self._exists(command.port):
            return refuse_with_zeros(GetInputValues, Status.OUT_OF_RANGE)
        port = self._input.ports[command.port]
        return answer(
            InputValues(
                port=command.port,
                valid=not port.invalid,
                calibrated=False,
                type=SensorType(port.type),
                mode=SensorMode(port.mode),
                raw=port.raw,
                normalized=port.normalized,
                scaled=port.scaled,
                calibrated_value=port.normalized,
            )
        )

    def reset_scaled_value(self, command: ResetInputScaledValue) -> Answer:
        """Clear the scaled value, and nothing else."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        self._input.ports[command.port].scaled = 0
        return DONE

    def ls_get_status(self, command: LSGetStatus) -> Answer:
        """State of the bus and bytes waiting; none are reported for a port that is not set up."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        status, ready = self._bus(command.port)
        return answer(LSStatus(ready), status)

    def ls_write(self, command: LSWrite) -> Answer:
        """Start a transaction."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        if command.tx_length > LS_LIMIT or command.rx_length > LS_LIMIT:
            return Answer(Status.ILLEGAL_SIZE)
        data = command.data[: command.tx_length]
        started = self._low_speed.write(command.port, data, command.rx_length)
        return DONE if started else Answer(Status.CHANNEL_NOT_CONFIGURED)

    def ls_read(self, command: LSRead) -> Answer:
        """Fetch what is there, also while a transaction runs."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        status, ready = self._bus(command.port)
        data = self._low_speed.channels[command.port].fetch() if ready else b""
        return answer(LSData(len(data), data), status)

    def _bus(self, port: int) -> tuple[Status, int]:
        status = self._low_speed.status(port)
        unknown = status == Status.CHANNEL_NOT_CONFIGURED
        return status, 0 if unknown else self._low_speed.channels[port].ready

    def _exists(self, port: int) -> bool:
        return port < len(self._input.ports)
