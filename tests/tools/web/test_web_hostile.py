"""Clients that send what the page never sends: each gets a reply, and none causes a traceback on the terminal."""

from __future__ import annotations

import asyncio
import logging
import os
import signal
import socket
import threading
from contextlib import ExitStack, closing, suppress
from http.client import HTTPConnection
from pathlib import Path

import pytest
from starlette.applications import Starlette
from starlette.routing import WebSocketRoute
from starlette.testclient import TestClient
from starlette.websockets import WebSocket, WebSocketDisconnect
from websockets.exceptions import ConnectionClosed
from websockets.frames import CloseCode
from websockets.sync.client import connect

from behaviors.mission import Mission
from nxtdrive.signals import signals_as_interrupt
from nxtdrive.tools.web import connections, hub
from nxtdrive.tools.web.access import Pin
from nxtdrive.tools.web.app import http_server, run_until_signal, serving
from nxtdrive.tools.web.hub import BACKLOG, BEHIND, FRAME, Client, Hub
from nxtdrive.tools.web.missions import Missions
from nxtdrive.tools.web.photographs import NewTarget, text_for
from tests.tools.web.pages import HANDSHAKE, client_of, refusal, server_of, told

LONG = "x" * 300
"""No file can have this name."""


@pytest.fixture
def client(tmp_path) -> TestClient:
    return client_of(server_of(tmp_path))


@pytest.mark.parametrize("origin", ["http://[::1", "http://[x]", "http://[]:1", "//", "\xff"])
def test_an_origin_that_is_not_an_address_is_refused(client, origin):
    assert client.get("/", headers={"origin": origin.encode("latin-1")}).status_code == 403


@pytest.mark.parametrize("path", [f"/api/runs/{LONG}", f"/runs/{LONG}/map.png", "/api/runs/a%00b", "/runs/%00/map.png"])
def test_a_run_no_folder_can_be_called_is_not_there(client, tmp_path, path):
    (tmp_path / "runs").mkdir()
    assert client.get(path).status_code == 404


def test_a_message_of_bytes_is_refused_and_the_page_stays(client):
    with client.websocket_connect("/ws") as page:
        page.receive_json()
        page.send_bytes(b'{"type": "stop"}')
        assert page.receive_json() == {"type": "refused", "text": "Send messages as text, not as bytes."}
        page.send_text("{}")
        assert page.receive_json()["type"] == "refused"


@pytest.mark.parametrize(
    ("method", "path"),
    [("POST", "/api/check"), ("PUT", "/api/missions/a.toml"), ("POST", "/api/targets"), ("POST", "/api/session")],
)
def test_a_client_that_leaves_in_the_middle_of_a_request_is_not_a_failure(tmp_path, method, path):
    messages = iter(({"type": "http.request", "body": b"{", "more_body": True}, {"type": "http.disconnect"}))
    headers = [(b"host", b"192.168.0.7:7080")]
    pin = Pin()
    if path != "/api/session":
        headers.append((b"cookie", f"nxtdrive-7080={pin.enter(pin.digits)}".encode()))
    scope = {"type": "http", "method": method, "path": path, "query_string": b"", "headers": headers}

    async def receive():
        return next(messages)

    async def send(_message):
        pass

    app = server_of(tmp_path, pin=pin).app()
    asyncio.run(app(scope | {"server": ("192.168.0.7", 7080), "client": ("192.168.0.8", 1)}, receive, send))
    assert os.listdir(tmp_path) == []


NO_UTF8 = UnicodeDecodeError("utf-8", b"\xff", 0, 1, "")


@pytest.mark.parametrize(("fault", "kept"), [(NO_UTF8, False), (KeyError(), True)])
def test_text_that_is_not_utf8_is_logged_without_a_traceback(tmp_path, fault, kept):
    http_server(server_of(tmp_path).app())
    log = logging.getLogger("uvicorn.error")
    record = log.makeRecord(log.name, logging.ERROR, "", 0, "Invalid UTF-8", (), (type(fault), fault, None))
    assert log.filter(record)
    assert bool(record.exc_info) is kept


@pytest.mark.parametrize("transport", [True, False], ids=["a client that vanished", "anything else"])
def test_writes_to_a_client_that_vanished_are_not_logged(tmp_path, caplog, transport):
    http_server(server_of(tmp_path).app())

    async def write():
        ours, theirs = socket.socketpair()
        _, writer = await asyncio.open_connection(sock=ours)
        theirs.close()
        for _ in range(20):
            writer.write(b"x")
        writer.transport.abort()

    if transport:
        asyncio.run(write())
    else:
        logging.getLogger("asyncio").warning("a slow callback")
    assert [record.message for record in caplog.records] == ([] if transport else ["a slow callback"])


@pytest.mark.parametrize("answered_first", [False, True])
def test_a_request_whose_body_breaks_the_protocol_is_not_a_failure(tmp_path, capsys, caplog, answered_first):
    with socket.create_server(("127.0.0.1", 0)) as listener, serving(server_of(tmp_path), listener):
        head = b"GET / HTTP/1.1\r\nHost: another.site\r\nTransfer-Encoding: chunked\r\n\r\n"
        with closing(socket.create_connection(listener.getsockname())) as client:
            if answered_first:
                client.sendall(head)
                assert client.recv(12) == b"HTTP/1.1 403"
                head = b""
            client.sendall(head + b"no length\r\n")
            while client.recv(4096):
                pass
    assert "Traceback" not in capsys.readouterr().err
    assert not [record.message for record in caplog.records if record.exc_info]


def test_a_page_that_breaks_the_protocol_counts_as_gone_at_once(tmp_path):
    late: list[BaseException] = []

    async def serve(page: WebSocket) -> None:
        await page.accept()
        assert (await page.receive())["type"] == "websocket.disconnect"
        try:
            await page.send_text("too late")
        except BaseException as error:  # noqa: BLE001 - its type is the test
            late.append(error)

    http = http_server(Starlette(routes=[WebSocketRoute("/ws", serve)]))
    with socket.create_server(("127.0.0.1", 0)) as listener:
        server = threading.Thread(target=http.run, args=([listener],))
        server.start()
        port = listener.getsockname()[1]
        with closing(socket.create_connection(("127.0.0.1", port))) as client:
            client.sendall(HANDSHAKE.format(port=port).encode())
            assert client.recv(4096).startswith(b"HTTP/1.1 101")
            client.sendall(b"\x83\x80\0\0\0\0")  # a kind of frame that does not exist
            while client.recv(4096):
                pass
        http.should_exit = True
        server.join()
    assert [type(error) for error in late] == [WebSocketDisconnect]


def _stalled_page(port: int) -> socket.socket:
    """A page that takes the wheel and then neither reads nor answers, as on a computer that sleeps."""
    page = socket.create_connection(("127.0.0.1", port))
    page.sendall(HANDSHAKE.format(port=port).encode())
    drive = b'{"type": "drive", "ahead": 0, "turn": 0}'
    page.sendall(bytes((0x81, 0x80 | len(drive), 0, 0, 0, 0)) + drive)
    return page


@pytest.mark.parametrize("picture_bytes", [1, 30_000_000], ids=["little to send", "more than the system buffers"])
def test_a_page_that_does_not_read_loses_its_place_and_the_control(tmp_path, monkeypatch, picture_bytes):
    monkeypatch.setattr(connections, "PING_S", 0.2)
    monkeypatch.setattr(connections, "PONG_S", 0.2)
    server = server_of(tmp_path)
    gone = threading.Event()
    server.hub.leave = lambda client: (Hub.leave(server.hub, client), gone.set())
    server.hub.show_image(FRAME, 1, 0.0, bytes(picture_bytes))
    with socket.create_server(("127.0.0.1", 0)) as listener, serving(server, listener):
        port = listener.getsockname()[1]
        with closing(_stalled_page(port)):
            assert gone.wait(10)
            assert server.hub.clients == []
            with client_of(server).websocket_connect("/ws") as other:
                other.send_json({"type": "take_control"})
                told(other, "control", driver="page 2")


def test_a_page_that_falls_too_far_behind_is_closed_and_may_come_again(tmp_path, monkeypatch):
    server = server_of(tmp_path)
    monkeypatch.setattr(hub, "BEHIND", -BACKLOG)  # one event is too many
    with client_of(server).websocket_connect("/ws") as page:
        assert page.receive_json()["type"] == "hello"
        server.hub.publish("line", {"text": ""})
        while (message := page.receive())["type"] != "websocket.close":
            pass
        assert message["code"] == CloseCode.TRY_AGAIN_LATER


@pytest.mark.parametrize("leaves_at", ["websocket.send", "websocket.close"])
def test_a_page_that_leaves_while_it_is_greeted_or_closed_is_not_a_failure(tmp_path, monkeypatch, leaves_at):
    server = server_of(tmp_path)
    server.hub.publish("line", {"text": ""})
    monkeypatch.setattr(hub, "BEHIND", -BACKLOG)  # so that it is closed as soon as it is greeted
    sent = []

    async def converse() -> None:
        said = iter([{"type": "websocket.connect"}])

        async def receive():
            return next(said, None) or await asyncio.Event().wait()

        async def send(message):
            sent.append(message["type"])
            if message["type"] == leaves_at:
                raise OSError

        host = [(b"host", b"127.0.0.1:7080")]
        scope = {"type": "websocket", "path": "/ws", "query_string": b"", "headers": host, "subprotocols": []}
        await server.app()(scope | {"scheme": "ws", "server": ("127.0.0.1", 7080)}, receive, send)

    asyncio.run(converse())
    assert sent[-1] == leaves_at
    assert server.hub.clients == []


def test_a_client_that_asks_without_reading_keeps_no_more_than_its_backlog():
    async def ask() -> int:
        client = Client(asyncio.get_running_loop(), "page 1")
        for _ in range(BACKLOG + 2 * BEHIND):
            client.append("answer")
        return client.waiting

    assert asyncio.run(ask()) <= BACKLOG + BEHIND + 1


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes in the file system")
def test_only_regular_files_of_a_missions_size_are_read_for_the_list(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "endless.toml").symlink_to("/dev/zero")
    (tmp_path / "long.toml").write_text("[mission]\n" + "# long\n" * 100_000)
    (tmp_path / "cat.toml").write_text("[mission]\n")
    assert Missions(tmp_path).names() == ["cat.toml"]
    with pytest.raises(ValueError, match="regular"):
        Missions(tmp_path).save("pipe.toml", "", "")


@pytest.mark.parametrize(
    "text",
    [
        "[mission]\ntargets = [1]\ntargets = 2",
        "[mission]\ntargets = []\n[mission.targets.x]",
        "[mission]\ntargets = 'a'",
        "mission = 1",
        "[[mission]]\ntargets = []",
        "[x]\nmission.targets = []",
        "x = " + "[" * 5000,
        ".".join("a" * 100) + " = 1\n",
    ],
)
def test_a_target_is_not_added_to_a_text_without_a_list_of_targets(text):
    with pytest.raises(ValueError, match="cannot be added to this text"):
        text_for(NewTarget(text=text, name="cat", height_mm=100, picture=1, box=(0, 0, 9, 9)), "cat.png")


def test_a_target_is_added_to_a_text_with_a_byte_order_mark():
    target = NewTarget(text="\ufeff[mission]\ntargets = []\n", name="cat", height_mm=100, picture=1, box=(0, 0, 9, 9))
    assert text_for(target, "cat.png").startswith('[mission]\ntargets = ["cat"]')


def test_silent_connections_take_no_place_from_a_page(tmp_path, monkeypatch):
    """Before there was a limit, a thousand of them left the server no file to open, and it ended."""
    monkeypatch.setattr(connections, "MAX_CONNECTIONS", 3)
    with socket.create_server(("127.0.0.1", 0)) as listener, ExitStack() as stack:
        host, port = listener.getsockname()
        stack.enter_context(serving(server_of(tmp_path), listener))
        silent = [stack.enter_context(socket.create_connection((host, port))) for _ in range(9)]
        with closing(HTTPConnection(host, port, timeout=5)) as page:
            page.request("GET", "/api/missions")
            assert page.getresponse().status == 200
        assert [_is_closed(each) for each in silent] == [True] * 7 + [False] * 2


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGHUP", "SIGTERM"])
def test_a_signal_ends_the_server_in_good_order_while_a_page_is_open(tmp_path, name, capsys):
    left = []

    def visit(port: int) -> None:
        with connect(f"ws://127.0.0.1:{port}/ws") as page:
            page.recv()
            os.kill(os.getpid(), getattr(signal, name))
            with suppress(ConnectionClosed):
                while page.recv():
                    pass
            left.append(page.close_code)

    with socket.create_server(("127.0.0.1", 0)) as listener, signals_as_interrupt(), suppress(KeyboardInterrupt):
        visitor = threading.Thread(target=visit, args=(listener.getsockname()[1],))
        visitor.start()
        run_until_signal(http_server(server_of(tmp_path).app()), listener)
    visitor.join()
    assert left == [CloseCode.SERVICE_RESTART]
    assert capsys.readouterr().err == ""


def test_a_ctrl_c_while_the_server_begins_ends_it(tmp_path, monkeypatch, capsys):
    http = http_server(server_of(tmp_path).app())
    run = http.run

    def interrupted(**options: object) -> None:
        signal.raise_signal(signal.SIGINT)
        run(**options)

    monkeypatch.setattr(http, "run", interrupted)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        run_until_signal(http, listener)
    assert capsys.readouterr().err == ""


def test_a_robot_can_be_closed_before_it_is_opened(tmp_path):
    """As a signal does that comes in between."""
    server_of(tmp_path).robot.close()


class OnASlowDisk(Missions):
    """Mission files that take long to read."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.reading, self.arrived = threading.Event(), threading.Event()

    def load(self, name: str, profile: str | None = None) -> Mission:
        self.reading.set()
        assert self.arrived.wait(5)
        return super().load(name, profile)


@pytest.mark.parametrize("ending", ["stop", "stop_mission"])
def test_a_stop_does_not_wait_for_a_mission_that_is_being_read(tmp_path, ending):
    server = server_of(tmp_path)
    server.missions = disk = OnASlowDisk(tmp_path)
    with client_of(server).websocket_connect("/ws") as page:
        page.send_json({"type": "start_mission"})
        assert disk.reading.wait(5)
        page.send_json({"type": ending})
        page.send_json({"type": "start_mission"})
        assert "still being read" in refusal(page), "so the ending has been obeyed"
        disk.arrived.set()
        assert "ended before it began" in refusal(page)
    assert not server.robot.busy


def _is_closed(connection: socket.socket) -> bool:
    connection.settimeout(0.02)
    try:
        return not connection.recv(1)
    except TimeoutError:
        return False
    except ConnectionError:
        return True
