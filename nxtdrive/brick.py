"""The brick: typed questions and answers over any transport, and whatever hangs on its ports."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from dataclasses import dataclass
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self, TypeVar

from firmware_protocol.dialogue import Dialogue
from firmware_protocol.direct import (
    GetBatteryLevel,
    KeepAlive,
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
from firmware_protocol.telegram import Command, Reply
from nxtdrive.heartbeat import Heartbeat
from nxtdrive.outputs import braked, coasting
from nxtdrive.ports import MotorPort, SensorPort, in_range
from nxtdrive.transports import open_transport, reopen_transport

if TYPE_CHECKING:
    from nxtdrive.motor import Motor
    from nxtdrive.rover import Rover
    from nxtdrive.sensors import Touch, Ultrasonic
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)

AWAKE = "awake"
LONGEST_SILENCE_S = 60.0
"""A brick that is set never to sleep, or late, is told to stay awake this often."""
PULSE_S = 0.1
"""How often the background thread looks whether something is due."""
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


def open_brick(address: str | Address | None = None, *, timeout_s: float = 1.0) -> Brick:
    """Open a brick and make sure that it answers.

    Args:
        address: ``usb://``, ``bt://00:16:53:0A:1B:2C``, ``serial://COM5``, ``tcp://host:port``, ``sim://``, ...
            Without one, ``$NXT`` counts, and without that the first brick on USB.
        timeout_s: How long the brick may take for an answer, here and in every later request.

    Raises:
        AddressError: Nobody can open this address; the message lists what can be opened.
        BrickNotFound: No brick there.
        LinkError: A brick, but no way to it: busy, not permitted, silent.
    """
    brick = Brick(open_transport(address, timeout_s=timeout_s), timeout_s=timeout_s)
    try:
        brick.keep_alive()
    except BaseException:
        brick.close()
        raise
    return brick


class Brick:
    """A brick behind an open transport. May be used from several threads.

    As a context manager it stops, on leaving, the motors that were used, however the block ends, and closes the link.

    Attributes:
        transport: The way to it.
        timeout_s: How long an answer may take when the request does not say.
        max_telegram: Longest telegram of this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
    """

    def __init__(self, transport: Transport, *, timeout_s: float = 1.0) -> None:
        self.timeout_s = timeout_s
        self._lock = threading.Lock()
        self._dialogue = Dialogue()
        self._use(transport)
        self._heartbeat = Heartbeat()
        self._moved: set[OutputPort] = set()
        self._gone = threading.Event()
        self._pulse: threading.Thread | None = None
        self._live()

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Ask, and wait for the answer.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost, closed, or (LinkTimeout) no answer in time.
            RemoteProtocolError: The answer is not what this command is answered with.
            BrickError: The brick refused; see its `status`.
        """
        dialogue, receive = self._dialogue, self._receive
        if timeout_s is None:
            timeout_s = self.timeout_s
        with self._lock:
            now = self.now()
            if now >= self._heartbeat.due:
                self._beat(now)
            self._send(dialogue.open(command, now, timeout_s))
            while True:
                telegram = receive(timeout_s)
                if telegram is not None:
                    reply = dialogue.feed(telegram)
                    if reply is not None:
                        return reply  # type: ignore[return-value]
                now = self.now()
                if held_back := dialogue.follow_up(now):
                    self._send(held_back)
                timeout_s = dialogue.deadline - now
                if timeout_s <= 0:
                    raise dialogue.expire()

    def send(self, command: Command[Any]) -> None:
        """Tell, without asking for an answer; whether the brick obeys is not known.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost or closed.
        """
        telegram = command.encode(want_reply=False)
        with self._lock:
            self._send(telegram)
            now = self.now()
            if now >= self._heartbeat.due:
                self._beat(now)

    def sleep(self, duration_s: float) -> None:
        """Let time pass on the link's clock, and keep brick and motors going meanwhile."""
        end = self.now() + duration_s
        while (left := end - self.now()) > RESOLUTION_S:
            self.transport.sleep(min(left, max(RESOLUTION_S, self._heartbeat.due - self.now())))
            with self._lock:
                self._beat(self.now())

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off, now and, as long as it is open, from now on."""
        sleep_ms = self.request(KeepAlive()).sleep_ms
        interval_s = min(LONGEST_SILENCE_S, sleep_ms / 3000) if sleep_ms else LONGEST_SILENCE_S
        self.repeat(AWAKE, KeepAlive(), interval_s)

    def repeat(self, name: str, command: Command[Any], interval_s: float) -> None:
        """Send `command`, without asking for an answer, every `interval_s` from now on; see `forget`."""
        telegram = command.encode(want_reply=False)
        with self._lock:
            self._heartbeat.repeat(name, telegram, interval_s, self.now())

    def reconnect(self) -> None:
        """Open the link again after it was lost: same address, same brick. Motors that ran have stopped by themselves.

        Raises:
            BrickNotFound: It is not back yet.
            LinkError: It is back, but does not let us in.
        """
        with self._lock:
            self._use(reopen_transport(self.transport, timeout_s=self.timeout_s))
            self._dialogue.reset()
            self._heartbeat.clear()
        self._live()
        self.keep_alive()

    def forget(self, name: str) -> None:
        """End what `repeat` began under `name`."""
        with self._lock:
            self._heartbeat.forget(name)

    def moves(self, port: OutputPort) -> None:
        """Remember to stop this motor in the end."""
        self._moved.add(port)

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

    def motor(self, port: MotorPort, *, reversed: bool = False) -> Motor:
        """The motor on port "A", "B" or "C"; `reversed` if it is built in the other way round."""
        from nxtdrive.motor import Motor

        return Motor(self, port, reversed=reversed)

    def touch(self, port: SensorPort) -> Touch:
        """The touch sensor on port 1..4."""
        from nxtdrive.sensors import Touch

        return Touch(self, port)

    def ultrasonic(self, port: SensorPort) -> Ultrasonic:
        """The ultrasonic sensor on port 1..4."""
        from nxtdrive.sensors import Ultrasonic

        return Ultrasonic(self, port)

    def rover(self, **parts: Any) -> Rover:  # noqa: ANN401 - the arguments are Rover's
        """This brick as a vehicle; the arguments are those of `nxtdrive.rover.Rover`."""
        from nxtdrive.rover import Rover

        return Rover(self, **parts)

    def stop_motors(self) -> None:
        """Brake the motors that were used, then switch them off, so that none stays under power."""
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
        try:
            with contextlib.suppress(LinkError):
                self.stop_motors()
        finally:
            self._gone.set()
            if self._pulse is not None:
                self._pulse.join()
            self.transport.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _use(self, transport: Transport) -> None:
        self.transport = transport
        self.max_telegram = transport.max_telegram
        # Looked up once: `request` is called hundreds of times a second.
        self.now, self._send, self._receive = transport.now, transport.send, transport.receive

    def _tell(self, rest: Callable[[OutputPort], SetOutputState], ports: list[OutputPort]) -> None:
        for port in ports:
            self.send(rest(port))

    def _beat(self, now: float) -> None:
        """Send what is due; the caller holds the lock."""
        for telegram in self._heartbeat.take(now):
            self._send(telegram)

    def _live(self) -> None:
        """See to the background thread, where time passes by itself."""
        if not self.transport.simulated and not (self._pulse and self._pulse.is_alive()):
            self._pulse = threading.Thread(target=self._beat_on, name="nxtdrive heartbeat", daemon=True)
            self._pulse.start()

    def _beat_on(self) -> None:
        """What the background thread does: a program that waits for its user still owns a living brick."""
        while not self._gone.wait(PULSE_S):
            try:
                with self._lock:
                    self._beat(self.now())
            except LinkError:
                return  # the program's next request meets the same error, and there somebody can act on it
