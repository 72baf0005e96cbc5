"""Sensors with registers, on the I2C bus.

A register is read in one round trip: the telegram that starts the transaction requests no reply, and the bus is done
when the one that fetches the bytes arrives. Errors of the first show in the reply to the second.
"""

from __future__ import annotations

from firmware_protocol.direct import LSGetStatus, LSRead, LSWrite
from firmware_protocol.enums import SensorType
from firmware_protocol.errors import BrickError, CommunicationPending, SensorTimeout
from firmware_protocol.status import Status
from nxtdrive.link.link import Link
from nxtdrive.ports import SensorPort, in_range, whole_number
from nxtdrive.sensors.port import STEP_S, Sensor

ADDRESS = 0x02
"""8-bit write address of LEGO's own sensors and most others."""
I2C_RECEIVE_LIMIT = 15
"""A 16th received byte makes the firmware lose all of them. Source: docs/firmware.md section 1, fact 10."""
I2C_ATTEMPTS = 3
"""Transactions are repeated by the driver, as the firmware's own retries send wrong bytes (fact 11)."""
I2C_TIMEOUT_S = 0.15
"""The longest transaction takes 32 ms, and the firmware aborts one after 100 ms. Source: docs/firmware.md section 7.

A transaction has failed if a request sent after this time brings no data; over a slow link even the first reply may
arrive later."""

_START_MS, _SENT_BYTE_MS, _RESTART_MS, _RECEIVED_BYTE_MS = 3.1, 0.94, 1.1, 0.86
"""Linear fit to the times in docs/firmware.md section 7."""


def bus_time_s(sent: int, received: int) -> float:
    """Estimate the duration of a transaction of `sent` and `received` bytes, to about a millisecond."""
    answer_ms = _RESTART_MS + _RECEIVED_BYTE_MS * received if received else 0.0
    return (_START_MS + _SENT_BYTE_MS * sent + answer_ms) / 1000


class I2CSensor(Sensor):
    """A digital sensor with registers.

    Attributes:
        address: The sensor's 8-bit write address.
    """

    type = SensorType.LOW_SPEED_9V
    address = ADDRESS

    def __init__(self, link: Link, port: SensorPort, address: int | None = None) -> None:
        super().__init__(link, port)
        if address is not None:
            self.address = whole_number("address", address, 0x02, 0xFF) & ~1
        self._dirty = True

    def read(self, register: int, size: int) -> bytes:
        """Read `size` bytes (1..15) from `register` on.

        Raises:
            BrickError: The sensor does not answer, even after repetitions.
            SensorTimeout: The bus hangs.
            LocalProtocolError: `register` or `size` is out of range; nothing was sent.
        """
        in_range("size", size, 1, I2C_RECEIVE_LIMIT)
        return self._transact(bytes((self.address, _byte("register", register))), size)

    def write(self, register: int, *values: int) -> None:
        """Write bytes, 0..255, starting at `register`; errors as for `read`."""
        written = [_byte("values", value) for value in values]
        self._transact(bytes((self.address, _byte("register", register), *written)), 0)

    def start_read(self, register: int) -> None:
        """Start reading one byte without waiting; `fetch` returns it."""
        if not self._ready:
            self.set_up()
        if self._dirty:
            self._drain()
        self.link.send(LSWrite.transaction(self._input, bytes((self.address, register)), 1))
        self._dirty = True

    def fetch(self) -> int | None:
        """Return the byte of `start_read`, or None while the bus is busy.

        Raises:
            BrickError: The sensor did not answer; start again.
        """
        try:
            data = self.link.request(LSRead(self._input)).received
        except BrickError as error:
            self._note_port_reset(error)
            raise
        if not data:
            return None
        self._dirty = False
        return data[-1]

    def _transact(self, data: bytes, size: int) -> bytes:
        for _ in range(I2C_ATTEMPTS - 1):
            try:
                return self._attempt(data, size)
            except BrickError as error:
                if error.status not in (Status.BUS_ERROR, Status.CHANNEL_NOT_CONFIGURED):
                    raise
                self._note_port_reset(error)
            except _Unanswered:
                pass
            self.link.sleep(STEP_S)
        return self._attempt(data, size)

    def _note_port_reset(self, error: BrickError) -> None:
        """Have a port set up again that was reset: a program was started or stopped, or the brick switched off."""
        if error.status is Status.CHANNEL_NOT_CONFIGURED:
            self._ready = False

    def _attempt(self, data: bytes, size: int) -> bytes:
        if not self._ready:
            self.set_up()
        if self._dirty:
            self._drain()
        self._dirty = True
        command = LSWrite.transaction(self._input, data, size)
        if size:
            self.link.send(command)
            self.link.sleep(bus_time_s(len(data), size))
            received = self._collect(size)
        else:
            self.link.request(command)
            self._wait_until_idle()
            received = b""
        self._dirty = False
        return received

    def _collect(self, size: int) -> bytes:
        """Fetch the bytes of a transaction; one whose start was lost on the link has none."""
        link = self.link
        deadline = link.now() + I2C_TIMEOUT_S
        received = b""
        while True:
            sent_s = link.now()
            received += link.request(LSRead(self._input)).received
            if len(received) >= size:
                return received
            if sent_s >= deadline:
                raise _Unanswered(f"the sensor on port {self.port} does not answer.", remedy="Plug it in again.")
            link.sleep(sent_s + STEP_S - link.now())

    def _wait_until_idle(self) -> int:
        """Wait until the bus is idle; return the number of unread bytes."""
        link = self.link
        deadline = link.now() + I2C_TIMEOUT_S
        while True:
            sent_s = link.now()
            try:
                return link.request(LSGetStatus(self._input)).bytes_ready
            except CommunicationPending:
                if sent_s >= deadline:
                    raise SensorTimeout(
                        f"the I2C bus of port {self.port} hangs.", remedy="Plug the sensor in again."
                    ) from None
                link.sleep(sent_s + STEP_S - link.now())

    def _drain(self) -> None:
        """Drop unread bytes of an earlier transaction, which would come first (docs/firmware.md section 1, fact 10)."""
        try:
            if self._wait_until_idle():
                self.link.request(LSRead(self._input))
        except BrickError as error:
            self._note_port_reset(error)
            if error.status is not Status.BUS_ERROR:
                raise


def _byte(name: str, value: int) -> int:
    return whole_number(name, value, 0, 0xFF)


class _Unanswered(SensorTimeout):
    """A transaction was lost on the link; it may be repeated."""
