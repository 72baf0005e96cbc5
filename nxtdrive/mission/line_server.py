"""Serves the thesis's line protocol on a TCP port, so that another program's agent drives the robot.

There is no thread for the client: the link calls the server back before each request and each sleep, some fifty times a
second, and the server checks whether something has arrived. So ``stop``, a client that has left and the end of the
server interrupt a motion at a moment when no reply of the brick is pending. On real links the driver steers a motion in
a thread of its own; what is raised there reaches the command, which waits for that thread.
"""

from __future__ import annotations

import contextlib
import select
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

from behaviors.journal import Observer
from behaviors.line_protocol import MOTIONS, ErrorReply, Request, RequestReader, Verb
from behaviors.line_session import Preempted, Session
from behaviors.mission import Mission
from behaviors.ports import BodyLost, Eyes, SensorListener
from firmware_protocol.errors import ConfigError, LinkError, NXTError
from nxtdrive.brick import Brick
from nxtdrive.mission.body import MissionClock, link_errors_as_outages
from nxtdrive.mission.setup import build_body

LAST_PORT = 0xFFFF
CHUNK = 4096
WAITING_LINES = 256
"""A client that sends more lines than this without waiting for answers does not speak this protocol; it is closed."""
ANSWER_S = 1.0
"""Longest wait for a client to take an answer of a few bytes; one that reads nothing counts as gone."""
LOOK_S = 0.1
"""How often an idle server checks whether to end."""
TICK_S = 0.02
"""Step of simulated time while no command runs."""


def sessions(
    mission: Mission,
    brick: Brick,
    eyes: Eyes,
    observers: Sequence[Observer],
    on_sensor_change: SensorListener = lambda _sensor, _error: None,
) -> Callable[[], Session]:
    """Return a function that begins a session with one robot.

    Args:
        mission: Gives the targets, the robot's measures and the parameters.
        brick: The robot's brick.
        eyes: The robot's camera.
        observers: Called with the records of every session.
        on_sensor_change: Called when a sensor fails and when it answers again.
    """
    body, clock = build_body(brick, mission), MissionClock(brick)
    body.on_sensor_change(on_sensor_change)

    def connect() -> None:
        try:
            body.keep_alive()
        except BodyLost:
            with link_errors_as_outages():
                brick.link.reconnect()

    return lambda: Session(mission, body, eyes, clock, connect=connect, faults=(NXTError,), observers=observers)


@dataclass(slots=True)
class _Client:
    """The client that is being served."""

    connection: socket.socket
    name: str
    session: Session
    requests: RequestReader = field(default_factory=RequestReader)
    gone: bool = False

    def read(self) -> None:
        """Read what the client has sent."""
        try:
            data = self.connection.recv(CHUNK)
        except OSError:
            data = b""
        self.requests.feed(data)
        self.gone = not data or len(self.requests) > WAITING_LINES

    def send(self, value: int) -> None:
        """Send an answer."""
        try:
            self.connection.sendall(b"%d\n" % value)
        except OSError:
            self.gone = True


class LineServer:
    """One client at a time; a second is answered `ErrorReply.BUSY` and closed.

    A client may stay silent for any time. When it leaves, the motors stop.

    Args:
        brick: Calls back where a command may be interrupted.
        new_session: Begins the session of a client.
        port: Where to listen; 0 takes a free one.
        host: Which of this computer's addresses to listen at.
        stopped: Whether the server should end.
        say: Called with a sentence when a client comes or leaves.
        passing: Lets simulated time pass while no command runs; None where time passes by itself.

    Raises:
        ConfigError: The port is not available.
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
        """Serve until `stopped` returns true."""
        while not self._stopped():
            if self._passing is None:
                self._receive(LOOK_S)
            elif not self._receive(0.0):
                # time passes on a broken link, too; the client learns of it from the next command
                with contextlib.suppress(LinkError):
                    self._passing(TICK_S)
            if self._client is not None:
                self._serve(self._client)

    def close(self) -> None:
        """Stop the motors, close the client and free the port."""
        if self._client is not None:
            self._dismiss(self._client)
        self._listener.close()

    def _serve(self, client: _Client) -> None:
        """Answer the waiting requests, also those of a client that has left; its motions end before they begin."""
        while not self._stopped() and (request := client.requests.take()) is not None:
            client.send(self._answer(client.session, request))
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
        """Interrupt the running command, once; called by the brick before each request and sleep."""
        if not self._moving:
            return
        self._receive(0.0)
        client = self._client
        if self._stopped() or client is None or client.gone or client.requests.stop_waits:
            self._moving = False
            raise Preempted

    def _receive(self, wait_s: float) -> bool:
        """Read from the client and accept new ones; returns whether there was anything."""
        client = self._client
        listened: list[Any] = [self._listener]
        if client is not None and not client.gone:
            listened.append(client.connection)
        ready, _, _ = select.select(listened, [], [], wait_s)
        if client is not None and client.connection in ready:
            client.read()
        # a client that connects just as another leaves is not refused
        if self._listener in ready and not (client is not None and client.gone):
            self._welcome()
        return bool(ready)

    def _welcome(self) -> None:
        try:
            connection, address = self._listener.accept()
        except OSError:
            return  # the client has left already
        connection.settimeout(ANSWER_S)
        # detects a client's computer that was switched off
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        client = _Client(connection, "{}:{}".format(*address[:2]), self._new_session())
        if self._client is None:
            self._client = client
            self._say(f"client {client.name} is here")
            return
        client.send(ErrorReply.BUSY)
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
