"""The owner of the wire: questions and answers over a transport, from any thread, and what keeps them going.

One request is on the wire at a time. Commands that drive motors overtake questions that wait. What is due again and
again (`Heartbeat`) goes out between requests. A link that is lost can be opened again, by itself if that is wished.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from statistics import median
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.dialogue import Dialogue
from firmware_protocol.direct import (
    GetBatteryLevel,
    GetCurrentProgramName,
    GetInputValues,
    GetOutputState,
    GetProperty,
    KeepAlive,
    ResetMotorPosition,
    SetInputMode,
    SetOutputState,
    UpdateResetCount,
)
from firmware_protocol.errors import BrickNotFound, LinkError, LinkLost
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.system import GetBluetoothAddress, GetDeviceInfo, GetVersions, IOMapRead, IOMapWrite
from firmware_protocol.telegram import Command, Reply
from nxtdrive.heartbeat import Heartbeat
from nxtdrive.transports import reopen_transport
from nxtdrive.turns import Turns

if TYPE_CHECKING:
    from firmware_protocol.enums import InputPort
    from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)

AWAKE = "awake"
LONGEST_SILENCE_S = 60.0
"""A brick that is set never to sleep, or late, is told to stay awake this often."""
PULSE_S = 0.1
"""How often the background thread looks whether something is due."""
RESOLUTION_S = 0.0005
"""Sleeping is exact to half a step of the simulator; sums of binary fractions are not exact either."""

URGENT = (SetOutputState, IOMapWrite, ResetMotorPosition, UpdateResetCount)
"""Commands that drive motors; they overtake others that wait for the wire."""

QUESTIONS = (
    GetOutputState,
    GetInputValues,
    GetBatteryLevel,
    GetCurrentProgramName,
    GetProperty,
    GetVersions,
    GetDeviceInfo,
    GetBluetoothAddress,
    IOMapRead,
    KeepAlive,
    SetInputMode,
)
"""Commands that may be asked again after a loss, as asking twice is like asking once."""

CABLE_ANSWER_S = 1.0
"""How long an answer may take over USB, where 2 ms are usual."""
RADIO_ANSWER_S = 2.0
"""Over Bluetooth, which loses nothing but falters. Source: the RWTH toolbox (docs/connecting.md)."""

LATENCY_EVERY_S = 0.05
"""How often a round trip is measured; measuring each would cost every request."""
LATENCIES = 15
"""Round trips of which the median is taken."""

FIRST_PAUSE_S = 0.1
LONGEST_PAUSE_S = 2.0
"""Between attempts to open a lost link again the pause doubles, from the first to the longest."""
PATIENCE_S = 30.0
"""After so long a lost link is given up; a brick that was switched off and on answers over USB within 10 s."""


class Link:
    """A conversation over a transport. May be used from several threads.

    Attributes:
        transport: The way to the brick.
        timeout_s: How long an answer may take when the request does not say.
        reconnecting: Whether a lost link is opened again by itself; see `request`.
        max_telegram: Longest telegram of this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
    """

    def __init__(self, transport: Transport, *, timeout_s: float | None = None, reconnecting: bool = False) -> None:
        self.timeout_s = answer_s(transport) if timeout_s is None else timeout_s
        self.reconnecting = reconnecting
        self._turns = Turns()
        self._wire, self._queue, self._busy = self._turns.wire, self._turns.queue, self._turns.wire.locked
        self._dialogue = Dialogue()
        self._use(transport)
        self._heartbeat = Heartbeat()
        self._attention = -math.inf
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._modes: dict[InputPort, SetInputMode] = {}
        self._driven = self._returning = self._measuring = False
        self._comeback = threading.RLock()
        self._gone = threading.Event()
        self._pulse: threading.Thread | None = None
        self._live()

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Ask, and wait for the answer.

        Ends within `timeout_s`, or twice that after a request that was not answered. If the link is lost while
        `reconnecting`, it is opened again first. Then a mere question is asked again, unless motors were driven since
        the last loss: those have stopped meanwhile, and only the caller can decide whether to go on.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost, closed, or (LinkTimeout) no answer in time.
            RemoteProtocolError: The answer is not what this command is answered with.
            BrickError: The brick refused; see its `status`.
        """
        if timeout_s is None:
            timeout_s = self.timeout_s
        try:
            now = self.now()
            if now >= self._attention:
                now = self._attend(now)
            if self._queue or self._busy():
                self._turns.wait(isinstance(command, URGENT), timeout_s)
                now = self.now()
            with self._wire:
                self._send(self._dialogue.open(command, now, timeout_s))
                telegram = self._receive(timeout_s)
                reply = None if telegram is None else self._dialogue.feed(telegram)
                if reply is None:
                    reply = self._await()
                if self._measuring:
                    self._measure(now)
                return reply  # type: ignore[return-value]
        except LinkLost as error:
            lost = error
        finally:
            if self._queue:
                self._turns.leave()
        driven, mere_question = self._come_back(lost), isinstance(command, QUESTIONS)
        if driven or not mere_question:
            raise _not_repeated(command) from lost
        return self.request(command, timeout_s)

    def send(self, command: Command[Any]) -> None:
        """Tell, without asking for an answer; whether the brick obeys is not known.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost or closed.
        """
        telegram = command.encode(want_reply=False)
        try:
            if self._queue or self._busy():
                self._turns.wait(isinstance(command, URGENT), self.timeout_s)
            with self._wire:
                self._send(telegram)
                now = self.now()
                if now >= self._heartbeat.due:
                    self._beat(now)
            return
        except LinkLost as error:
            lost = error
        finally:
            if self._queue:
                self._turns.leave()
        self._come_back(lost)
        raise _not_repeated(command) from lost

    def sleep(self, duration_s: float) -> None:
        """Let time pass on the link's clock, and keep brick and motors going meanwhile."""
        end = self.now() + duration_s
        while (left := end - self.now()) > RESOLUTION_S:
            self.transport.sleep(min(left, max(RESOLUTION_S, self._heartbeat.due - self.now())))
            try:
                with self._turns.aside():
                    self._beat(self.now())
            except LinkLost as error:
                if self._come_back(error):
                    raise _not_repeated() from error

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off, now and, as long as it is open, from now on."""
        sleep_ms = self.request(KeepAlive()).sleep_ms
        interval_s = min(LONGEST_SILENCE_S, sleep_ms / 3000) if sleep_ms else LONGEST_SILENCE_S
        self.repeat(AWAKE, KeepAlive(), interval_s)

    def repeat(self, name: str, command: Command[Any], interval_s: float) -> None:
        """Send `command`, without asking for an answer, every `interval_s` from now on; see `forget`."""
        self._heartbeat.repeat(name, command.encode(want_reply=False), interval_s, self.now())
        self._attention = -math.inf

    def send_at(self, name: str, command: Command[Any], time_s: float) -> None:
        """Send `command` once, at that time on the link's clock, even amid a request; see `forget`.

        On real links this is so for requests made from now on.
        """
        self._heartbeat.once(name, command.encode(want_reply=False), time_s)
        self._attention = -math.inf

    def forget(self, name: str) -> None:
        """End what `repeat` or `send_at` began under `name`."""
        self._heartbeat.forget(name)

    def remember(self, mode: SetInputMode) -> None:
        """Set an input port to this mode again after a reconnection, should it have lost it."""
        self._modes[mode.port] = mode

    def forget_input_modes(self) -> None:
        """Set no input port again after a reconnection: a program on the brick does with them what it wants."""
        self._modes.clear()

    @property
    def latency_s(self) -> float:
        """How long an answer takes: the median of the last round trips that were measured."""
        if not self._latencies:
            self.request(KeepAlive())
        return median(self._latencies)

    def reconnect(self) -> None:
        """Open the link again after it was lost: same address, same brick, input ports in the same modes.

        Motors that ran have stopped by themselves, and are not started again.

        Raises:
            BrickNotFound: It is not back yet.
            LinkError: It is back, but does not let us in.
        """
        with self._turns.aside():
            self._use(reopen_transport(self.transport, timeout_s=self.timeout_s))
            self._dialogue.reset()
            self._heartbeat.clear()
        self._live()
        self.keep_alive()
        for port, mode in self._modes.items():
            values = self.request(GetInputValues(port))
            if (values.type, values.mode) != (mode.type, mode.mode):
                self.request(mode)

    def attend_by(self, due: float) -> None:
        """Call `_attend` before the first request from that time on, if not earlier."""
        self._attention = min(self._attention, due)

    def _attend(self, now: float) -> float:
        """See to what is due before a request; returns the time afterwards."""
        with self._turns.aside():
            self._beat(now)
        self._attention = -math.inf if self._heartbeat.punctual else min(self._heartbeat.due, now + LATENCY_EVERY_S)
        self._measuring = True
        return self.now()

    def _measure(self, asked: float) -> None:
        """Note how long the answer to a question took that was asked then."""
        self._latencies.append(self.now() - asked)
        self._measuring = False

    def _await(self) -> Reply:
        """Wait for the answer to the open request."""
        dialogue = self._dialogue
        while True:
            now = self.now()
            if now >= self._heartbeat.due:
                self._beat(now)
            if held_back := dialogue.follow_up(now):
                self._send(held_back)
            left = dialogue.deadline - now
            if left <= 0:
                raise dialogue.expire()
            telegram = self._receive(min(left, self._heartbeat.due - now))
            if telegram is not None and (reply := dialogue.feed(telegram)) is not None:
                return reply

    def _come_back(self, lost: LinkLost) -> bool:
        """Open the lost link again, as often as it takes.

        Returns:
            Whether motors were driven since the last loss.

        Raises:
            LinkLost: This is not wished, or has been given up.
        """
        transport = self.transport
        with self._comeback:
            if not self.reconnecting or self._returning or self._gone.is_set():
                raise lost
            if self.transport is transport:
                self._returning = True
                try:
                    self._try_to_return(lost)
                finally:
                    self._returning = False
            driven, self._driven = self._driven, False
            return driven

    def _try_to_return(self, lost: LinkLost) -> None:
        pause_s, deadline = FIRST_PAUSE_S, self.now() + PATIENCE_S
        while self.now() < deadline and not self._gone.is_set():
            self.transport.sleep(pause_s)
            pause_s = min(2 * pause_s, LONGEST_PAUSE_S)
            try:
                return self.reconnect()
            except (BrickNotFound, LinkError):
                continue
        raise LinkLost(f"the brick did not come back within {PATIENCE_S:g} s.", remedy="Is it on?") from lost

    def _use(self, transport: Transport) -> None:
        self.transport = transport
        self.max_telegram = transport.max_telegram
        # Looked up once: `request` is called hundreds of times a second.
        self.now, self._send, self._receive = transport.now, transport.send, transport.receive

    def _beat(self, now: float) -> None:
        """Send what is due; the caller holds the wire."""
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
                with self._turns.aside():
                    self._beat(self.now())
            except LinkError:
                return  # the program's next request meets the same error, and there somebody can act on it


def answer_s(transport: Transport) -> float:
    """How long an answer may take on such a link when nobody has said; Bluetooth is told by its longer telegrams."""
    return CABLE_ANSWER_S if transport.max_telegram <= USB_TELEGRAM_LIMIT else RADIO_ANSWER_S


def _not_repeated(command: Command[Any] | None = None) -> LinkLost:
    what = "a motion was under way" if command is None else f"{type(command).__name__} was not repeated"
    return LinkLost(f"the link was lost and is back, but {what}.", remedy="Motors have stopped; start them again.")
