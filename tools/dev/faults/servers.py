"""Campaign: hostile clients at `nxtdrive sim serve` and `nxtdrive serve`, over real sockets, in separate processes.

Outcomes depend on the machine's speed by nature: the limits are those that the documents state, with a margin.
"""

from __future__ import annotations

import contextlib
import json
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from pathlib import Path
from random import Random

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.framing import frame

from .campaign import Campaign, GuaranteeViolated, Tally, Violation
from .hostile_clients import KINDS, HostileClients

SERVED_S = 3.0
"""Longest wait of a well-behaved client for its answer."""
END_S = 2.0
"""Longest wait for the end of a server after Ctrl-C."""
MEMORY_LIMIT_KB = 64_000
"""How much the server's memory may grow."""
ROUNDS = 12
"""Number of steps of the hostile clients; each well-behaved client sends a request after each step."""

Address = tuple[str, int]

QUESTION = GetBatteryLevel().encode()
VIEW = b"GET /camera.mjpg HTTP/1.0\r\n\r\n"


class Server(ABC):
    """A server in a process of its own, which ends with the block.

    Attributes:
        doors: What hostile clients connect to: an address and a valid request.
    """

    def __init__(self, command: list[str]) -> None:
        self.process = subprocess.Popen(  # noqa: S603 - a fixed command
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, errors="replace"
        )
        self.doors: dict[str, tuple[Address | str, bytes]] = {}

    def first_line(self) -> str:
        """Return the first line that the server prints."""
        assert self.process.stdout is not None  # noqa: S101 - a pipe
        return self.process.stdout.readline()

    @property
    def memory_kb(self) -> int:
        """Resident memory."""
        status = Path(f"/proc/{self.process.pid}/status").read_text(encoding="ascii")
        return int(re.findall(r"VmRSS:\s+(\d+)", status)[0])

    @abstractmethod
    def clients(self) -> Iterator[WellBehavedClient]:
        """Connect well-behaved clients, which are served at the same time."""

    def end(self) -> None:
        """Press Ctrl-C.

        Raises:
            GuaranteeViolated: The server does not end in time, or not with exit code 0.
        """
        self.process.send_signal(signal.SIGINT)
        try:
            said, _ = self.process.communicate(timeout=END_S)
        except subprocess.TimeoutExpired:
            raise GuaranteeViolated(f"Ctrl-C did not end the server within {END_S:g} s") from None
        if self.process.returncode != 0 or "Traceback" in said:
            raise GuaranteeViolated(f"the server ended with exit code {self.process.returncode}: {said[-500:]}")

    def kill(self) -> None:
        """End the server in any case."""
        self.process.kill()
        self.process.communicate()


class SimServe(Server):
    """`nxtdrive sim serve` with one door of each kind."""

    def __init__(self, folder: Path) -> None:
        ports = ["--tcp", "0", "--nxt-server", "0", "--pty", str(folder / "nxt")]
        super().__init__([sys.executable, "-m", "nxtdrive", "sim", "serve", "--json", *ports])
        serving = json.loads(self.first_line())
        self._camera, *addresses = map(host_and_port, (serving["camera"], *serving["doors"][1:]))
        self._tcp, self._nxt_server = addresses
        self.doors = {
            "camera": (self._camera, VIEW),
            "tcp": (self._tcp, frame(QUESTION)),
            "nxt-server": (self._nxt_server, QUESTION),
            "pty": (str(folder / "nxt"), frame(QUESTION)),
        }

    def clients(self) -> Iterator[WellBehavedClient]:
        """Connect one client at each TCP port."""
        yield Program(self._tcp, framed=True)
        yield Program(self._nxt_server, framed=False)
        yield Viewer(self._camera)


class Serve(Server):
    """`nxtdrive serve`."""

    def __init__(self, _: Path) -> None:
        super().__init__([sys.executable, "-m", "nxtdrive", "serve", "--port", "0", "--nxt", "sim://open"])
        self._address = host_and_port(self.first_line())
        self.doors = {"line": (self._address, b"why\n")}

    def clients(self) -> Iterator[WellBehavedClient]:
        """Connect the one client that is served."""
        yield Agent(self._address)


class WellBehavedClient(ABC):
    """A well-behaved client.

    Raises:
        GuaranteeViolated: From `ask` and from construction: it was not served in time.
    """

    def __init__(self, address: Address) -> None:
        try:
            self._socket = socket.create_connection(address, timeout=SERVED_S)
            self._stream = self._socket.makefile("rb")
        except OSError as error:
            raise GuaranteeViolated(f"{type(self).__name__} cannot connect: {error}") from error

    def ask(self) -> None:
        """Send a request and wait for its answer."""
        try:
            answer = self._ask()
        except OSError as error:
            raise GuaranteeViolated(f"{type(self).__name__} got no reply: {error or type(error).__name__}") from error
        if not answer:
            raise GuaranteeViolated(f"{type(self).__name__} was disconnected")

    @abstractmethod
    def _ask(self) -> bytes:
        """Return the answer; empty if the server has closed the connection."""

    def close(self) -> None:
        """Leave."""
        self._stream.close()
        self._socket.close()


class Program(WellBehavedClient):
    """A program at the door tcp or nxt-server."""

    def __init__(self, address: Address, *, framed: bool) -> None:
        super().__init__(address)
        self._framed = framed

    def _ask(self) -> bytes:
        self._socket.sendall(frame(QUESTION) if self._framed else QUESTION)
        return self._stream.read(7 if self._framed else 5)


class Viewer(WellBehavedClient):
    """A viewer of the camera."""

    def __init__(self, address: Address) -> None:
        super().__init__(address)
        self._socket.sendall(VIEW)

    def _ask(self) -> bytes:
        line = self._stream.readline()
        while line and not line.startswith(b"Content-Length"):
            line = self._stream.readline()
        if not line:
            return b""
        self._stream.readline()
        return self._stream.read(int(line.split()[1]))


class Agent(WellBehavedClient):
    """A client of the line protocol."""

    def _ask(self) -> bytes:
        self._socket.sendall(b"connect\n")
        answer = self._stream.readline()
        if answer not in (b"1\n", b""):
            raise GuaranteeViolated(f"connect got the reply {answer!r}")
        return answer


def run(seed: int, numbers: range) -> Tally:
    """Run the trials of these numbers; one in four is of `nxtdrive serve`."""
    tally = Tally()
    for number in numbers:
        rng = Random(f"{seed}/{number}")  # noqa: S311 - not for secrets
        with tempfile.TemporaryDirectory() as folder:
            server = (Serve if number % 4 == 1 else SimServe)(Path(folder))
            try:
                chosen = [(rng.choice(sorted(server.doors)), rng.choice(KINDS)) for _ in range(rng.randint(1, 3))]
                attempt(server, chosen, rng, leaves=number % 2 == 0)
                tally.outcomes.update(f"{door}: others served beside {kind} clients" for door, kind in chosen)
            except GuaranteeViolated as broken:
                name = type(server).__name__
                tally.violations.append(Violation(number, f"{name}, hostile clients {chosen}: {broken}"))
            finally:
                server.kill()
    return tally


def attempt(server: Server, chosen: list[tuple[str, str]], rng: Random, *, leaves: bool) -> None:
    """Run one trial: well-behaved clients are served beside hostile ones, then Ctrl-C ends the server.

    Args:
        server: A fresh server.
        chosen: The door and the kind of each group of hostile clients.
        rng: Chooses the garbage.
        leaves: Whether the hostile clients leave before Ctrl-C, and others are served after them.

    Raises:
        GuaranteeViolated: The guarantee is violated.
    """
    with contextlib.ExitStack() as stack:
        good = _connected(server, stack)
        before_kb = server.memory_kb
        hostile = [HostileClients(kind, *server.doors[door], rng) for door, kind in chosen]
        for group in hostile:
            stack.callback(group.leave)
        for _ in range(ROUNDS):
            for group in hostile:
                group.step()
            for client in good:
                client.ask()
        grown_kb = server.memory_kb - before_kb
        if grown_kb > MEMORY_LIMIT_KB:
            raise GuaranteeViolated(f"the server's memory grew by {grown_kb // 1000} MB")
        if leaves:
            for group in hostile:
                group.leave()
            for client in good:
                client.close()
            _again(server, stack)
        server.end()


def _connected(server: Server, stack: contextlib.ExitStack) -> list[WellBehavedClient]:
    """Connect well-behaved clients, each of which gets a reply; the stack closes them."""
    good = []
    for client in server.clients():
        good.append(stack.enter_context(contextlib.closing(client)))
        client.ask()
    return good


def _again(server: Server, stack: contextlib.ExitStack) -> None:
    """Connect well-behaved clients as soon as the server has noticed that the others have left."""
    deadline_s = time.monotonic() + SERVED_S
    while True:
        with contextlib.ExitStack() as attempt:
            try:
                _connected(server, attempt)
            except GuaranteeViolated:
                if time.monotonic() > deadline_s:
                    raise
            else:
                stack.push(attempt.pop_all())
                return


def host_and_port(text: str) -> Address:
    """Find host and port in an address or a line of output."""
    host, port = re.findall(r"([\d.]+):(\d+)", text)[0]
    return host, int(port)


CAMPAIGN = Campaign(
    guarantee="Whatever the clients of a server do, a well-behaved client is served beside them, the server's memory "
    "is bounded, and Ctrl-C ends it within 2 s with exit code 0.",
    unit="trials",
    count=60,
    batch=1,
    run=run,
)
