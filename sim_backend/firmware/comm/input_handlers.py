"""Handlers of the sensor commands, analog and I2C. Source: docs/firmware.md sections 4 and 7."""

from __future__ import annotations

from firmware_protocol import direct
from firmware_protocol.enums import SensorMode, SensorType
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
from sim_backend.firmware.sensors.input import InputModule
from sim_backend.firmware.sensors.input_port import INVALID
from sim_backend.firmware.sensors.low_speed import LowSpeedModule

_TYPES, _MODES = Members(SensorType), Members(SensorMode)


class InputHandlers:
    """The commands for the four input ports."""

    def __init__(self, inputs: InputModule, low_speed: LowSpeedModule) -> None:
        self._input, self._low_speed = inputs, low_speed

    @handles(direct.SetInputMode)
    def set_input_mode(self, command: direct.SetInputMode) -> HandlerResult:
        """Store type and mode; only the port is checked."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        self._input.store(command.port, type=command.type, mode=command.mode, invalid=INVALID)
        return DONE

    @handles(direct.GetInputValues)
    def get_input_values(self, command: direct.GetInputValues) -> HandlerResult:
        """Return the values of the previous pass."""
        if not self._exists(command.port):
            return refuse_with_zeros(direct.GetInputValues, Status.OUT_OF_RANGE)
        port = self._input.ports[command.port]
        return reply_with(
            direct.InputValues(
                port=command.port,
                valid=not port.invalid,
                calibrated=False,
                type=_TYPES[port.type],
                mode=_MODES[port.mode],
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
        self._input.store(command.port, scaled=0)
        return DONE

    @handles(direct.LSGetStatus)
    def ls_get_status(self, command: direct.LSGetStatus) -> HandlerResult:
        """Return the state of the bus and number of bytes waiting."""
        if not self._exists(command.port):
            return OUT_OF_RANGE
        ready = self._low_speed.channels[command.port].ready
        return reply_with(direct.LSStatus(ready), self._low_speed.status(command.port))

    @handles(direct.LSWrite)
    def ls_write(self, command: direct.LSWrite) -> HandlerResult:
        """Start a transaction."""
        port = self._low_speed.write_port(command.port)
        if not self._exists(port):
            return OUT_OF_RANGE
        if command.tx_length > direct.LS_LIMIT or command.rx_length > direct.LS_LIMIT:
            return HandlerResult(Status.ILLEGAL_SIZE)
        data = command.data[: command.tx_length]
        started = self._low_speed.write(port, data, command.rx_length, int(command.port))
        return DONE if started else HandlerResult(Status.CHANNEL_NOT_CONFIGURED)

    @handles(direct.LSRead)
    def ls_read(self, command: direct.LSRead) -> HandlerResult:
        """Fetch the bytes waiting, even during a transaction; it is pending only if there are none.

        After an error they stay, and the reply has only the zeros that would fill it up.
        """
        if not self._exists(command.port):
            return OUT_OF_RANGE
        status, ready = self._low_speed.status(command.port), self._low_speed.channels[command.port].ready
        if status in (Status.OK, Status.PENDING):
            return reply_with(
                direct.LSData(ready, self._low_speed.fetch(command.port, ready)), Status.OK if ready else status
            )
        return HandlerResult(status, bytes([ready]) + bytes(max(direct.LS_LIMIT - ready, 0)))

    def _exists(self, port: int) -> bool:
        return port < len(self._input.ports)
