"""A Bluetooth serial port: ``/dev/rfcomm0``, ``COM5``, or a pseudo-terminal with a simulated brick behind it.

pyserial opens with O_NOCTTY. Without it the port would become the controlling terminal of a session leader (a systemd
service, the first process of a container), and the end of the link would kill the program by SIGHUP.
"""

from __future__ import annotations

import contextlib
import errno
from typing import Self

import serial

from firmware_protocol.errors import (
    AddressError,
    BrickNotFound,
    LinkBusy,
    LinkLost,
    NXTError,
    PermissionDenied,
    system_words,
)
from nxtdrive.host.access import device_remedy
from nxtdrive.transports.address import Address
from nxtdrive.transports.stream import SEND_TIMEOUT_S, StreamTransport


class SerialTransport(StreamTransport):
    """``serial:///dev/rfcomm0``, ``serial://COM5``."""

    def __init__(self, address: str, port: serial.Serial) -> None:
        super().__init__(address)
        self._port = port

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Open the port for exclusive use.

        Raises:
            AddressError: The address names no port.
            BrickNotFound: There is no such port, or no brick answers behind it.
            LinkBusy: Another program has it open.
            PermissionDenied: This user may not open it.
        """
        address.read_options({})
        if not address.target:
            raise AddressError(f"{address} names no port.", remedy="Write serial:///dev/rfcomm0 or serial://COM5.")
        try:
            port = serial.Serial(address.target, timeout=timeout_s, write_timeout=SEND_TIMEOUT_S, exclusive=True)
        except (OSError, ValueError) as error:
            raise _cannot_open(address.target, error) from error
        return cls(str(address), port)

    def _read(self, timeout_s: float) -> bytes:
        try:
            self._port.timeout = timeout_s
            return bytes(self._port.read(self._port.in_waiting or 1))
        except (OSError, serial.SerialException, TypeError) as error:
            # pyserial raises TypeError when another thread closes the port during a read
            raise self._lost(error) from error

    def _read_arrived(self) -> bytes:
        try:
            arrived = self._port.in_waiting
        except (OSError, TypeError) as error:
            raise self._lost(error) from error
        return self._read(0.0) if arrived else b""

    def _write(self, data: bytes) -> None:
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            # part of this telegram may have been sent; the next one would be read as its rest
            with contextlib.suppress(Exception):  # of a port that is gone, POSIX raises termios.error, no OSError
                self._port.reset_output_buffer()  # closing waits until it is sent
            self.close()
            raise LinkLost(f"{self.address} accepts no more telegrams.", remedy="Is the brick still on?") from None
        except (OSError, serial.SerialException, TypeError) as error:
            raise self._lost(error) from error

    def _close(self) -> None:
        with contextlib.suppress(OSError):
            self._port.close()

    def _lost(self, error: Exception) -> LinkLost:
        reason = system_words(error) if isinstance(error, OSError) else error
        return LinkLost(f"the link through {self.address} is lost: {reason}.", remedy="Is the brick on and in range?")


def _cannot_open(device: str, error: Exception) -> NXTError:
    # On Windows pyserial packs the reason into the text, in the user's language, and leaves errno empty.
    number, text = getattr(error, "errno", None), str(error)
    if number in (errno.EAGAIN, errno.EBUSY, errno.EWOULDBLOCK) or "PermissionError" in text:
        return LinkBusy(
            f"{device} is in use.",
            remedy="Close the other program that has it open: another nxtdrive, a terminal, ModemManager.",
        )
    if number in (errno.EACCES, errno.EPERM):
        return PermissionDenied(f"this user may not open {device}.", remedy=device_remedy(device, "dialout"))
    if number == errno.ENOENT or "FileNotFoundError" in text:
        return BrickNotFound(
            f"there is no serial port {device}.",
            remedy="Pair the brick first (PIN 1234); Linux then needs `sudo rfcomm bind 0 ADDRESS`. "
            "`nxtdrive list` shows addresses and ports.",
        )
    return BrickNotFound(
        f"no brick answers at {device}: {error}.", remedy="Is it on and paired, and the port's name right?"
    )
