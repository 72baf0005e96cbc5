"""Connect programs at any number of doors to one brick, each by its own link, so that replies reach their sender."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from sim_backend.doors.door import Client, Door
from sim_backend.link import SimLink

WAITING_LIMIT = 64
"""Telegrams and replies in flight at which a program is no longer read, as a busy brick accepts no USB packet."""

CLIENT_LIMIT = 32
"""Maximum number of connected programs; a further one replaces one that has sent nothing, or is refused."""


@dataclass(frozen=True, slots=True)
class ConnectionEvent:
    """A program connected or disconnected, or was refused; of several refusals in a row only the first is reported.

    Attributes:
        event: "connected", "disconnected" or "refused".
        client: Number of the program, counted from 1; 0 for a refused one.
        door: Address of the door.
        name: Name of the program.
        telegrams: Number of telegrams it has sent.
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
    link: SimLink
    telegrams: int = 0

    def report(self, event: str) -> ConnectionEvent:
        return ConnectionEvent(event, self.number, self.door.address, self.client.name, self.telegrams)


class Switchboard:
    """All doors and their clients.

    Attributes:
        telegrams: Number of received telegrams.
        last: The last of them.
    """

    def __init__(
        self,
        doors: Sequence[Door],
        plug_in: Callable[[bool], SimLink],
        on_event: Callable[[ConnectionEvent], object] = lambda _: None,
    ) -> None:
        """Connect the doors.

        Args:
            doors: The doors.
            plug_in: Makes a link to the brick, over Bluetooth if the argument is True, otherwise over USB; raises
                ConnectionError if the cable is unplugged.
            on_event: Called when a program connects or disconnects.
        """
        self.telegrams = 0
        self.last = b""
        self._doors, self._plug_in, self._on_event = doors, plug_in, on_event
        self._sessions: list[_Session] = []
        self._arrived = 0
        self._refusing = False

    @property
    def clients(self) -> int:
        """Number of connected programs."""
        return len(self._sessions)

    def take(self) -> int:
        """Accept new programs and forward their telegrams; returns the number of telegrams."""
        before = self.telegrams
        for session in self._sessions:
            if session.link.under_way < WAITING_LIMIT:
                self._read(session)
        for door in self._doors:
            for client in door.accept():
                self._admit(door, client)
        return self.telegrams - before

    def send_replies(self) -> None:
        """Send the replies that are due, and remove disconnected programs."""
        for session in self._sessions:
            try:
                while (reply := session.link.poll()) is not None:
                    session.client.send(reply)
            except ConnectionError:
                session.client.disconnect()
        for session in [session for session in self._sessions if _has_ended(session)]:
            self._disconnect(session)

    def files(self) -> list[int]:
        """Return the file descriptors to wait on."""
        doors = [number for door in self._doors if (number := door.fileno()) is not None]
        listening = (s for s in self._sessions if s.link.under_way < WAITING_LIMIT and not s.client.at_end)
        return doors + [session.client.fileno() for session in listening]

    def close(self) -> None:
        """Disconnect all programs, those at the first door last; the caller closes the doors."""
        for session in sorted(self._sessions, key=lambda session: self._doors.index(session.door), reverse=True):
            self._disconnect(session)

    def _admit(self, door: Door, client: Client) -> None:
        if len(self._sessions) >= CLIENT_LIMIT and not self._make_room():
            client.disconnect()
            if not self._refusing:
                self._refusing = True
                self._on_event(ConnectionEvent("refused", 0, door.address, client.name, 0))
            return
        try:
            link = self._plug_in(door.bluetooth)
        except ConnectionError:
            client.disconnect()
            return
        self._arrived += 1
        session = _Session(self._arrived, door, client, link)
        self._sessions.append(session)
        self._on_event(session.report("connected"))
        self._read(session)

    def _make_room(self) -> bool:
        """Disconnect the oldest program that has sent nothing; returns whether there was one."""
        silent = next((session for session in self._sessions if not session.telegrams), None)
        if silent is not None:
            self._disconnect(silent)
        return silent is not None

    def _read(self, session: _Session) -> None:
        try:
            for telegram in session.client.receive():
                session.telegrams += 1
                self.telegrams += 1
                self.last = telegram
                session.link.send(telegram)
        except ConnectionError:
            session.client.disconnect()

    def _disconnect(self, session: _Session) -> None:
        self._sessions.remove(session)
        self._refusing = False
        session.link.close()
        session.client.disconnect()
        self._on_event(session.report("disconnected"))


def _has_ended(session: _Session) -> bool:
    return session.client.closed or (session.client.at_end and not session.link.under_way)
