"""A page's WebSocket: sends the hub's messages, and carries out the page's."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable

import anyio
from anyio.abc import TaskGroup
from anyio.to_thread import run_sync
from starlette.websockets import WebSocket, WebSocketDisconnect, WebSocketState

from .hub import Client, Hub

Work = Callable[[], object]
"""The rest of a message's work, for a thread."""

MAX_CLIENTS = 50
"""Pages of one robot at a time."""

TRY_LATER = 1013
"""WebSocket close code "try again later". Source: the IANA registry of close codes."""


async def serve_page(
    page: WebSocket,
    hub: Hub,
    *,
    hello: Callable[[Client], dict[str, object]],
    handle: Callable[[Client, str], Work | None],
    left: Callable[[Client], None],
) -> None:
    """Serve a page until it leaves, its connection is lost (`connections.LiveWebSocket`), or it is too slow.

    Args:
        page: Its WebSocket.
        hub: Whose messages it gets.
        hello: Returns the first message; called in a thread.
        handle: Handles a message, or returns the part that reads files, which is done in a thread while the page's
            next messages are handled: a stop never waits. A ValueError says why it failed.
        left: Called at the end.
    """
    await page.accept()
    with contextlib.suppress(WebSocketDisconnect):
        if len(hub.clients) >= MAX_CLIENTS:
            await page.close(TRY_LATER, "too many pages are open")
            return
        client = Client(asyncio.get_running_loop(), hub.new_name())
        await page.send_json({"type": "hello", **await run_sync(hello, client)})
        hub.join(client)
        try:
            async with anyio.create_task_group() as both:
                both.start_soon(_send, page, client, both.cancel_scope)
                both.start_soon(_receive, page, client, handle, both)
        finally:
            hub.leave(client)
            left(client)
        if client.too_slow and page.application_state is WebSocketState.CONNECTED:
            await page.close(TRY_LATER, "this page is too slow")


async def _send(page: WebSocket, client: Client, both: anyio.CancelScope) -> None:
    with contextlib.suppress(WebSocketDisconnect):
        while not client.too_slow:
            for message in await client.next():
                if client.too_slow:
                    break
                if isinstance(message, bytes):
                    await page.send_bytes(message)
                else:
                    await page.send_text(message)
    both.cancel()


async def _receive(
    page: WebSocket, client: Client, handle: Callable[[Client, str], Work | None], both: TaskGroup
) -> None:
    working: set[Work] = set()
    with contextlib.suppress(WebSocketDisconnect):
        while page.application_state is WebSocketState.CONNECTED:  # a failed send leaves it disconnected
            message = await page.receive()
            if message["type"] == "websocket.disconnect":
                break
            try:
                if (text := message.get("text")) is None:
                    raise ValueError("Send messages as text, not as bytes.")
                if work := handle(client, text):
                    if working:
                        raise ValueError("What you started before is still being read. Try again in a moment.")
                    working.add(work)
                    both.start_soon(_do, page, work, working)
            except ValueError as error:
                await _refuse(page, error)
    both.cancel_scope.cancel()


async def _do(page: WebSocket, work: Work, working: set[Work]) -> None:
    try:
        await run_sync(work)
    except ValueError as error:
        with contextlib.suppress(WebSocketDisconnect):
            await _refuse(page, error)
    finally:
        working.remove(work)


async def _refuse(page: WebSocket, error: ValueError) -> None:
    if page.application_state is WebSocketState.CONNECTED:
        await page.send_json({"type": "refused", "text": str(error)})
