"""Who may open the page: no other web site, and from the network only browsers whose user has entered the PIN."""

from __future__ import annotations

import contextlib
import ipaddress
import secrets
import socket
import time
from collections.abc import Callable
from urllib.parse import urlsplit

from starlette.datastructures import MutableHeaders
from starlette.requests import HTTPConnection, Request
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from starlette.websockets import WebSocket

ATTEMPTS, WAIT_S = 5, 60.0
"""After this many wrong PINs no PIN is accepted for this time; a million PINs would take more than 100 days."""
PIN_PAGE = "/pin.html"
SESSION = "/api/session"
OPEN_PATHS = frozenset({PIN_PAGE, "/pin.js", "/style.css", SESSION})
"""What a browser may fetch without a session."""
MAX_PIN_BYTES = 64
POLICIES = {
    # a page within one of another site could be clicked on unawares
    "content-security-policy": "frame-ancestors 'none'",
    # a script of the last version could meet one of this version
    "cache-control": "no-cache",
}
"""Headers of all responses."""


def own_names() -> frozenset[str]:
    """Return the names by which other computers may address this one."""
    name = socket.gethostname().lower()
    return frozenset({name, f"{name.split('.')[0]}.local"})


class SameSite:
    """Refuses requests that other web sites make through the user's browser, and adds `POLICIES` to all responses.

    The host must be this server by an address or a name of its own, which also refuses names that were rebound to this
    computer; the origin, which browsers send with every WebSocket, must be the same host.

    Args:
        app: The guarded application.
        lan: Whether the address at which a request arrived, and this computer's names, are allowed besides loopback.
    """

    def __init__(self, app: ASGIApp, *, lan: bool = False) -> None:
        self._app = app
        self._lan = lan
        self._names = {"localhost"} | (own_names() if lan else frozenset())

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or refuse it with 403."""
        if scope["type"] in ("http", "websocket"):
            headers = HTTPConnection(scope).headers
            host, origin = headers.get("host", ""), headers.get("origin")
            if not self._known(host, scope) or (origin is not None and _host_of(origin) != host):
                await _refuse(scope, receive, send, "This page is not for other web sites.", 403)
                return
        await self._app(scope, receive, _with_policies(send))

    def _known(self, host: str, scope: Scope) -> bool:
        with contextlib.suppress(ValueError):
            name = urlsplit(f"//{host}").hostname or ""
            if name in self._names:
                return True
            address = ipaddress.ip_address(name)
            return address.is_loopback or (self._lan and address == ipaddress.ip_address(scope["server"][0]))
        return False


class Pin:
    """A PIN of six digits, and the sessions of those who entered it; both end with the program.

    Args:
        now: Monotonic time in seconds.
    """

    def __init__(self, now: Callable[[], float] = time.monotonic) -> None:
        self.digits = f"{secrets.randbelow(10**6):06}"
        self._now = now
        self._sessions: set[str] = set()
        self._wrong = 0
        self._closed_until_s = -WAIT_S

    @property
    def wait_s(self) -> float:
        """How long no PIN is accepted, right or wrong; 0 when one may be tried."""
        return max(0.0, self._closed_until_s - self._now())

    def enter(self, digits: str) -> str | None:
        """Return a new session's secret, or None for a wrong PIN and while no PIN is accepted."""
        if self.wait_s:
            return None
        if not secrets.compare_digest(digits.encode(), self.digits.encode()):
            self._wrong += 1
            if self._wrong == ATTEMPTS:
                self._wrong, self._closed_until_s = 0, self._now() + WAIT_S
            return None
        session = secrets.token_urlsafe()
        self._sessions.add(session)
        return session

    def admits(self, connection: HTTPConnection) -> bool:
        """Return whether a request belongs to a session."""
        return connection.cookies.get(_cookie(connection)) in self._sessions

    async def answer(self, request: Request) -> Response:
        """Answer a request that enters a PIN, or that asks whether it has a session."""
        if request.method == "GET":
            return Response(status_code=204 if self.admits(request) else 401)
        body = b""
        async for part in request.stream():
            body += part
            if len(body) > MAX_PIN_BYTES:
                return PlainTextResponse("A PIN has six digits.\n", 413)
        session = self.enter(body.decode(errors="replace").strip())
        if session is not None:
            answer = Response(status_code=204)
            answer.set_cookie(_cookie(request), session, httponly=True, samesite="strict")
            return answer
        if wait_s := self.wait_s:
            text = f"Too many wrong PINs. Wait {wait_s:.0f} seconds and try again.\n"
            return PlainTextResponse(text, 429, {"retry-after": f"{wait_s:.0f}"})
        return PlainTextResponse("This is not the PIN. It is shown where nxtdrive web was started.\n", 403)


class PinGate:
    """Admits only browsers whose user has entered the PIN.

    Args:
        app: The guarded application.
        pin: The PIN and its sessions.
    """

    def __init__(self, app: ASGIApp, pin: Pin) -> None:
        self._app = app
        self._pin = pin

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, show the page for the PIN in place of another page, or refuse with 401."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        path = scope["path"]
        if self._pin.admits(connection) or (scope["type"] == "http" and path in OPEN_PATHS):
            await self._app(scope, receive, send)
        elif scope["type"] == "http" and scope["method"] == "GET" and path.endswith(("/", ".html")):
            await RedirectResponse(PIN_PAGE, 303)(scope, receive, send)
        else:
            await _refuse(scope, receive, send, f"Enter the PIN first: open {PIN_PAGE} in the browser.", 401)


def _with_policies(send: Send) -> Send:
    async def send_with_policies(message: Message) -> None:
        if message["type"] == "http.response.start":
            MutableHeaders(scope=message).update(POLICIES)
        await send(message)

    return send_with_policies


def _host_of(origin: str) -> str:
    """Return the host, with its port, of an origin; an empty text if it has none."""
    try:
        return urlsplit(origin).netloc
    except ValueError:
        return ""


def _cookie(connection: HTTPConnection) -> str:
    """Return the cookie's name, with the port in it: browsers keep one jar for all ports of a computer."""
    return f"nxtdrive-{connection.scope['server'][1]}"


async def _refuse(scope: Scope, receive: Receive, send: Send, text: str, status: int) -> None:
    if scope["type"] == "websocket":
        await WebSocket(scope, receive, send).close()
    else:
        await PlainTextResponse(f"{text}\n", status)(scope, receive, send)
