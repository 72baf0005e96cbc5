"""The thread that does the scheduled work of a link on real hardware, so that it gets done while the program waits."""

from __future__ import annotations

import logging
import math
import threading
from collections.abc import Callable

from firmware_protocol.errors import LinkError
from nxtdrive.link.core import LinkCore, LinkState
from nxtdrive.link.threads import CLOSING_S, Threads

log = logging.getLogger(__name__)


class LinkThread:
    """The thread of one link; it starts when there is work for the first time, and ends when the link is closed.

    Args:
        name: The link's address, for the log.
        work: Does the work due now; may raise LinkError.
        until_due: Returns the time until the next work, seconds.
        core: The link's state.
        threads: Starts threads and waits for them.
    """

    def __init__(
        self, name: str, work: Callable[[], None], until_due: Callable[[], float], core: LinkCore, threads: Threads
    ) -> None:
        self._name, self._work, self._until_due = name, work, until_due
        self._core, self._threads = core, threads
        self._thread: threading.Thread | None = None
        self._ident = 0
        self._starting = threading.Lock()
        self._news = threading.Event()

    @property
    def current(self) -> bool:
        """Whether this is the calling thread."""
        return threading.get_ident() == self._ident

    def wake(self) -> None:
        """Wake the thread to check the schedule, which has changed; start it if necessary."""
        self._news.set()
        if self._thread is None and self._core.state is not LinkState.CLOSED:
            with self._starting:
                self._thread = self._thread or self._threads.start(self._run, "nxtdrive link")

    def join(self) -> None:
        """Wait until the thread has noticed that the link is closed; at most 2 s, as it may be reopening the link."""
        if self._thread is not None:
            self._threads.join(self._thread, CLOSING_S)

    def _run(self) -> None:
        self._ident = threading.get_ident()
        while self._core.state is not LinkState.CLOSED:
            self._news.clear()
            pause_s = self._until_due()
            if pause_s > 0:
                self._threads.wait(self._news, None if math.isinf(pause_s) else pause_s)
            try:
                self._work()
            except LinkError:
                pass  # the program's next request meets the same error and can handle it
            except Exception:  # leases and motions depend on this thread, so it survives a defect
                log.exception("unexpected error in the thread of %s", self._name)
