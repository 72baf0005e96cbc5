"""What state DRAWING shows besides the menus: pages that go on until a key, or the end of a file, ends them."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from sim_backend.firmware.ui.key_states import KeyStates


class Page(NamedTuple):
    """A page of the menus.

    Attributes:
        begin: Called in the pass in which it begins, or begins anew.
        go_on: Called in each pass after that.
        stays: Whether the states of the menus lead back to it, whatever key they are for.
        interrupt: Called when another state interrupts it.
    """

    begin: Callable[[], None]
    go_on: Callable[[], None]
    stays: bool = False
    interrupt: Callable[[], None] | None = None


class CurrentPage:
    """The page that is shown, or is about to begin, if there is one.

    Attributes:
        states: The states of a key, which come before it.
    """

    def __init__(self, states: KeyStates) -> None:
        self.states = states
        self._page: Page | None = None
        self._begins = False

    @property
    def exists(self) -> bool:
        """Whether there is one."""
        return self._page is not None

    @property
    def stays(self) -> bool:
        """Whether there is one to which all states of the menus lead back."""
        return self._page is not None and self._page.stays

    @property
    def begins(self) -> bool:
        """Whether it begins in the next pass that shows it."""
        return self._begins

    def shows(self, page: Page) -> bool:
        """Return whether it is a given one."""
        return self._page is page

    def open(self, page: Page, *, begins: bool = True) -> None:
        """Show a page, after the states of a key if there are any, from its beginning or as if it had begun."""
        self._page, self._begins = page, begins

    def end(self) -> None:
        """Show none."""
        self._page, self._begins = None, False

    def interrupt(self) -> None:
        """Drop the states of a key, and a page that does not stay: another state follows."""
        if self._page and self._page.interrupt:
            self._page.interrupt()
        self.states.drop()
        if not self.stays:
            self.end()

    def begin_anew(self) -> None:
        """Begin once more what stays."""
        self._begins = self._begins or self.stays

    def run(self) -> None:
        """Run a pass of it."""
        page, begins, self._begins = self._page, self._begins, False
        if page:
            (page.begin if begins else page.go_on)()
