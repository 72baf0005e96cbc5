"""The driver's own USB and serial transports on a faulty wire, in virtual time."""

from __future__ import annotations

import errno
import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Self

import serial
import usb.core

from firmware_protocol.errors import BrickNotFound
from firmware_protocol.framing import LENGTH_SIZE
from nxtdrive.transports.address import Address
from nxtdrive.transports.serial_port import SerialTransport
from nxtdrive.transports.usb_port import UsbTransport
from sim_backend.doors.usb_backend import UsbBackend

from .wire import USB, Wire

SERIAL_NUMBER = "001653010203"


class _Clock:
    """The simulation's clock for a transport."""

    simulated = True
    wire: Wire

    @property
    def webcam(self) -> Any:  # noqa: ANN401 - as `SimTransport` has it
        """The camera on the robot."""
        return self.wire.simulation.webcam

    def now(self) -> float:
        """Return simulated seconds."""
        return self.wire.simulation.now_ms / 1000

    def sleep(self, duration_s: float) -> None:
        """Let simulated time pass."""
        if duration_s > 0:
            self.wire.simulation.advance(max(1, round(duration_s * 1000)))


class _Cable:
    """The wire as `UsbBackend` uses it."""

    def __init__(self, wire: Wire) -> None:
        self._wire = wire
        self._link = wire.open()

    def write(self, packet: bytes, _timeout_s: float | None) -> None:
        self._wire.send(self._link, packet)

    def read(self, timeout_s: float | None) -> bytes | None:
        if not self._wire.wait(self._link, math.ceil((timeout_s or 0.0) * 1000)):
            return None
        return self._wire.take()

    def close(self) -> None:
        self._wire.disconnect(self._link)


class _Bus(UsbBackend):
    """The bus of one wire; errors of the wire keep their number."""

    def __init__(self, wire: Wire) -> None:
        super().__init__(lambda: _Cable(wire), SERIAL_NUMBER)
        self.wire = wire

    def enumerate_devices(self) -> Any:  # noqa: ANN401 - as its base declares
        """Yield the brick if it can be reached."""
        return super().enumerate_devices() if self.wire.reachable else iter(())

    def bulk_write(self, *args: Any) -> int:  # noqa: ANN401 - as its base declares
        """Send packets."""
        with self._own_error():
            return super().bulk_write(*args)

    def bulk_read(self, *args: Any) -> int:  # noqa: ANN401 - as its base declares
        """Read packets."""
        with self._own_error():
            return super().bulk_read(*args)

    @contextmanager
    def _own_error(self) -> Iterator[None]:
        try:
            yield
        except usb.core.USBError as error:
            number, self.wire.error = self.wire.error, 0
            if number:
                raise usb.core.USBError(os.strerror(number), None, number) from error
            raise


class VirtualUsb(_Clock, UsbTransport):
    """The driver's USB transport on a wire."""

    def __init__(self, device: usb.core.Device, address: str, backend: Any) -> None:  # noqa: ANN401 - pyusb has no types
        super().__init__(device, address, backend)
        self.wire = backend.wire


class _Port:
    """The wire as pyserial presents it."""

    def __init__(self, wire: Wire) -> None:
        self.timeout = 0.0
        self._wire = wire
        self._link = wire.open()

    @property
    def in_waiting(self) -> int:
        try:
            self._wire.check(self._link)
        except OSError as error:
            raise OSError(errno.EIO, os.strerror(errno.EIO)) from error
        return self._wire.arrived

    def read(self, _size: int) -> bytes:
        try:
            if not self._wire.wait(self._link, math.ceil(self.timeout * 1000)):
                return b""
            return self._wire.take()
        except OSError as error:
            if self._wire.error == errno.EPIPE:
                self._wire.error = 0
                return b""
            raise serial.SerialException("device reports readiness to read but returned no data") from error

    def write(self, data: bytes) -> None:
        try:
            self._wire.send(self._link, data[LENGTH_SIZE:])
        except OSError as error:
            if self._wire.error == errno.EPIPE:
                self._wire.error = 0
                raise serial.SerialTimeoutException("Write timeout") from error
            raise OSError(errno.EIO, os.strerror(errno.EIO)) from error

    def reset_output_buffer(self) -> None:
        """Do nothing: nothing waits to be sent."""

    def close(self) -> None:
        self._wire.disconnect(self._link)


class VirtualSerial(_Clock, SerialTransport):
    """The driver's serial transport on a wire."""

    def __init__(self, address: str, port: Any, wire: Wire) -> None:  # noqa: ANN401 - in the place of pyserial's
        super().__init__(address, port)
        self.wire = wire

    def reopen(self, _timeout_s: float) -> Self:
        """Open the port again."""
        return self.plug_in(self.wire)

    @classmethod
    def plug_in(cls, wire: Wire) -> Self:
        """Open the port of a wire."""
        try:
            return cls("serial:///dev/rfcomm0", _Port(wire), wire)
        except OSError:
            raise BrickNotFound("no brick answers at /dev/rfcomm0.") from None


def plug_in(wire: Wire) -> VirtualUsb | VirtualSerial:
    """Open the wire with the driver's transport."""
    if wire.transport == USB:
        return VirtualUsb.open(Address.parse("usb://"), backend=_Bus(wire))
    return VirtualSerial.plug_in(wire)
