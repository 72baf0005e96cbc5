"""Serve the thesis's line protocol on a TCP port, so that another program's agent drives the robot.

There is no thread for the client: the link calls the server back before each request and each sleep, about fifty times
a second, and the server checks whether something has arrived. So ``stop``, a client that disconnects and the end of the
server interrupt a motion at a moment when no reply of the brick is pending. On real links the driver steers a motion in
its own thread; an exception raised there reaches the command, which waits for that thread.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from behaviors.journal import Observer
from behaviors.line_protocol import MOTIONS, BadLine, ErrorReply, Request, RequestReader, Verb, failure_reply
from behaviors.line_session import Preempted, Session
from behaviors.mission import Mission
from behaviors.ports import Ports, RobotUnreachable, SensorListener, Vision
from firmware_protocol.errors import LinkError, NXTError
from nxtdrive.brick import Brick
from nxtdrive.host.listening import LOOPBACK, listen
from nxtdrive.link.interrupting import interruptible
from nxtdrive.mission.body import MissionClock, build_body, link_errors_as_outages

CHUNK = 4096
WAITING_LINES = 256
"""A client that sends more lines than this without waiting for answers does not speak this protocol; it is closed."""
CLIENT_LIMIT = 8
"""Connected clients, the served one and those that get a busy error; a further one replaces the oldest
that is not served."""
CHECK_INTERVAL_S = 0.1
"""How often an idle server checks whether to end."""
TICK_S = 0.02
"""Step of simulated time while no command runs."""


def sessions(
    mission: Mission,
    brick: Brick,
    vision: Vision,
    observers: Sequence[Observer],
    on_sensor_change: SensorListener = lambda _sensor, _error: None,
) -> Callable[[], Session]:
    """Return a function that begins a session with one robot.

    Args:
        mission: Gives the targets, the robot's measures and the parameters.
        brick: The robot's brick.
        vision: The robot's camera and detectors.
        observers: Called with the records of every session.
        on_sensor_change: Called when a sensor fails and when it answers again.
    """
    body = build_body(brick, mission)
    body.on_sensor_change(on_sensor_change)

    def connect() -> None:
        try:
            body.keep_alive()
        except RobotUnreachable:
            with link_errors_as_outages():
                brick.link.reconnect()

    ports = Ports(body, vision, MissionClock(brick))
    return lambda: Session(mission, ports, connect=connect, faults=(NXTError,), observers=observers)


@dataclass(slots=True, eq=False)
class _Client:
    """A connected program.

    Attributes:
        session: Its session, from its first request on; None for a client that is not served.
    """

    connection: socket.socket
    name: str
    session: Session | None = None
    requests: RequestReader = field(default_factory=RequestReader)
    gone: bool = False
    refused: bool = False

    def read(self) -> None:
        """Read what the client has sent."""
        try:
            data = self.connection.recv(CHUNK)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        self.requests.feed(data)
        self.gone = not data or len(self.requests) > WAITING_LINES

    def send(self, value: int | str) -> None:
        """Send an answer; never waits. A client that lets the kernel's buffers fill with answers counts as gone."""
        answer = f"{value}\n".encode()
        try:
            self.gone = self.connection.send(answer) < len(answer) or self.gone
        except OSError:
            self.gone = True


class LineServer:
    """Serves one client at a time: the first that sends a request, until it leaves; others get a busy error.

    A client may stay silent for any time. When the served client leaves, the motors stop.

    Args:
        brick: Calls back at points where a command may be interrupted.
        new_session: Begins the session of a client.
        port: Where to listen; 0 takes a free one.
        host: Which of this computer's addresses to listen on.
        stopped: Whether the server should end.
        say: Called with a sentence when a client is served, refused or gone.
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
        host: str = LOOPBACK,
        stopped: Callable[[], bool],
        say: Callable[[str], None] = lambda _: None,
        passing: Callable[[float], None] | None = None,
    ) -> None:
        self._listener = listen(port, host)
        self._listener.setblocking(False)
        self._new_session = new_session
        self._stopped = stopped
        self._say = say
        self._passing = passing
        self._clients: list[_Client] = []
        self._served: _Client | None = None
        self._moving = self._crowded = False
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._link = brick.link

    @property
    def address(self) -> tuple[str, int]:
        """Host and port."""
        host, port = self._listener.getsockname()[:2]
        return host, port

    def run(self) -> None:
        """Serve until `stopped` returns true."""
        with interruptible(self._link, self._interrupt_if_needed):
            while not self._stopped():
                self._serve()

    def close(self) -> None:
        """Stop the motors, close all clients and free the port; never waits for a client."""
        for client in list(self._clients):
            self._close_client(client)
        self._selector.close()
        self._listener.close()

    def _serve(self) -> None:
        """Wait a moment for requests and execute them."""
        if self._passing is None:
            self._receive(CHECK_INTERVAL_S)
        elif not self._receive(0.0):
            # time passes on a broken link too; the client gets the error with its next command
            with contextlib.suppress(LinkError):
                self._passing(TICK_S)
        # the served client first: one that has left makes room for another's request
        for client in sorted(self._clients, key=lambda client: client is not self._served):
            if client in self._clients:
                self._answer_lines(client)

    def _answer_lines(self, client: _Client) -> None:
        """Answer the waiting lines, including those of a client that has left; its motions end before they begin."""
        while not self._stopped() and (request := client.requests.take()) is not None:
            if self._served is None and isinstance(request, Request):
                self._served, client.session = client, self._new_session()
                self._say(f"serving client {client.name}")
            client.send(self._answer(client, request))
            client.gone = client.gone or request == Request(Verb.BYE)
        if client.gone:
            self._close_client(client)

    def _answer(self, client: _Client, request: Request | BadLine) -> int | str:
        if client.session is None:
            return request.reply if isinstance(request, BadLine) else self._refuse(client, request)
        self._moving = isinstance(request, Request) and request.verb in MOTIONS
        try:
            return client.session.answer(request)
        finally:
            self._moving = False

    def _refuse(self, client: _Client, request: Request) -> int:
        if not client.refused and self._served is not None:
            client.refused = True
            self._say(f"refused client {client.name}: client {self._served.name} is being served")
        return failure_reply(request.verb, ErrorReply.BUSY)

    def _interrupt_if_needed(self) -> None:
        """Interrupt the running command, once; called by the brick before each request and sleep."""
        if not self._moving:
            return
        self._receive(0.0)
        for client in [client for client in self._clients if client is not self._served]:
            self._answer_lines(client)
        served = self._served
        if self._stopped() or served is None or served.gone or served.requests.stop_waits:
            self._moving = False
            raise Preempted

    def _receive(self, wait_s: float) -> bool:
        """Read from the clients and accept new ones; returns whether there was anything."""
        ready = [key.data for key, _ in self._selector.select(wait_s)]
        if self._listener not in self._selector.get_map():
            self._selector.register(self._listener, selectors.EVENT_READ)
        for client in ready:
            if isinstance(client, _Client):
                client.read()
                if client.gone:
                    self._selector.unregister(client.connection)
        if None in ready:
            self._accept()
        return bool(ready)

    def _accept(self) -> None:
        try:
            connection, address = self._listener.accept()
        except OSError:  # the client has left already, or too many files are open: not accepted until the next select
            self._selector.unregister(self._listener)
            return
        connection.setblocking(False)
        try:  # detects a client's computer that was switched off
            connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
        except OSError:  # the client has left meanwhile: macOS
            connection.close()
            return
        client = _Client(connection, "{}:{}".format(*address[:2]))
        if len(self._clients) == CLIENT_LIMIT:
            oldest = next(each for each in self._clients if each is not self._served)
            if not self._crowded:  # one message until there is room
                self._say(f"dropped client {oldest.name}: more than {CLIENT_LIMIT} are connected")
            self._close_client(oldest)
            self._crowded = True
        self._clients.append(client)
        self._selector.register(connection, selectors.EVENT_READ, client)

    def _close_client(self, client: _Client) -> None:
        self._clients.remove(client)
        self._crowded = False
        if client.connection in self._selector.get_map():
            self._selector.unregister(client.connection)
        client.connection.close()
        if client.session is not None:
            client.session.end()
            self._served = None
            self._say(f"client {client.name} disconnected; motors off")
