"""Handlers of the sensor commands, analog and I2C. Source: docs/firmware.md section 4 and 7."""

from __future__ import annotations

from firmware_protocol import direct
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.status import Status
from sim_backend.firmware.handler_result import (
    DONE,
    OUT_OF_RANGE,
    HandlerResult,
    handles,
    refuse_with_zeros,
    reply_with,
)
from sim_backend.firmware.input import InputModule
from sim_backend.firmware.low_speed import LowSpeedModule


class InputHandlers:
    """The commands for the four input ports."""

    def __init__(self, inputs: InputModule, low_speed: LowSpeedModule) -> None:
        self._input, self._low_speed = inputs, low_speed

    @handles(direct.SetInputMode)
    def set_input_mode(self, command: direct.SetInputMode) -> HandlerResult:
        """Store type and mode; only the port is checked."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        self._input.set_mode(self._input.ports[command.port], int(command.type), int(command.mode))
        return DONE

    @handles(direct.GetInputValues)
    def get_input_values(self, command: direct.GetInputValues) -> HandlerResult:
        """The values of the previous pass."""
        if not self._exists(command.port):
            return refuse_with_zeros(direct.GetInputValues, Status.OUT_OF_RANGE)
        port = self._input.ports[command.port]
        return reply_with(
            direct.InputValues(
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

    @handles(direct.ResetInputScaledValue)
    def reset_scaled_value(self, command: direct.ResetInputScaledValue) -> HandlerResult:
        """Clear the scaled value, and nothing else."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        self._input.ports[command.port].scaled = 0
        return DONE

    @handles(direct.LSGetStatus)
    def ls_get_status(self, command: direct.LSGetStatus) -> HandlerResult:
        """State of the bus and number of bytes waiting; none for a port that is not configured."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        status, ready = self._bus(command.port)
        return reply_with(direct.LSStatus(ready), status)

    @handles(direct.LSWrite)
    def ls_write(self, command: direct.LSWrite) -> HandlerResult:
        """Start a transaction."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        if command.tx_length > direct.LS_LIMIT or command.rx_length > direct.LS_LIMIT:
            return HandlerResult(Status.ILLEGAL_SIZE)
        data = command.data[: command.tx_length]
        started = self._low_speed.write(command.port, data, command.rx_length)
        return DONE if started else HandlerResult(Status.CHANNEL_NOT_CONFIGURED)

    @handles(direct.LSRead)
    def ls_read(self, command: direct.LSRead) -> HandlerResult:
        """Fetch the bytes waiting, even during a transaction."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        status, ready = self._bus(command.port)
        data = self._low_speed.channels[command.port].fetch() if ready else b""
        return reply_with(direct.LSData(len(data), data), status)

    def _bus(self, port: int) -> tuple[Status, int]:
        status = self._low_speed.status(port)
        unknown = status == Status.CHANNEL_NOT_CONFIGURED
        return status, 0 if unknown else self._low_speed.channels[port].ready

    def _exists(self, port: int) -> bool:
        return port < len(self._input.ports)
