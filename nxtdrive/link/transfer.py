"""Transfers of several telegrams that are right or fail, also over a link that delivers a reply twice."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

from firmware_protocol.errors import RemoteProtocolError
from nxtdrive.link.protocol import RequestLink

ATTEMPTS = 3

T = TypeVar("T")


def in_step(link: RequestLink, transfer: Callable[[], T]) -> T:
    """Return what `transfer` returns, and repeat it if a reply arrived meanwhile that belongs to no request.

    Replies have no numbers. After one that arrived twice, each reply may be taken for the answer to the next request,
    such as the next piece of a file, until a request of another kind is answered. So `transfer` ends with one.

    Args:
        link: The link that `transfer` uses.
        transfer: Makes requests that may be repeated; the reply to the last one does not look like those before it.

    Raises:
        RemoteProtocolError: Surplus replies arrived in each attempt.
    """
    for _ in range(ATTEMPTS):
        before = link.surplus
        result = transfer()
        if link.surplus == before:
            return result
    raise RemoteProtocolError(
        "replies arrive that belong to no request, so what was read is not reliable",
        remedy="Connect again, or use the cable.",
    )
