"""Connects programs at any number of doors with one brick, each by a link of its own, so that replies find back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from sim_backend.doors.door import Client, Door

WAITING_LIMIT = 64
"""A program with so many telegrams and replies under way is not read from until some have got through, as a brick on
USB takes no packet while it is busy."""

CLIENT_LIMIT = 32
"""Programs at once; any more are sent away."""


class Link(Protocol):
    """What the switchboard needs of a way to the brick."""

    @property
    def under_way(self) -> int:
        """Telegrams and replies on their way."""

    def send(self, telegram: bytes) -> None:
        """Send a telegram to the brick; ConnectionError when the cable is out."""

    def poll(self) -> bytes | None:
        """The next reply that has arrived, or None; ConnectionError when the cable is out."""

    def close(self) -> None:
        """Give the link up."""


@dataclass(frozen=True, slots=True)
class Visit:
    """A program has come or gone.

    Attributes:
        event: "connected" or "disconnected".
        client: Its number; programs are counted from 1.
        door: The address it came to.
        name: Who it is.
        telegrams: How many it has sent.
    """

    event: str
    client: int
    door: str
    name: str
    telegrams: int


@dataclass(slots=True, eq=False)
class _Session:
    """One program and its link."""

    number: int
    door: Door
    client: Client
    link: Link
    telegrams: int = 0

    def visit(self, event: str) -> Visit:
        return Visit(event, self.number, self.door.address, self.client.name, self.telegrams)


class Switchboard:
    """All doors and everybody at them.

    Attributes:
        telegrams: Telegrams that have come in.
    """

    def __init__(
        self,
        doors: Sequence[Door],
        plug_in: Callable[[bool], Link],
        told: Callable[[Visit], object] = lambda _: None,
    ) -> None:
        """Connect the doors.

        Args:
            doors: Where programs come in.
            plug_in: Makes a link to the brick, over Bluetooth if asked so, else over USB; ConnectionError when the
                cable is out.
            told: Hears of programs that come and go.
        """
        self.telegrams = 0
        self._doors, self._plug_in, self._told = doors, plug_in, told
        self._sessions: list[_Session] = []
        self._arrived = 0

    @property
    def clients(self) -> int:
        """Programs that are connected now."""
        return len(self._sessions)

    def take(self) -> int:
        """Let in who has come, put on the way what has been said; returns the number of telegrams."""
        before = self.telegrams
        for session in self._sessions:
            if session.link.under_way < WAITING_LIMIT:
                self._listen(session)
        for door in self._doors:
            for client in door.arrivals():
                self._let_in(door, client)
        return self.telegrams - before

    def hand_out(self) -> None:
        """Hand out the replies that are due, forget who has gone."""
        for session in self._sessions:
            try:
                while (reply := session.link.poll()) is not None:
                    session.client.send(reply)
            except ConnectionError:
                session.client.hang_up()
        for session in [session for session in self._sessions if _over(session)]:
            self._see_off(session)

    def files(self) -> list[int]:
        """What to wait on for news."""
        doors = [number for door in self._doors if (number := door.fileno()) is not None]
        listening = (s for s in self._sessions if s.link.under_way < WAITING_LIMIT and not s.client.at_end)
        return doors + [session.client.fileno() for session in listening]

    def close(self) -> None:
        """Send everybody away, those at the first door last; the doors are their owner's to close."""
        for session in sorted(self._sessions, key=lambda session: self._doors.index(session.door), reverse=True):
            self._see_off(session)

    def _let_in(self, door: Door, client: Client) -> None:
        try:
            if len(self._sessions) >= CLIENT_LIMIT:
                raise ConnectionError("too many programs")
            link = self._plug_in(door.bluetooth)
        except ConnectionError:
            client.hang_up()
            return
        self._arrived += 1
        session = _Session(self._arrived, door, client, link)
        self._sessions.append(session)
        self._told(session.visit("connected"))
        self._listen(session)

    def _listen(self, session: _Session) -> None:
        try:
            for telegram in session.client.receive():
                session.telegrams += 1
                self.telegrams += 1
                session.link.send(telegram)
        except ConnectionError:
            session.client.hang_up()

    def _see_off(self, session: _Session) -> None:
        self._sessions.remove(session)
        session.link.close()
        session.client.hang_up()
        self._told(session.visit("disconnected"))


def _over(session: _Session) -> bool:
    return session.client.closed or (session.client.at_end and not session.link.under_way)
