"""The owner of the wire: questions and answers over a transport, from any thread, and what keeps them going.

One request is on the wire at a time. Commands that drive motors overtake questions that wait. What is due again and
again (`Heartbeat`) goes out between requests. A link that is lost can be opened again, by itself if that is wished.
"""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from statistics import median
from typing import TYPE_CHECKING, Any, TypeVar

from firmware_protocol.dialogue import Dialogue
from firmware_protocol.direct import GetInputValues, KeepAlive, SetInputMode
from firmware_protocol.errors import LinkError, LinkLost
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from firmware_protocol.telegram import Command, Reply
from nxtdrive.link.priority_lock import PREEMPTING, PriorityLock
from nxtdrive.link.reconnect import PATIENCE_S, PROBE_S, QUESTIONS, Interrupted, Reconnector, interrupted
from nxtdrive.link.timers import Heartbeat
from nxtdrive.transports import reopen_transport

if TYPE_CHECKING:
    from firmware_protocol.enums import InputPort
    from nxtdrive.transports.base import Transport

R = TypeVar("R", bound=Reply)

AWAKE, PROBE = "awake", "probe"
LONGEST_SILENCE_S = 60.0
"""A brick that is set never to sleep, or late, is told to stay awake this often."""
PULSE_S = 0.1
"""How often the background thread looks whether something is due."""
CLOSING_S = 2.0
"""So long closing waits for the background thread, which may be at an attempt to open a lost link again."""
RESOLUTION_S = 0.0005
"""Sleeping is exact to half a step of the simulator; sums of binary fractions are not exact either."""

CABLE_ANSWER_S = 1.0
"""How long an answer may take over USB, where 2 ms are usual."""
RADIO_ANSWER_S = 2.0
"""Over Bluetooth, which loses nothing but falters. Source: the RWTH toolbox (docs/connecting.md)."""

LATENCY_EVERY_S = 0.05
"""How often a round trip is measured; measuring each would cost every request."""
LATENCIES = 15
"""Round trips of which the median is taken."""


class Link:
    """A conversation over a transport. May be used from several threads.

    Attributes:
        transport: The way to the brick.
        timeout_s: How long an answer may take when the request does not say.
        max_telegram: Longest telegram of this link, bytes.
        now: The link's clock: seconds since an arbitrary start.
        patience_s: How long a request waits for a lost link that is being opened again; with 0 it fails at once, and
            the program itself finds out when the brick is back.
    """

    _send: Callable[[bytes], None]

    def __init__(self, transport: Transport, *, timeout_s: float | None = None, reconnecting: bool = False) -> None:
        self.timeout_s = answer_s(transport) if timeout_s is None else timeout_s
        self.patience_s = PATIENCE_S
        self._turns = PriorityLock()
        self._wire, self._queue, self._busy = self._turns.wire, self._turns.queue, self._turns.wire.locked
        self._dialogue = Dialogue()
        self._use(transport)
        self._heartbeat = Heartbeat()
        self._attention = -math.inf
        self._latencies: deque[float] = deque(maxlen=LATENCIES)
        self._modes: dict[InputPort, SetInputMode] = {}
        self._driven = self._measuring = False
        self._comeback = Reconnector(self.now, self.reconnect)
        self._gone = threading.Event()
        self._pulse: threading.Thread | None = None
        self.reconnecting = reconnecting

    def request(self, command: Command[R], timeout_s: float | None = None) -> R:
        """Ask, and wait for the answer.

        Ends within `timeout_s`, or twice that after a request that was not answered. If the link is lost while
        `reconnecting`, this waits until it is open again, `patience_s` at most. Then a mere question is asked again,
        unless motors were driven since the last loss: those have stopped meanwhile, and only the caller can decide
        whether to go on.

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
                self._turns.wait(isinstance(command, PREEMPTING), timeout_s)
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
        driven, mere_question = self._come_back(lost, self.patience_s), isinstance(command, QUESTIONS)
        if driven or not mere_question:
            raise interrupted(command) from lost
        return self.request(command, timeout_s)

    def send(self, command: Command[Any]) -> None:
        """Tell, without asking for an answer; whether the brick obeys is not known.

        If the link is lost meanwhile, this waits as `request` does; if that is known already, it fails at once.

        Raises:
            LocalProtocolError: The command does not fit its fields; nothing was sent.
            LinkError: Lost or closed.
        """
        telegram, known = command.encode(want_reply=False), self.lost
        try:
            if self._queue or self._busy():
                self._turns.wait(isinstance(command, PREEMPTING), self.timeout_s)
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
        self._come_back(lost, 0.0 if known else self.patience_s)
        raise interrupted(command) from lost

    def sleep(self, duration_s: float) -> None:
        """Let time pass on the link's clock, and keep brick and motors going meanwhile.

        A lost link is opened again meanwhile, if it comes back and that is wished; how long this lasts does not depend
        on it.

        Raises:
            LinkLost: The link was lost and is not to be opened again; or it is back, but motors were driven before.
        """
        end = self.now() + duration_s
        while (left := end - self.now()) > RESOLUTION_S:
            self.transport.sleep(min(left, self._pause_s()))
            self._tend()
            if self._send == self._interrupt:
                with self._turns.aside():
                    self._interrupt()

    def keep_alive(self) -> None:
        """Keep the brick from switching itself off, now and, as long as it is open, from now on."""
        sleep_ms = self.request(KeepAlive()).sleep_ms
        interval_s = min(LONGEST_SILENCE_S, sleep_ms / 3000) if sleep_ms else LONGEST_SILENCE_S
        self.repeat(AWAKE, KeepAlive(), interval_s)

    @property
    def reconnecting(self) -> bool:
        """Whether a lost link is opened again by itself: by the next request, and also while the program is idle.

        A loss is noticed within some 2 s: that often something is said. In the simulator, idle is who sleeps on the
        link's clock.
        """
        return self._reconnecting

    @reconnecting.setter
    def reconnecting(self, wished: bool) -> None:
        self._reconnecting = wished
        if wished:
            self.repeat(PROBE, KeepAlive(), PROBE_S)
        else:
            self.forget(PROBE)
        self._live()

    @property
    def lost(self) -> bool:
        """Whether the link is known to be lost, and to be opened again when the brick is back."""
        return self._comeback.lost is not None

    def repeat(self, name: str, command: Command[Any], interval_s: float, until_s: float = math.inf) -> None:
        """Send `command`, without asking for an answer, every `interval_s`, not after `until_s`; see `forget`."""
        self._heartbeat.repeat(name, command.encode(want_reply=False), interval_s, self.now(), until_s)
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

    def acknowledge(self) -> None:
        """The program knows that the link was lost and its motors have stopped; it need not be told again."""
        with self._turns.aside():
            if self.lost or self._send == self._interrupt:
                self._send, self._driven = self.transport.send, False

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
            self.transport.close()  # not amid a request; opening it takes long, and needs nobody's turn
        transport = reopen_transport(self.transport, timeout_s=self.timeout_s)
        with self._turns.aside():
            if self._gone.is_set():
                transport.close()
                raise LinkLost(f"{transport.address} is closed.", remedy="Open the brick again.")
            self._use(transport)
            self._dialogue.reset()
            self._heartbeat.clear()
            self._driven = self._driven and self._comeback.mine
            if self._driven:
                self._send = self._interrupt
        self.reconnecting = self._reconnecting  # begins to say something again
        self.keep_alive()
        for port, mode in self._modes.items():
            values = self.request(GetInputValues(port))
            if (values.type, values.mode) != (mode.type, mode.mode):
                self.request(mode)
        self._comeback.end(transport.address)

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

    def _come_back(self, lost: LinkLost, patience_s: float) -> bool:
        """Wait until the lost link is open again, and take part in that.

        Returns:
            Whether motors were driven since the last loss.

        Raises:
            LinkLost: This is not wished, or lasts too long.
        """
        if isinstance(lost, Interrupted):
            raise lost
        self._lose(lost)
        if self._unheard():
            raise lost
        deadline = self.now() + patience_s
        while self._comeback.lost is not None:
            if self.now() >= deadline or self._gone.is_set():
                self._driven = False
                waited = f"did not come back within {patience_s:g} s" if patience_s else "is not back yet"
                raise LinkLost(f"the link is lost, and the brick {waited}.", remedy="Is it on?") from lost
            self.transport.sleep(min(PULSE_S, self._comeback.due - self.now()))
            self._comeback.attempt()
        with self._turns.aside():
            self._send = self.transport.send
            driven, self._driven = self._driven, False
        return driven

    def _lose(self, lost: LinkLost) -> None:
        """Note that the link is lost; what is to be opened again raises nothing."""
        transport = self.transport
        if not self._reconnecting or self._comeback.mine or self._gone.is_set():
            raise lost
        self._comeback.begin(lost, lambda: self.transport is transport)

    def _interrupt(self, telegram: bytes = b"") -> None:
        """In the place of sending after the link came back: the program is told, once, that motion is over."""
        if self._comeback.mine:
            self.transport.send(telegram)
            return
        self._dialogue.reset()
        if not self._unheard():
            self._send, self._driven = self.transport.send, False
        raise interrupted()

    def _unheard(self) -> bool:
        """Whether what is raised now reaches a motion, not the program."""
        return False

    def _use(self, transport: Transport) -> None:
        self.transport = transport
        self.max_telegram = transport.max_telegram
        # Looked up once: `request` is called hundreds of times a second.
        self.now, self._receive = transport.now, transport.receive
        self._send = transport.send

    def _beat(self, now: float) -> None:
        """Send what is due; the caller holds the wire."""
        for telegram in self._heartbeat.take(now):
            self.transport.send(telegram)

    def _pause_s(self) -> float:
        """How long there is nothing to do for who sleeps."""
        if self._comeback.lost is None:
            return max(RESOLUTION_S, self._heartbeat.due - self.now())
        return max(RESOLUTION_S, self._comeback.due - self.now()) if self.transport.simulated else PULSE_S

    def _tend(self) -> None:
        """Send what is due; once the link is known to be lost, open it again when it is time.

        On real links that is left to the background thread, so that nobody else's time is taken.
        """
        if self._comeback.lost is None:
            try:
                with self._turns.aside():
                    self._beat(self.now())
            except LinkLost as error:
                self._lose(error)
        elif self.transport.simulated or threading.current_thread() is self._pulse:
            self._comeback.attempt()

    def _live(self) -> None:
        """See to the background thread, where time passes by itself."""
        if not self.transport.simulated and not (self._pulse and self._pulse.is_alive()):
            self._pulse = threading.Thread(target=self._beat_on, name="nxtdrive heartbeat", daemon=True)
            self._pulse.start()

    def _beat_on(self) -> None:
        """What the background thread does: a program that waits for its user still owns a living brick."""
        while not self._gone.wait(PULSE_S):
            try:
                self._tend()
            except LinkLost:
                return  # the program's next request meets the same error, and there somebody can act on it
            except LinkError:
                continue  # the link does not take this telegram; it may take the next


def answer_s(transport: Transport) -> float:
    """How long an answer may take on such a link when nobody has said; Bluetooth is told by its longer telegrams."""
    return CABLE_ANSWER_S if transport.max_telegram <= USB_TELEGRAM_LIMIT else RADIO_ANSWER_S
