"""Serves the thesis's line protocol on a TCP port: somebody else's agent decides, the robot obeys.

Nothing watches the client beside the command that runs: the link calls the server back before each request
and each rest, some fifty times a second, and the server looks whether something has arrived. So ``stop``, a client that
is gone and the end of the server break a motion off at a moment when no answer is due from the brick. On real links the
driver steers a motion in a thread of its own; what is raised there reaches the command, which waits for that thread.
"""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

from behaviors.journal import Observer
from behaviors.line_protocol import MOTIONS, ErrorReply, Request, RequestReader, Verb
from behaviors.line_session import Preempted, Session
from behaviors.mission import Mission
from behaviors.ports import Eyes
from firmware_protocol.errors import BrickNotFound, ConfigError, LinkError, LinkLost, NXTError
from firmware_protocol.telegram import Reply
from nxtdrive.brick import Brick
from nxtdrive.mission.setup import build_rover

R = TypeVar("R", bound=Reply)

LAST_PORT = 0xFFFF
CHUNK = 4096
WAITING_LINES = 256
"""A client that has sent so many lines without waiting for an answer is sent away: it does not speak this protocol."""
ANSWER_S = 1.0
"""Longest wait for a client to take an answer of a few bytes; one that reads nothing is as good as gone."""
LOOK_S = 0.1
"""How often an idle server looks whether it shall end."""
TICK_S = 0.02
"""Steps in which simulated time passes while nothing is asked."""


def sessions(mission: Mission, brick: Brick, eyes: Eyes, observers: Sequence[Observer]) -> Callable[[], Session]:
    """Makes conversations about one robot, one after the other.

    Args:
        mission: Its targets, its robot's measures, its numbers.
        brick: The robot's.
        eyes: For the mission's targets.
        observers: Hear the records of every conversation.
    """
    rover = build_rover(brick, mission)

    def connect() -> None:
        try:
            brick.link.keep_alive()
        except LinkError:
            try:
                brick.link.reconnect()
            except (LinkError, BrickNotFound) as error:
                raise LinkLost(str(error)) from error

    return lambda: Session(mission, rover, eyes, brick, connect=connect, faults=(NXTError,), observers=observers)


@dataclass(slots=True)
class _Client:
    """The program that is being served."""

    connection: socket.socket
    name: str
    session: Session
    requests: RequestReader = field(default_factory=RequestReader)
    gone: bool = False

    def hear(self) -> None:
        """Read what has arrived."""
        try:
            data = self.connection.recv(CHUNK)
        except OSError:
            data = b""
        self.requests.feed(data)
        self.gone = not data or len(self.requests) > WAITING_LINES

    def tell(self, value: int) -> None:
        """Write an answer."""
        try:
            self.connection.sendall(b"%d\n" % value)
        except OSError:
            self.gone = True


class LineServer:
    """One client at a time; a second is answered `ErrorReply.BUSY` and closed.

    A client may be silent for as long as it likes. When it is gone, the motors are off.

    Args:
        brick: Where commands may be broken off.
        new_session: Begins a conversation, one for each client.
        port: Where to listen; 0 takes a free one.
        host: On which of this computer's addresses.
        stopped: Whether the server shall end.
        say: Takes a sentence about clients that come and go.
        passing: Lets time pass while nothing is asked, for a simulation in real time; elsewhere time needs no help.

    Raises:
        ConfigError: The port cannot be had.
    """

    def __init__(
        self,
        brick: Brick,
        new_session: Callable[[], Session],
        *,
        port: int,
        host: str = "127.0.0.1",
        stopped: Callable[[], bool],
        say: Callable[[str], None] = lambda _: None,
        passing: Callable[[float], None] | None = None,
    ) -> None:
        self._listener = _listen(host, port)
        self._new_session = new_session
        self._stopped = stopped
        self._say = say
        self._passing = passing
        self._client: _Client | None = None
        self._moving = False
        brick.link.before_request = self._look_up

    @property
    def address(self) -> tuple[str, int]:
        """Host and port."""
        host, port = self._listener.getsockname()[:2]
        return host, port

    def run(self) -> None:
        """Serve until `stopped` says so."""
        while not self._stopped():
            if self._passing is None:
                self._hear(LOOK_S)
            elif not self._hear(0.0):
                # on a broken link, time passes all the same; the next command will tell the client
                with contextlib.suppress(LinkError):
                    self._passing(TICK_S)
            if self._client is not None:
                self._serve(self._client)

    def close(self) -> None:
        """Send the client away, motors off, and give the port back."""
        if self._client is not None:
            self._dismiss(self._client)
        self._listener.close()

    def _serve(self, client: _Client) -> None:
        """Answer what has been asked, also by a client that asked and left; its motions end before they begin."""
        while not self._stopped() and (request := client.requests.take()) is not None:
            client.tell(self._answer(client.session, request))
            client.gone = client.gone or request == Request(Verb.BYE)
        if client.gone:
            self._dismiss(client)

    def _answer(self, session: Session, request: Request | ErrorReply) -> int:
        if isinstance(request, ErrorReply):
            return request
        self._moving = request.verb in MOTIONS
        try:
            return session.answer(request)
        finally:
            self._moving = False

    def _look_up(self) -> None:
        """Called by the brick all the while; breaks a command off, once."""
        if not self._moving:
            return
        self._hear(0.0)
        client = self._client
        if self._stopped() or client is None or client.gone or client.requests.stop_waits:
            self._moving = False
            raise Preempted

    def _hear(self, wait_s: float) -> bool:
        """Take what has arrived from the client and from those who would be; returns whether there was anything."""
        client = self._client
        listened: list[Any] = [self._listener]
        if client is not None and not client.gone:
            listened.append(client.connection)
        ready, _, _ = select.select(listened, [], [], wait_s)
        if client is not None and client.connection in ready:
            client.hear()
        # whoever comes just as another leaves is not sent away
        if self._listener in ready and not (client is not None and client.gone):
            self._welcome()
        return bool(ready)

    def _welcome(self) -> None:
        try:
            connection, address = self._listener.accept()
        except OSError:
            return  # it has left already
        connection.settimeout(ANSWER_S)
        # a computer that was switched off says no goodbye
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        client = _Client(connection, "{}:{}".format(*address[:2]), self._new_session())
        if self._client is None:
            self._client = client
            self._say(f"client {client.name} is here")
            return
        client.tell(ErrorReply.BUSY)
        connection.close()
        self._say(f"client {client.name} was sent away: {self._client.name} is being served")

    def _dismiss(self, client: _Client) -> None:
        client.session.end()
        client.connection.close()
        self._client = None
        self._say(f"client {client.name} is gone; motors off")


def _listen(host: str, port: int) -> socket.socket:
    try:
        if not 0 <= port <= LAST_PORT:
            raise OSError(f"ports are numbered from 0 to {LAST_PORT}")
        listener = socket.create_server((host, port))
    except OSError as error:
        reason = error.strerror or str(error)
        raise ConfigError(
            f"cannot listen on {host}:{port}: {reason}.", remedy="Choose another --port; 0 takes a free one."
        ) from None
    listener.setblocking(False)
    return listener
