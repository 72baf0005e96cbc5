"""Sensors: what is plugged into the input ports."""

from __future__ import annotations

from typing import TYPE_CHECKING

from firmware_protocol.direct import GetInputValues, InputValues, LSGetStatus, LSRead, LSWrite, SetInputMode
from firmware_protocol.enums import SensorMode, SensorType
from firmware_protocol.errors import BrickError, CommunicationPending, LinkTimeout
from firmware_protocol.status import Status
from nxtdrive.ports import SensorPort, in_range, input_port

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

SETTLING_S = 0.5
"""Longest a sensor's values stay invalid after its type was set: 400 ms. Source: docs/firmware.md section 6."""
STEP_S = 0.005
"""Between two looks at a value that is not there yet."""
I2C_RECEIVE_LIMIT = 15
"""A 16th received byte makes the firmware lose all of them. Source: docs/firmware.md section 1, fact 10."""
I2C_ATTEMPTS = 3
"""Transactions are repeated here: the firmware's own retries send wrong bytes (docs/firmware.md section 1, fact 11)."""
I2C_TIMEOUT_S = 0.15
"""The longest transaction takes 32 ms, a hanging one is given up by the firmware after 100 ms. Source: section 7."""


class Sensor:
    """An input port set to one type of sensor when it is first used.

    Attributes:
        brick: Where it is plugged in.
        port: 1..4, as printed on the brick.
    """

    type = SensorType.NONE
    mode = SensorMode.RAW

    def __init__(self, brick: Brick, port: SensorPort) -> None:
        self.brick = brick
        self.port = port
        self._input = input_port(port)
        self._ready = False

    def set_up(self) -> None:
        """Set the port's type and wait until its values are valid.

        Raises:
            LinkTimeout: They do not become valid.
        """
        brick = self.brick
        brick.request(SetInputMode(self._input, self.type, self.mode))
        deadline = brick.now() + SETTLING_S
        while not brick.request(GetInputValues(self._input)).valid:
            if brick.now() >= deadline:
                raise LinkTimeout(f"the sensor on port {self.port} gives no valid values.", remedy="Is it plugged in?")
            brick.sleep(STEP_S)
        self._ready = True

    def values(self) -> InputValues:
        """All the firmware knows of the port."""
        if not self._ready:
            self.set_up()
        values = self.brick.request(GetInputValues(self._input))
        if values.type is not self.type:  # a program was started or stopped: that resets all ports
            self.set_up()
            values = self.brick.request(GetInputValues(self._input))
        return values


class Touch(Sensor):
    """The touch sensor: a button."""

    type = SensorType.SWITCH
    mode = SensorMode.BOOLEAN

    @property
    def pressed(self) -> bool:
        """Whether the button is down."""
        return self.values().scaled == 1


class I2CSensor(Sensor):
    """A digital sensor with registers.

    Attributes:
        address: Its 8-bit write address.
    """

    type = SensorType.LOW_SPEED_9V
    address = 0x02

    def __init__(self, brick: Brick, port: SensorPort) -> None:
        super().__init__(brick, port)
        self._dirty = True

    def read(self, register: int, size: int) -> bytes:
        """`size` bytes (1..15) from `register` on.

        Raises:
            BrickError: The sensor does not answer, also when asked again.
            LinkTimeout: The bus hangs.
            LocalProtocolError: `size` is out of range; nothing was sent.
        """
        in_range("size", size, 1, I2C_RECEIVE_LIMIT)
        return self._transact(bytes((self.address, register)), size)

    def write(self, register: int, *values: int) -> None:
        """Write bytes from `register` on; errors as for `read`."""
        self._transact(bytes((self.address, register, *values)), 0)

    def ask(self, register: int) -> None:
        """Begin to read one byte, without waiting; `answer` fetches it."""
        if not self._ready:
            self.set_up()
        if self._dirty:
            self._drain()
        self.brick.send(LSWrite.transaction(self._input, bytes((self.address, register)), 1))
        self._dirty = True

    def answer(self) -> int | None:
        """What `ask` has brought, or None while the bus is still at work.

        Raises:
            BrickError: The sensor did not answer; `ask` again.
        """
        try:
            data = self.brick.request(LSRead(self._input)).received
        except BrickError as error:
            self._judge(error)
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
                self._judge(error)
            self.brick.sleep(STEP_S)
        return self._attempt(data, size)

    def _judge(self, error: BrickError) -> None:
        """A port that is not set up any more was reset by the start or end of a program; set it up again next time."""
        if error.status is Status.CHANNEL_NOT_CONFIGURED:
            self._ready = False

    def _attempt(self, data: bytes, size: int) -> bytes:
        if not self._ready:
            self.set_up()
        if self._dirty:
            self._drain()
        self._dirty = True
        self.brick.request(LSWrite.transaction(self._input, data, size))
        received = self._collect(size)
        self._dirty = False
        return received

    def _collect(self, size: int) -> bytes:
        """Wait for the end of a transaction that brings `size` bytes."""
        if not size:
            self._wait_for_rest()
            return b""
        deadline = self.brick.now() + I2C_TIMEOUT_S
        received = b""
        while len(received) < size:
            if self.brick.now() >= deadline:
                raise self._hanging()
            received += self.brick.request(LSRead(self._input)).received
            if not received:
                self.brick.sleep(STEP_S)
        return received

    def _wait_for_rest(self) -> int:
        """Wait until the bus is idle; returns the number of bytes that wait to be read."""
        deadline = self.brick.now() + I2C_TIMEOUT_S
        while True:
            try:
                return self.brick.request(LSGetStatus(self._input)).bytes_ready
            except CommunicationPending:
                if self.brick.now() >= deadline:
                    raise self._hanging() from None
                self.brick.sleep(STEP_S)

    def _drain(self) -> None:
        """Take what an earlier transaction left: unread bytes come first (docs/firmware.md section 1, fact 10)."""
        try:
            if self._wait_for_rest():
                self.brick.request(LSRead(self._input))
        except BrickError as error:
            if error.status is not Status.BUS_ERROR:
                raise

    def _hanging(self) -> LinkTimeout:
        return LinkTimeout(f"the I2C bus of port {self.port} hangs.", remedy="Plug the sensor in again.")


class Ultrasonic(I2CSensor):
    """The ultrasonic sensor, measuring all the time.

    Source of register numbers and "no echo": LEGO's Hardware Developer Kit, ultrasonic sensor I2C map.
    """

    _RANGE = 0x42
    _COMMAND = 0x41
    _CONTINUOUS = 0x02
    _NO_ECHO = 0xFF

    def set_up(self) -> None:
        """Set the port's type, then make the sensor measure, whatever another program had it do."""
        super().set_up()
        self.write(self._COMMAND, self._CONTINUOUS)

    @property
    def distance_mm(self) -> float | None:
        """Distance to the nearest echo in steps of 10 mm, up to 2550 mm; None without an echo."""
        return self._mm(self.read(self._RANGE, 1)[0])

    def start(self) -> None:
        """Begin a measurement without waiting for it; see `poll`."""
        self.ask(self._RANGE)

    def poll(self) -> tuple[bool, float | None]:
        """Whether the measurement begun by `start` is there, and its distance as of `distance_mm`."""
        centimetres = self.answer()
        return (False, None) if centimetres is None else (True, self._mm(centimetres))

    def _mm(self, centimetres: int) -> float | None:
        return None if centimetres == self._NO_ECHO else centimetres * 10.0
