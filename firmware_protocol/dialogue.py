"""Request/reply matching without I/O.

The caller moves the bytes and supplies the time::

    transport.send(dialogue.open(command, now, timeout_s))
    while (reply := dialogue.feed(transport.receive(...))) is None:
        if request := dialogue.follow_up(now):
            transport.send(request)
        if now >= dialogue.deadline:
            raise dialogue.expire()

Telegrams carry no sequence number, so a late reply looks like the reply to a repeated request, and a dialogue that is
one reply behind would stay behind. Links preserve the order, which allows resynchronisation: after a request whose
reply was not seen, the next request waits behind a *fence*, a harmless request whose reply repeats a number of ours.
Everything before the fence's own reply is stale and dropped.

A reply that arrives twice puts the dialogue one reply behind as well, if the next request looks the same, and nothing
shows it until a reply arrives that fits no request. So the caller passes on what has arrived before a request is sent
(`discard`), and `surplus_telegrams` counts all such telegrams: a transfer of several telegrams is sound if the count
has not changed when a request of another kind has been answered at its end.
"""

from __future__ import annotations

from itertools import cycle
from typing import Any

from firmware_protocol.enums import InputPort, OutputPort
from firmware_protocol.errors import BrickError, CommunicationPending, LinkTimeout, MailboxEmpty, RemoteProtocolError
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead
from firmware_protocol.telegram import REPLY_HEADER, Command, Reply

FENCE_MODULE = 0x000C0001
"""The Ui module: every firmware has it, and reading it changes nothing (docs/firmware.md section 5.2)."""

FENCE_SIZES = range(1, 17)
"""Numbers that identify a fence, sent as the length it reads; the Ui IO map has 40 bytes."""

REMEMBERED_HEADS = 64
"""How many requests' reply heads are kept; programs poll a handful of them again and again."""

_HEADER_OF_FENCE = IOMapRead.encode_reply()[:2]


class Dialogue:
    """The dialogue over one link; one request is open at a time.

    A request is open until its reply arrives. Opening another one treats it as lost: after a timeout, a malformed
    reply, or an interrupt while waiting. Requests without a reply bypass the dialogue; send them directly.

    Attributes:
        deadline: When the open request times out, on the caller's clock, seconds.
        surplus_telegrams: How many telegrams belonged to no request although no reply was missing. When it grows,
            earlier replies may have belonged to earlier requests.
    """

    __slots__ = (
        "_behind",
        "_command",
        "_expected",
        "_fence",
        "_heads",
        "_lost",
        "_sizes",
        "_timeout_s",
        "_waiting",
        "deadline",
        "surplus_telegrams",
    )

    def __init__(self) -> None:
        self.deadline = 0.0
        self.surplus_telegrams = 0
        self._timeout_s = 0.0
        self._sizes = cycle(FENCE_SIZES)
        self._heads: dict[bytes, bytes] = {}
        self.reset()

    def reset(self) -> None:
        """Start over on a new link, which delivers no stale replies."""
        self._command: Command[Any] | None = None
        self._expected = b""
        self._fence = b""
        self._waiting: tuple[Command[Any], bytes] | None = None
        self._behind = False
        self._lost = b""

    def discard(self, telegrams: int) -> None:
        """Take note of telegrams that had arrived before a request is opened; they are late, or surplus."""
        if self._command is None and not self._behind:
            self.surplus_telegrams += telegrams

    def open(self, command: Command[Any], now: float, timeout_s: float) -> bytes:
        """Open `command` and return what to send: its request, or a fence, after which `follow_up` returns the request.

        Raises:
            LocalProtocolError: A value does not fit its field; the dialogue is unchanged.
        """
        request = command.encode()
        if open_before := self._command is not None:
            self._lost = self._expected
        self._timeout_s = timeout_s
        self.deadline = now + timeout_s
        if self._behind or open_before:
            return self._raise_fence(command, request)
        self._command = command
        head = self._heads.get(request)
        if head is None:
            if len(self._heads) >= REMEMBERED_HEADS:
                self._heads.clear()
            head = self._heads[request] = command.reply_head(request)
        self._expected = head
        return request

    def feed(self, telegram: bytes) -> Reply | None:
        """Return the open request's reply, or None if `telegram` is late, unrelated, or the fence's reply.

        Raises:
            RemoteProtocolError: It is the reply, but not of the declared size.
            BrickError: The brick refused.
        """
        command = self._command
        if command is not None and telegram.startswith(self._expected):
            reply: Reply = command.decode_reply(telegram)
            self._command = None
            return reply
        return self._consider(telegram)

    def follow_up(self, now: float) -> bytes:
        """Return the request that waited behind a fence, once the fence is answered; otherwise empty.

        Its timeout starts now, as it has not been sent before.
        """
        if self._fence or self._waiting is None:
            return b""
        self._behind = False
        self._command, request = self._waiting
        self._expected = self._command.reply_head(request)
        self._waiting = None
        self.deadline = now + self._timeout_s
        return request

    def expire(self) -> LinkTimeout:
        """Return the error to raise when the deadline has passed."""
        if self._waiting:
            name, outcome = type(self._waiting[0]).__name__, "was not sent, because the brick had not replied for"
        else:
            name, outcome = type(self._command).__name__, "was not answered within"
        return LinkTimeout(
            f"{name} {outcome} {self._timeout_s:g} s.",
            remedy="Is the brick on, near, and not showing a dialog? If so, connect again.",
        )

    def _raise_fence(self, command: Command[Any], request: bytes) -> bytes:
        """Put `request` behind a new fence and return the fence, to be sent."""
        self._behind = True
        taken = self._lost, command.reply_head(request)
        for size in self._sizes:
            question = IOMapRead(FENCE_MODULE, 0, size).encode()
            self._fence = IOMapRead.reply_head(question)
            if self._fence not in taken:
                break
        self._command = None
        self._waiting = (command, request)
        return question

    def _consider(self, telegram: bytes) -> Reply | None:
        """Handle a telegram that is not simply the open request's successful reply."""
        if self._fence:
            # a brick that cannot be read this way refuses; that is a reply, too, though without our number
            refused = telegram[:2] == _HEADER_OF_FENCE and telegram[2:3] not in (b"", b"\0")
            if refused or telegram.startswith(self._fence):
                self._fence = b""
            return None
        command, expected = self._command, self._expected
        if command is None or telegram[:2] != expected[:2]:
            self.surplus_telegrams += 1
            return None
        name = type(command).__name__
        if len(telegram) < REPLY_HEADER:
            raise RemoteProtocolError(f"the answer to {name} has no status", bytes(telegram))
        if telegram[2] not in command.success:
            self._command = None
            raise _refusal(telegram[2], command)
        if not expected[REPLY_HEADER:].startswith(telegram[REPLY_HEADER : len(expected)]):
            self.surplus_telegrams += 1
            return None
        reply: Reply = command.decode_reply(telegram)
        self._command = None
        return reply


def _refusal(status: int, command: Command[Any]) -> BrickError:
    """Return the error for a reply to `command` with this status byte."""
    known = Status(status)
    kind = {Status.PENDING: CommunicationPending, Status.MAILBOX_EMPTY: MailboxEmpty}.get(known, BrickError)
    return kind(known, type(command).__name__, _port(command))


def _port(command: Command[Any]) -> str:
    """Return the port that a command is for, as printed on the brick, or an empty string."""
    port = getattr(command, "port", None)
    if not isinstance(port, InputPort | OutputPort) or not port.known:
        return ""
    return port.name.removeprefix("IN_")
