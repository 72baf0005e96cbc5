"""The conversation with a brick, without any I/O: which answer belongs to which request.

The caller moves the bytes and tells the time::

    transport.send(dialogue.open(command, now, timeout_s))
    while (reply := dialogue.feed(transport.receive(...))) is None:
        if request := dialogue.follow_up(now):
            transport.send(request)
        if now >= dialogue.deadline:
            raise dialogue.expire()

Telegrams carry no sequence number, so a late answer looks like the answer to the same question asked again, and a
dialogue that is one answer behind would stay behind for ever. Links keep the order, and this is what brings the
dialogue back into step: after a request whose answer was not seen, the next one waits behind a *fence*, a harmless
question whose answer repeats a number of ours. Everything before the fence's own answer is old and dropped.
"""

from __future__ import annotations

from collections import deque
from itertools import cycle
from typing import Any

from firmware_protocol.errors import BrickError, CommunicationPending, LinkTimeout, MailboxEmpty, RemoteProtocolError
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead
from firmware_protocol.telegram import REPLY_HEADER, Command, Reply

FENCE_MODULE = 0x000C0001
"""The Ui module: every firmware has it, and reading it changes nothing (docs/firmware.md section 5.2)."""

FENCE_SIZES = range(1, 17)
"""The numbers a fence may carry, as the length it reads; the Ui IO map has 40 bytes."""

REMEMBERED_LOSSES = 8
"""So many unanswered requests cannot be taken for a fence; fewer than there are fences."""

_HEADER_OF_FENCE = IOMapRead.encode_reply()[:2]


class Dialogue:
    """One link's conversation; one request is open at a time.

    A request is open until its answer comes. Opening another one gives it up for lost: after a timeout, after a
    malformed answer, and after an interrupt in the middle of waiting. Requests that want no reply do not concern the
    dialogue; send them as they are.

    Attributes:
        deadline: When the open request's time is up, on the caller's clock, seconds.
    """

    __slots__ = ("_command", "_expected", "_fence", "_lost", "_sizes", "_timeout_s", "_waiting", "deadline")

    def __init__(self) -> None:
        self.deadline = 0.0
        self._timeout_s = 0.0
        self._sizes = cycle(FENCE_SIZES)
        self.reset()

    def reset(self) -> None:
        """Begin anew on a new link, from which nothing old can come."""
        self._command: Command[Any] | None = None
        self._expected = b""
        self._fence = b""
        self._waiting: tuple[Command[Any], bytes] | None = None
        self._lost: deque[bytes] = deque(maxlen=REMEMBERED_LOSSES)

    def open(self, command: Command[Any], now: float, timeout_s: float) -> bytes:
        """What to send in order to ask `command`: its request, or first the fence that `follow_up` lets it through.

        Raises:
            LocalProtocolError: A value does not fit its field; nothing has changed.
        """
        request = command.encode()
        if self._command is not None:
            self._lost.append(self._expected)
        self._timeout_s = timeout_s
        self.deadline = now + timeout_s
        if self._lost or self._fence or self._waiting:
            return self._raise_fence(command, request)
        self._command = command
        self._expected = command.reply_head(request)
        return request

    def feed(self, telegram: bytes) -> Reply | None:
        """The open request's answer, or None if `telegram` is something else: late, foreign, or the fence's answer.

        Raises:
            RemoteProtocolError: It is the answer, but not of the declared size.
            BrickError: The brick refused.
        """
        command = self._command
        if command is not None and telegram.startswith(self._expected):
            reply: Reply = command.decode_reply(telegram)
            self._command = None
            return reply
        return self._consider(telegram)

    def follow_up(self, now: float) -> bytes:
        """The request that waited behind a fence, to be sent once its way is free; otherwise nothing.

        Its time begins now, as it has not been asked before.
        """
        if self._fence or self._waiting is None:
            return b""
        self._command, request = self._waiting
        self._expected = self._command.reply_head(request)
        self._waiting = None
        self.deadline = now + self._timeout_s
        return request

    def expire(self) -> LinkTimeout:
        """The error to raise when the deadline has passed."""
        if self._waiting:
            name, fate = type(self._waiting[0]).__name__, "was not sent, as the brick was mute for"
        else:
            name, fate = type(self._command).__name__, "was not answered within"
        return LinkTimeout(
            f"{name} {fate} {self._timeout_s:g} s.",
            remedy="Is the brick on, near, and not showing a dialog? If so, connect again.",
        )

    def _raise_fence(self, command: Command[Any], request: bytes) -> bytes:
        """Let `request` wait behind a new fence; the fence is returned, to be sent."""
        taken = {*self._lost, command.reply_head(request)}
        for size in self._sizes:
            question = IOMapRead(FENCE_MODULE, 0, size).encode()
            self._fence = IOMapRead.reply_head(question)
            if self._fence not in taken:
                break
        self._command = None
        self._waiting = (command, request)
        return question

    def _consider(self, telegram: bytes) -> Reply | None:
        """Judge a telegram that is not simply the open request's good answer."""
        if self._fence:
            # A brick that cannot be read this way refuses; that is an answer, too, though without our number.
            refused = telegram[:2] == _HEADER_OF_FENCE and telegram[2:3] not in (b"", b"\0")
            if refused or telegram.startswith(self._fence):
                self._fence = b""
                self._lost.clear()
            return None
        command, expected = self._command, self._expected
        if command is None or telegram[:2] != expected[:2]:
            return None
        name = type(command).__name__
        if len(telegram) < REPLY_HEADER:
            raise RemoteProtocolError(f"the answer to {name} has no status", bytes(telegram))
        if telegram[2] not in command.success:
            self._command = None
            raise refusal(telegram[2], name)
        if not expected[REPLY_HEADER:].startswith(telegram[REPLY_HEADER : len(expected)]):
            return None
        reply: Reply = command.decode_reply(telegram)
        self._command = None
        return reply


def refusal(status: int, command: str) -> BrickError:
    """The error for a reply to `command` with this status byte."""
    known = Status(status)
    if known == Status.PENDING:
        return CommunicationPending(known, command)
    if known == Status.MAILBOX_EMPTY:
        return MailboxEmpty(known, command)
    return BrickError(known, command)
