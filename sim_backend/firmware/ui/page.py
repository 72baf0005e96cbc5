"""What state DRAWING shows besides the menus: pages that go on until a key, or the end of a file, ends them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


class Page(NamedTuple):
    """A page of the menus.

    Attributes:
        begin: Called in the pass in which it begins, or begins anew.
        go_on: Called in each pass after that.
        stays: Whether the states of the menus lead back to it, whatever key they are for.
    """

    begin: Callable[[], None]
    go_on: Callable[[], None]
    stays: bool = False
