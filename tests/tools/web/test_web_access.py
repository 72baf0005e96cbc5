"""Other computers: the PIN, its sessions, its limit, and the hosts and origins that are allowed with --lan."""

from __future__ import annotations

import re

import pytest
from starlette.testclient import TestClient
from starlette.websockets import WebSocketDisconnect

from nxtdrive.tools.web.access import ATTEMPTS, WAIT_S, Pin, own_names
from tests.tools.web.pages import server_of

LAN = "http://192.168.0.7:7080"
WS = "ws://192.168.0.7:7080/ws"


class Clock:
    """Time that passes when told."""

    now_s = 1000.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def pin(clock) -> Pin:
    return Pin(clock)


@pytest.fixture
def client(tmp_path, pin) -> TestClient:
    """A browser on another computer, which reaches the server at 192.168.0.7."""
    return TestClient(server_of(tmp_path, pin=pin).app(), base_url=LAN, follow_redirects=False)


def _wrong(pin: Pin) -> str:
    return f"{(int(pin.digits) + 1) % 10**6:06}"


def test_before_the_pin_there_is_nothing_but_the_page_that_requests_it(client):
    for path in ("/", "/index.html", "/runs.html"):
        answer = client.get(path)
        assert (answer.status_code, answer.headers["location"]) == (303, "/pin.html")
    assert client.get("/pin.html").status_code == client.get("/pin.js").status_code == 200
    for path in ("/app.js", "/api/runs", "/runs/quick-001/map.png", "/api/session"):
        assert client.get(path).status_code == 401
    with pytest.raises(WebSocketDisconnect), client.websocket_connect(WS):
        pass


def test_the_pin_opens_a_session_for_one_browser(client, pin, tmp_path):
    answer = client.post("/api/session", content=pin.digits)
    assert answer.status_code == 204
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=strict" in cookie
    assert client.get("/").status_code == 200
    assert client.get("/api/session").status_code == 204
    with client.websocket_connect(WS) as page:
        assert page.receive_json()["type"] == "hello"
    cookies = dict(client.cookies)
    again = TestClient(server_of(tmp_path, pin=Pin()).app(), base_url=LAN, cookies=cookies, follow_redirects=False)
    assert again.get("/").status_code == 303, "a session ends with the program"


@pytest.mark.parametrize("cookie", ["", "x", "ä"])
def test_a_made_up_cookie_is_not_a_session(client, cookie):
    assert client.get("/api/runs", headers={"cookie": f"nxtdrive-7080={cookie}".encode()}).status_code == 401


def test_two_servers_of_one_computer_have_cookies_of_their_own(tmp_path):
    names = set()
    for port in (7080, 7081):
        pin = Pin()
        client = TestClient(server_of(tmp_path, pin=pin).app(), base_url=f"http://192.168.0.7:{port}")
        names.add(client.post("/api/session", content=pin.digits).headers["set-cookie"].split("=")[0])
    assert len(names) == 2


def test_five_wrong_pins_make_everyone_wait_a_minute(client, pin, clock):
    for _ in range(ATTEMPTS - 1):
        assert client.post("/api/session", content=_wrong(pin)).status_code == 403
    late = client.post("/api/session", content=_wrong(pin))
    assert (late.status_code, late.headers["retry-after"]) == (429, "60")
    clock.now_s += WAIT_S - 1
    refused = client.post("/api/session", content=pin.digits)
    assert refused.status_code == 429
    assert "1 second" in refused.text
    clock.now_s += 1
    assert client.post("/api/session", content=pin.digits).status_code == 204


@pytest.mark.parametrize(
    ("body", "status"), [("", 403), ("12345", 403), ("öäü\0", 403), (b"\xff", 403), ("1" * 999, 413)]
)
def test_anything_else_is_not_a_pin(client, body, status):
    assert client.post("/api/session", content=body).status_code == status


def test_a_session_stays_open_while_others_must_wait(client, pin):
    client.post("/api/session", content=pin.digits)
    for _ in range(ATTEMPTS):
        client.post("/api/session", content=_wrong(pin))
    assert client.get("/").status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({}, 200),
        ({"host": "127.0.0.1:7080"}, 200),
        ({"host": f"{min(own_names())}:7080"}, 200),
        ({"origin": LAN}, 200),
        ({"host": "192.168.0.8:7080"}, 403),
        ({"host": "evil.example"}, 403),
        ({"host": "[nonsense"}, 403),
        ({"host": ""}, 403),
        ({"origin": "http://evil.example"}, 403),
        ({"origin": "http://192.168.0.7:8000"}, 403),
    ],
)
def test_host_must_be_this_computer_and_origin_the_host(client, pin, headers, status):
    client.post("/api/session", content=pin.digits)
    cookie = "; ".join(f"{name}={value}" for name, value in client.cookies.items())
    headers = {"cookie": cookie, **headers}
    assert client.get("/", headers=headers).status_code == status
    if status == 403:
        assert client.post("/api/session", content=pin.digits, headers=headers).status_code == 403
        with pytest.raises(WebSocketDisconnect), client.websocket_connect(WS, headers=headers):
            pass


def test_without_lan_there_is_no_pin_and_only_loopback(tmp_path):
    app = server_of(tmp_path).app()
    assert TestClient(app, base_url="http://127.0.0.1:7080").get("/api/session").status_code == 204
    assert TestClient(app, base_url=LAN).get("/").status_code == 403


@pytest.mark.slow
@pytest.mark.parametrize("lan", [False, True])
def test_the_command_prints_where_the_page_is(started, lan):
    server = started("web", "--port", "0", *["--lan"] * lan)
    lines = [server.stdout.readline()]
    while lan and lines[-1] and not lines[-1].startswith("PIN"):
        lines.append(server.stdout.readline())
    server.terminate()
    assert server.stdout.read() == "ended; motors off\n"
    host = re.findall(r"http://(\S+):\d+/", lines[0])[0]
    assert lan or host == "127.0.0.1"
    if lan:
        assert re.fullmatch(r"PIN \d{6}\n", lines[-1])
        assert sum("█" in line for line in lines) > 10
