"""A door whose connections a thread of its own serves, in an event loop."""

from __future__ import annotations

import asyncio
import threading
from abc import ABC, abstractmethod

from firmware_protocol.errors import ConfigError, system_words
from sim_backend.doors.sockets import listen


class LoopDoor(ABC):
    """Listens at once; a subclass starts the thread at the end of its initialisation.

    Args:
        name: Of the thread.
        host: Address of this computer.
        port: TCP port; 0 selects a free one.

    Raises:
        ConfigError: The port is taken or not allowed, the host is not an address of this computer, or too many files
            are open.

    Attributes:
        port: The actual port.
    """

    def __init__(self, name: str, host: str, port: int) -> None:
        self._listener = listen(host, port)
        self._listener.listen()  # a burst of connections may wait: the thread accepts more than `BACKLOG`
        self.port: int = self._listener.getsockname()[1]
        try:
            self._runner = asyncio.Runner(loop_factory=asyncio.SelectorEventLoop)
            self._loop = self._runner.get_loop()
        except OSError as error:
            self._listener.close()
            raise ConfigError(f"the {name} cannot start: {system_words(error)}.", remedy="Close files.") from error
        self._ended = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name=name)

    def close(self) -> None:
        """Disconnect everyone and free the port, without waiting for any of them; may be called again."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join()

    def _run(self) -> None:
        with self._runner:  # at its end it cancels the tasks of all connections
            self._runner.run(self._serve())

    @abstractmethod
    async def _serve(self) -> None:
        """Serve until `_ended` is set, then free the port."""
