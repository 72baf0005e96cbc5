"""The campaign `servers`: some of its trials, and proof that it finds a server that violates its guarantee."""

from __future__ import annotations

import sys
from random import Random

import pytest

from nxtdrive.tools.dev.faults import servers

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc and pseudo-terminals")

DEAF = """
import signal, socket
signal.signal(signal.SIGINT, signal.SIG_IGN)
with socket.create_server(("127.0.0.1", 0)) as listener:
    print("serving 127.0.0.1:%d" % listener.getsockname()[1], flush=True)
    connections = []
    while True:
        connections.append(listener.accept())
        connections[-1][0].{does}
"""
"""A server that does one thing to its clients and ignores Ctrl-C."""


class Deaf(servers.Server):
    """`DEAF` in a process."""

    def __init__(self, does: str) -> None:
        super().__init__([sys.executable, "-c", DEAF.format(does=does)])
        self._address = servers.host_and_port(self.first_line())
        self.doors = {"line": (self._address, b"why\n")}

    def clients(self):
        yield servers.Agent(self._address)


SLOW = [pytest.param(number, marks=pytest.mark.slow) for number in (0, 2, 3)]


@pytest.mark.parametrize("number", [1, *SLOW])
def test_the_guarantee_is_kept(number):
    tally = servers.run(0, range(number, number + 1))
    assert tally.violations == []
    assert tally.outcomes.total()


@pytest.mark.parametrize(
    ("does", "violation"),
    [
        ("fileno()", "got no reply"),
        ("close()", "was disconnected|got no reply"),
        ("sendall(b'1\\n' * 1000)", "Ctrl-C did not end the server"),
    ],
)
def test_a_server_that_violates_the_guarantee_is_found(monkeypatch, does, violation):
    monkeypatch.setattr(servers, "SERVED_S", 0.2)
    monkeypatch.setattr(servers, "END_S", 0.2)
    server = Deaf(does)
    try:
        with pytest.raises(servers.GuaranteeViolated, match=violation):
            servers.attempt(server, [("line", "silent")], Random(0), leaves=False)
    finally:
        server.kill()
