"""A guest or a world of the rig that hangs is reported within the time limit."""

import contextlib
import json
import socketserver
import threading

import pytest

from nxtdrive.tools.rig import rig as rig_module
from nxtdrive.tools.rig.errors import RigError
from nxtdrive.tools.rig.rig import Rig

CHATTER = json.dumps({"out": "more "}).encode() + b"\n"
LIMIT_S = 0.1


class Mute(socketserver.StreamRequestHandler):
    """Hears a request and never answers."""

    def handle(self):
        self.rfile.readline()
        self.rfile.readline()  # until the other side gives up


class Chatty(socketserver.StreamRequestHandler):
    """Puts out text without end."""

    def handle(self):
        with contextlib.suppress(ConnectionError):
            while True:
                self.wfile.write(CHATTER)


@pytest.fixture
def rig(request, tmp_path, monkeypatch):
    """A rig whose guest is a server."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.setattr(rig_module, "REPORT_TIMEOUT_S", 0.0)
    (tmp_path / "nxtdrive/rig/run").mkdir(parents=True)
    (tmp_path / "nxtdrive/rig/run/test.guest.log").write_text("[ 20.1] kernel BUG at lib/list_debug.c:56!\n")
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), request.param) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        port = server.server_address[1]
        ports = {"agent": port, "control": port, "usb": 0, "webcam": 0, "bluetooth": 0}
        yield Rig(guest=0, world=0, options=[], linux="6.1.192", name="test", **ports)
        server.shutdown()
        thread.join()


@pytest.mark.parametrize("rig", [Mute, Chatty], indirect=True)
def test_a_command_that_does_not_end_is_reported_with_the_kernels_failure(rig):
    with pytest.raises(RigError, match=r"does not answer.*Its kernel failed: kernel BUG.*test\.guest\.log"):
        rig.run("nxtdrive info", timeout_s=LIMIT_S)


@pytest.mark.parametrize("rig", [Mute], indirect=True)
def test_a_kernel_that_has_failed_is_recognised(rig):
    assert rig.broken
