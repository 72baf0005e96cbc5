"""Memory that a campaign uses, as Python allocates it."""

from __future__ import annotations

import gc
import tracemalloc
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from itertools import pairwise


@contextmanager
def traced() -> Iterator[Callable[[], int]]:
    """Trace allocations within the block; yield a function that returns the bytes in use."""
    tracemalloc.start()

    def used() -> int:
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    try:
        yield used
    finally:
        tracemalloc.stop()


def least_growth(steps: Iterable[Callable[[], object]]) -> int:
    """Run the steps one after the other; return the least number of bytes that any but the first leaves in use.

    A leak leaves something behind with each step; a cache that is filled once, or another thread of the process, does
    not.
    """
    with traced() as used:
        in_use = [(step(), used())[1] for step in steps]
    return min(after - before for before, after in pairwise(in_use))
