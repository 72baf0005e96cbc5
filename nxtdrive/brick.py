"""The brick: typed questions and answers over any transport, and whatever hangs on its ports."""

from __future__ import annotations

import contextlib
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from firmware_protocol.direct import (
    GetBatteryLevel,
    MessageRead,
    MessageWrite,
    PlaySoundFile,
    PlayTone,
    SetOutputState,
    StopSoundPlayback,
)
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from firmware_protocol.system import GetDeviceInfo, GetVersions
from nxtdrive.link.link import CLOSING_S, Link
from nxtdrive.motion.outputs import braked, coasting
from nxtdrive.motion.scheduler import MotionScheduler
from nxtdrive.ports import MotorPort, SensorPort, in_range
from nxtdrive.termination import TerminationAsExit
from nxtdrive.transports import open_transport

if TYPE_CHECKING:
    from nxtdrive.files import Files
    from nxtdrive.motion.motor import Motor, MotorSettings
    from nxtdrive.motion.rover import Rover
    from nxtdrive.sensors import ColorSensor, Compass, I2CSensor, Light, Sound, Temperature, Touch, Ultrasonic
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.base import Transport

RESOLUTION_S = 0.0005
"""Sleeping is exact to half a step of the simulator; sums of binary fractions are not exact either."""
BRAKING_S = 0.15
"""How long motors are braked before they are switched off when the program leaves."""
TONE_HZ = (220, 14080)
"""What the firmware can play. Source: docs/firmware.md section 4, 0x03."""
MAILBOXES = 10
"""Mailboxes each way, outgoing ones behind incoming ones. Source: docs/firmware.md section 4, 0x13."""


@dataclass(frozen=True, slots=True)
class BrickInfo:
    """Who the brick is and how it feels.

    Attributes:
        name: As shown on its display.
        bluetooth_address: Six bytes in hex with colons; without them it is the id in ``usb://``.
        firmware: Such as ``1.29``.
        protocol: Such as ``1.124``.
        free_flash: Bytes free for files; the firmware refreshes it only now and then.
        battery_mv: Battery voltage, millivolts.
    """

    name: str
    bluetooth_address: str
    firmware: str
    protocol: str
    free_flash: int
    battery_mv: int


def open_brick(
    address: str | Address | None = None, *, timeout_s: float | None = None, reconnect: bool = False
) -> Brick:
    """Open a brick and make sure that it answers.

    Args:
        address: ``usb://``, ``bt://00:16:53:0A:1B:2C``, ``serial://COM5``, ``tcp://host:port``, ``sim://``, ...
            Without one, ``$NXT`` counts, and without that the first brick on USB.
        timeout_s: How long the brick may take for an answer, here and in every later request. Without it, 1 s over
            USB and 2 s over whatever Bluetooth may be behind.
        reconnect: Whether a link that is lost later is opened again by itself; see `Link.reconnecting`.

    Raises:
        AddressError: Nobody can open this address; the message lists what can be opened.
        BrickNotFound: No brick there.
        LinkError: A brick, but no way to it: busy, not permitted, silent.
    """
    transport = open_transport(address) if timeout_s is None else open_transport(address, timeout_s=timeout_s)
    brick = Brick(transport, timeout_s=timeout_s, reconnecting=reconnect)
    try:
        brick.keep_alive()
    except BaseException:
        brick.close()
        raise
    return brick


class Brick(Link):
    """A brick behind an open transport. May be used from several threads.

    As a context manager it stops, on leaving, the motors that were used, and closes the link, however the block ends:
    SIGTERM and SIGHUP, unless the program has plans for them, end the block as an exception does.

    Attributes:
        transport: The way to it.
        motions: Those under way.
        timeout_s: How long an answer may take when the request does not say.
        max_telegram: Longest telegram of this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
        patience_s: How long a request waits for a lost link; see `Link`.
    """

    def __init__(self, transport: Transport, *, timeout_s: float | None = None, reconnecting: bool = False) -> None:
        super().__init__(transport, timeout_s=timeout_s, reconnecting=reconnecting)
        self._moved: set[OutputPort] = set()
        self._files: Files | None = None
        self._inline = transport.simulated
        self.motions = MotionScheduler(self)
        self._termination = TerminationAsExit()

    def sleep(self, duration_s: float) -> None:
        """See `Link.sleep`; in the simulator, motions go on meanwhile, and any wait takes a step of its clock."""
        if not self._inline:
            return super().sleep(duration_s)
        end = self.now() + (max(duration_s, 2 * RESOLUTION_S) if duration_s > 0 else 0.0)
        self.motions.run_due()
        while (left := end - self.now()) > RESOLUTION_S:
            super().sleep(min(left, max(2 * RESOLUTION_S, self.motions.due - self.now())))
            if end - self.now() > RESOLUTION_S:
                self.motions.run_due()
        return None

    def moves(self, port: OutputPort) -> None:
        """Remember that this motor is driven, and to stop it in the end."""
        self._moved.add(port)
        self._driven = True

    def info(self) -> BrickInfo:
        """Name, addresses, versions and state, in three questions."""
        device, versions = self.request(GetDeviceInfo()), self.request(GetVersions())
        address = ":".join(f"{byte:02X}" for byte in device.address[:6])
        return BrickInfo(
            name=device.name,
            bluetooth_address=address,
            firmware=versions.firmware,
            protocol=versions.protocol,
            free_flash=device.free_flash,
            battery_mv=self.battery_mv,
        )

    @property
    def battery_mv(self) -> int:
        """Battery voltage, millivolts."""
        return self.request(GetBatteryLevel()).voltage_mv

    @property
    def battery_v(self) -> float:
        """Battery voltage, volts."""
        return self.battery_mv / 1000

    def tone(self, frequency_hz: int, duration_ms: int) -> None:
        """Play a tone, 220..14080 Hz, 10..65535 ms; returns while it sounds."""
        in_range("frequency_hz", frequency_hz, *TONE_HZ)
        in_range("duration_ms", duration_ms, 10, 0xFFFF)
        self.request(PlayTone(frequency_hz, duration_ms))

    def play_sound_file(self, name: str, *, loop: bool = False) -> None:
        """Play a sound file that is on the brick, such as ``Hello.rso``."""
        self.request(PlaySoundFile(loop, name))

    def stop_sound(self) -> None:
        """Be quiet."""
        self.request(StopSoundPlayback())

    @property
    def files(self) -> Files:
        """The files on the brick."""
        if self._files is None:
            from nxtdrive.files import Files

            self._files = Files(self)
        return self._files

    @property
    def program(self) -> str | None:
        """Name of the program that runs on the brick; None if none runs."""
        from nxtdrive.programs import running_program

        return running_program(self)

    def start_program(self, name: str) -> None:
        """Start a program that is on the brick; see `nxtdrive.programs.start_program`."""
        from nxtdrive.programs import start_program

        start_program(self, name)

    def stop_program(self) -> bool:
        """Stop the program that runs; see `nxtdrive.programs.stop_program`."""
        from nxtdrive.programs import stop_program

        return stop_program(self)

    def message_write(self, box: int, message: str) -> None:
        """Put a message of at most 58 characters into mailbox 1..10 of the program that runs on the brick."""
        in_range("box", box, 1, MAILBOXES)
        self.request(MessageWrite.text(box - 1, message))

    def message_read(self, box: int, *, remove: bool = True) -> str:
        """Take the next message that the running program has put into mailbox 1..10.

        Raises:
            MailboxEmpty: There is none.
        """
        in_range("box", box, 1, MAILBOXES)
        return self.request(MessageRead(MAILBOXES + box - 1, box - 1, remove)).text

    def motor(self, port: MotorPort, *, reversed: bool = False, settings: MotorSettings | None = None) -> Motor:
        """The motor on port "A", "B" or "C"; `reversed` if it is built in the other way round."""
        from nxtdrive.motion.motor import SETTINGS, Motor

        return Motor(self, port, reversed=reversed, settings=settings or SETTINGS)

    def touch(self, port: SensorPort) -> Touch:
        """The touch sensor on port 1..4."""
        from nxtdrive.sensors import Touch

        return Touch(self, port)

    def ultrasonic(self, port: SensorPort) -> Ultrasonic:
        """The ultrasonic sensor on port 1..4."""
        from nxtdrive.sensors import Ultrasonic

        return Ultrasonic(self, port)

    def light(self, port: SensorPort, *, lamp: bool = True) -> Light:
        """The light sensor on port 1..4, its lamp on or off."""
        from nxtdrive.sensors import Light

        return Light(self, port, lamp=lamp)

    def sound(self, port: SensorPort, *, dba: bool = False) -> Sound:
        """The sound sensor on port 1..4; with `dba`, only what the ear hears counts."""
        from nxtdrive.sensors import Sound

        return Sound(self, port, dba=dba)

    def color(self, port: SensorPort) -> ColorSensor:
        """The colour sensor on port 1..4."""
        from nxtdrive.sensors import ColorSensor

        return ColorSensor(self, port)

    def temperature(self, port: SensorPort) -> Temperature:
        """LEGO's digital temperature sensor on port 1..4."""
        from nxtdrive.sensors import Temperature

        return Temperature(self, port)

    def compass(self, port: SensorPort) -> Compass:
        """HiTechnic's compass on port 1..4."""
        from nxtdrive.sensors import Compass

        return Compass(self, port)

    def i2c(self, port: SensorPort, address: int = 0x02) -> I2CSensor:
        """Any digital sensor on port 1..4 by its registers; `address` is its 8-bit write address."""
        from nxtdrive.sensors import I2CSensor

        return I2CSensor(self, port, address)

    def rover(self, **parts: Any) -> Rover:  # noqa: ANN401 - the arguments are Rover's
        """This brick as a vehicle; the arguments are those of `nxtdrive.motion.rover.Rover`."""
        from nxtdrive.motion.rover import Rover

        return Rover(self, **parts)

    def stop_motors(self) -> None:
        """Brake the motors that were used, then switch them off, so that none stays under power."""
        self.motions.end_all()
        ports = sorted(self._moved)
        self._moved.clear()
        for port in ports:
            self.forget(port.name)
        if ports:
            try:
                self._tell(braked, ports)
                self.transport.sleep(BRAKING_S)
            finally:
                self._tell(coasting, ports)

    def close(self) -> None:
        """Stop what moves and close the link; may be called again, and does not fail when the link is gone."""
        if self._gone.is_set():
            return
        self._reconnecting = False
        try:
            with contextlib.suppress(LinkError):
                self.stop_motors()
        finally:
            self._gone.set()
            if self._pulse is not None:
                self._pulse.join(CLOSING_S)
            with self._turns.aside():
                self.transport.close()

    def __enter__(self) -> Self:
        self._termination.begin()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            self.close()
        finally:
            self._termination.end()

    def _unheard(self) -> bool:
        """See `Link._unheard`: the steps of motions have their own way of telling, `Move.join`."""
        return self.motions.stepping

    def _attend(self, now: float) -> float:
        """See `Link._attend`; in the simulator, motions that are due go on first."""
        if not self._inline:
            return super()._attend(now)
        self.motions.run_due()
        now = super()._attend(now)
        self.attend_by(self.motions.due)
        return now

    def _tell(self, rest: Callable[[OutputPort], SetOutputState], ports: list[OutputPort]) -> None:
        for port in ports:
            self.send(rest(port))
