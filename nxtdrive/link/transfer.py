"""Transfers of several telegrams that are right or fail, even over a link that delivers a reply twice."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeVar

from firmware_protocol.errors import RemoteProtocolError
from nxtdrive.link.link import Link

ATTEMPTS = 3

T = TypeVar("T")


def pieces(size: int, limit: int) -> Iterator[tuple[int, int]]:
    """Split `size` bytes into pieces of at most `limit`: start and length of each.

    Successive pieces differ in length, which distinguishes a duplicate from the next piece.
    """
    start = before = 0
    while start < size:
        length = min(limit, size - start)
        before = length - (length == before)
        yield start, before
        start += before


def in_step(link: Link, transfer: Callable[[], T]) -> T:
    """Return the result of `transfer`; repeat it if the result is wrong, or a reply belongs to no request.

    Replies have no sequence numbers. After a duplicate, each reply may be taken for the answer to the next request,
    such as the next piece of a file, until a request of another kind is answered. So `transfer` ends with one.

    Args:
        link: The link that `transfer` uses.
        transfer: Makes requests that may be repeated; the reply to the last one does not look like those before it.

    Raises:
        RemoteProtocolError: No attempt succeeded.
    """
    for attempt in range(1, ATTEMPTS + 1):
        before = link.surplus_telegrams
        try:
            result = transfer()
        except RemoteProtocolError:
            if attempt == ATTEMPTS:
                raise
        else:
            if link.surplus_telegrams == before:
                return result
    raise RemoteProtocolError(
        "replies arrive that belong to no request, so what was read is not reliable",
        remedy="Connect again, or use the cable.",
    )
