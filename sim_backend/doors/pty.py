"""A pseudo-terminal that looks like a brick's Bluetooth serial port.

Any program that opens a serial port can plug in: the driver, nxt-python, pyserial. Nothing here needs privileges.

Programs that open the port without O_NOCTTY and lead a session get it as their controlling terminal, and the end of
the link then ends them by SIGHUP: stop them first, the door last.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import sys
from collections.abc import Callable
from pathlib import Path

from firmware_protocol.errors import ConfigError, RemoteProtocolError
from firmware_protocol.framing import FrameReader, frame

PARTIAL_LIMIT_S = 0.5
"""A telegram whose rest has not come by then belongs to a program that died; the next one's must not complete it."""

UNREAD_LIMIT = 3072
"""Bytes of replies nobody has read; the terminal holds 4096, and one that is full would cut a frame in two."""

CHUNK = 4096


class PtyDoor:
    """A serial port under a name of the user's choice, for one program after the other.

    Attributes:
        path: The name, a symbolic link to the terminal.
    """

    def __init__(self, path: Path, *, now: Callable[[], float]) -> None:
        """Make the terminal and its name.

        Args:
            path: Where the name shall stand; a symbolic link there is replaced.
            now: Seconds of a clock that never goes back.

        Raises:
            ConfigError: Something else stands there, its folder does not exist, or this system has no pseudo-terminals.
        """
        self.path = path
        self._now = now
        self._frames = FrameReader()
        self._heard_s = now()
        # kept open at this end: without any open terminal the other end reads an error instead of nothing
        self._end, self._terminal = _open_terminal()
        try:
            self._device = os.ttyname(self._terminal)
            _name(self._device, path)
        except BaseException:
            self._close_terminal()
            raise

    def receive(self) -> list[bytes]:
        """The telegrams that have arrived since the last call; what is no telegram is dropped, as a brick does."""
        data = self._read()
        if self._now() - self._heard_s > PARTIAL_LIMIT_S:
            self._frames.reset()
        if not data:
            return []
        self._heard_s = self._now()
        self._frames.feed(data)
        telegrams = []
        with contextlib.suppress(RemoteProtocolError):  # no telegram; the reader has dropped it
            while (telegram := self._frames.next()) is not None:
                telegrams.append(telegram)
        return telegrams

    def send(self, reply: bytes) -> None:
        """Write a reply in one piece: many a program reads just once per frame. Nobody need be there to read it."""
        self._forget_unread()
        with contextlib.suppress(BlockingIOError):  # the program at the other end has stopped its terminal
            os.write(self._end, frame(reply))

    def wait(self, duration_s: float) -> bool:
        """Rest, but not longer than until something arrives; whether something has."""
        return bool(select.select([self._end], [], [], max(0.0, duration_s))[0])

    def close(self) -> None:
        """Take the name away, unless another program has it by now, and end the terminal."""
        if self._end < 0:
            return
        with contextlib.suppress(OSError):
            if os.readlink(self.path) == self._device:
                self.path.unlink()
        self._close_terminal()

    def _read(self) -> bytes:
        try:
            return os.read(self._end, CHUNK)
        except BlockingIOError:
            return b""

    def _forget_unread(self) -> None:
        """Throw the replies away that a program left behind, lest the next one takes them for its own."""
        import fcntl
        import termios

        unread = bytearray(4)
        fcntl.ioctl(self._terminal, termios.FIONREAD, unread)
        if int.from_bytes(unread, sys.byteorder) > UNREAD_LIMIT:
            termios.tcflush(self._terminal, termios.TCIFLUSH)

    def _close_terminal(self) -> None:
        os.close(self._terminal)
        os.close(self._end)
        self._end = self._terminal = -1


def _open_terminal() -> tuple[int, int]:
    """Our end and the terminal itself, without echo or any other service a human would want."""
    try:
        import pty
        import tty
    except ImportError:
        raise ConfigError("this system has no pseudo-terminals.", remedy="Linux and macOS have them.") from None
    end, terminal = pty.openpty()
    tty.setraw(terminal)
    os.set_blocking(end, False)
    return end, terminal


def _name(device: str, path: Path) -> None:
    """Make `path` a symbolic link to `device`, at once: nobody ever sees no link or half a link."""
    if path.exists() and not path.is_symlink():
        raise ConfigError(f"{path} exists and is not a link.", remedy="Choose a name for the port that is free.")
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        fresh.symlink_to(device)
        fresh.replace(path)
    except OSError as error:
        raise ConfigError(f"the port cannot be named {path}: {os.strerror(error.errno or errno.EIO)}.") from error
