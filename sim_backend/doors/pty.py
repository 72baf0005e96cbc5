"""A pseudo-terminal that looks like a brick's Bluetooth serial port.

Any program that opens a serial port can plug in: the driver, nxt-python, pyserial. Nothing here needs privileges.

A pseudo-terminal does not tell who has opened it, so all programs, one after the other, are one client; it arrives
with the first byte.
"""

from __future__ import annotations

import contextlib
import errno
import os
import select
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from firmware_protocol.errors import ConfigError
from firmware_protocol.framing import LENGTH_LIMIT, FrameReader
from sim_backend.doors.door import CHUNK, PARTIAL_LIMIT_S, Client, completed

UNREAD_LIMIT = 3072
"""Bytes of replies nobody has read; the terminal holds 4096, and one that is full would cut a frame in two."""


class PtyDoor:
    """A serial port under a name of the user's choice.

    When the link is lost the terminal ends, as a radio's serial port does, and a new one takes the name.

    Attributes:
        path: The name, a symbolic link to the terminal.
        address: The same, as the driver opens it.
    """

    bluetooth = True

    def __init__(self, path: Path, *, now: Callable[[], float]) -> None:
        """Make the terminal and its name.

        Args:
            path: Where the name shall stand; a symbolic link there is replaced.
            now: Seconds of a clock that never goes back.

        Raises:
            ConfigError: Something else stands there, its folder does not exist, or this system has no pseudo-terminals.
        """
        self.path = path
        self.address = f"serial://{path}"
        self._now = now
        self._terminal: Terminal | None = self._open()
        self._spoken = False

    def arrivals(self) -> list[Client]:
        """The terminal, once somebody has written to it."""
        if self._terminal is None:
            return []
        if self._terminal.closed:
            self._terminal, self._spoken = self._open(), False
        if self._spoken or not self._terminal.readable():
            return []
        self._spoken = True
        return [self._terminal]

    def fileno(self) -> int | None:
        """Our end of the terminal, until somebody has written to it."""
        return None if self._spoken or self._terminal is None else self._terminal.fileno()

    def close(self) -> None:
        """Take the name away, unless another program has it by now, and end the terminal."""
        if self._terminal is None:
            return
        terminal, self._terminal = self._terminal, None
        with contextlib.suppress(OSError):
            if os.readlink(self.path) == terminal.device:
                self.path.unlink()
        terminal.hang_up()

    def _open(self) -> Terminal:
        terminal = Terminal(str(self.path), now=self._now)
        try:
            _name(terminal.device, self.path)
        except BaseException:
            terminal.hang_up()
            raise
        return terminal


class Terminal:
    """The terminal itself; see `Client`.

    Attributes:
        device: The terminal's own name.
    """

    at_end = False

    def __init__(self, name: str, *, now: Callable[[], float]) -> None:
        self.name = name
        self.closed = False
        self._now = now
        self._frames = FrameReader(LENGTH_LIMIT)
        self._heard_s = now()
        # kept open at this end: without any open terminal the other end reads an error instead of nothing
        self._end, self._terminal = _open_terminal()
        self.device = os.ttyname(self._terminal)
        self._session = _lead_session(self.device)

    def receive(self) -> list[bytes]:
        """The telegrams that have arrived since the last call; what is no telegram is dropped, as a brick does."""
        data = self._read()
        if self._now() - self._heard_s > PARTIAL_LIMIT_S:
            self._frames.reset()
        if not data:
            return []
        self._heard_s = self._now()
        return completed(self._frames, data)

    def send(self, data: bytes) -> None:
        """Write a frame in one piece: many a program reads just once per frame. Nobody need be there to read it."""
        self._forget_unread()
        with contextlib.suppress(BlockingIOError):  # the program at the other end has stopped its terminal
            os.write(self._end, data)

    def hang_up(self) -> None:
        """End the terminal; whoever has it open reads an error."""
        if self.closed:
            return
        self.closed = True
        os.close(self._terminal)
        os.close(self._end)
        if self._session is not None:
            with self._session:
                self._session.kill()

    def readable(self) -> bool:
        """Whether somebody has written something."""
        return bool(select.select([self._end], [], [], 0)[0])

    def fileno(self) -> int:
        """Our end."""
        return self._end

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


def _open_terminal() -> tuple[int, int]:
    """Our end and the terminal itself, without echo or any other service a human would want."""
    try:
        import pty
        import tty
    except ImportError:
        raise ConfigError("this system has no pseudo-terminals.", remedy="Linux and macOS have them.") from None
    try:
        end, terminal = pty.openpty()
    except OSError as error:
        raise ConfigError(
            f"no pseudo-terminal can be had: {os.strerror(error.errno or errno.EIO)}.",
            remedy="End programs that hold some, or serve on a TCP port: nxtdrive sim serve --tcp 0.",
        ) from error
    tty.setraw(terminal)
    os.set_blocking(end, False)
    return end, terminal


def _lead_session(device: str) -> subprocess.Popen[bytes] | None:
    """A process of no other use than to have the terminal as its controlling one.

    On Linux a session's leader that opens a terminal without O_NOCTTY, as most programs do, gets it as its controlling
    terminal, unless another session has it, and is killed by SIGHUP when our end is closed. The shell below takes that
    part; it ends with us, at the end of its standard input.
    """
    if not sys.platform.startswith("linux"):
        return None
    try:
        leader = subprocess.Popen(  # noqa: S603 - a fixed command
            ["/bin/sh", "-c", ': <>"$1" && echo && read _', "sh", device],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    except OSError:  # then programs do what they do at a radio's port
        return None
    if leader.stdout is not None:
        leader.stdout.readline()  # it has the terminal now, or has failed
    return leader


def _name(device: str, path: Path) -> None:
    """Make `path` a symbolic link to `device`, at once: nobody ever sees no link or half a link."""
    if path.exists() and not path.is_symlink():
        raise ConfigError(f"{path} exists and is not a link.", remedy="Choose a name for the port that is free.")
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        fresh.symlink_to(device)
        fresh.replace(path)
    except OSError as error:
        raise ConfigError(
            f"the port cannot be named {path}: {os.strerror(error.errno or errno.EIO)}.",
            remedy="Choose a name in a folder that exists and that you may write to.",
        ) from error
