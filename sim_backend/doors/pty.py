"""A pseudo-terminal that looks like a brick's Bluetooth serial port.

Any program that opens a serial port can connect: the driver, nxt-python, pyserial. No privileges are needed.

A pseudo-terminal does not report when it is opened, so successive programs are one client, which connects with the
first byte.
"""

from __future__ import annotations

import contextlib
import errno
import logging
import math
import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

from firmware_protocol.errors import ConfigError
from firmware_protocol.framing import LENGTH_LIMIT, FrameReader
from sim_backend.doors.door import CHUNK, PARTIAL_LIMIT_S, Client, completed, wait_readable

UNREAD_LIMIT = 3072
"""Limit of unread reply bytes; the terminal holds 4096, and a full one would split a frame."""

REOPEN_S = 1.0
"""Pause between attempts to make a new terminal."""

log = logging.getLogger(__name__)


class PtyDoor:
    """A serial port with a name of the user's choice.

    When the link is lost the terminal is closed, like a Bluetooth serial port, and a new one takes the name.

    Attributes:
        path: The name, a symbolic link to the terminal.
        address: The driver's address for it.
    """

    bluetooth = True

    def __init__(self, path: Path, *, now: Callable[[], float]) -> None:
        """Make the terminal and its name.

        Args:
            path: Path of the name; a symbolic link left behind is replaced.
            now: Returns seconds of a monotonic clock.

        Raises:
            ConfigError: The path is not a link or that of another program's terminal, its folder does not exist, or the
                system has no pseudo-terminals.
        """
        _refuse_terminal(path)
        self.path = path
        self.address = f"serial://{path}"
        self._now = now
        self._terminal: Terminal | None = self._open()
        self._spoken = False
        self._failed_s = -math.inf

    def accept(self) -> list[Client]:
        """Return the terminal, once a program has written to it."""
        if self._terminal is None:
            return []
        if self._terminal.closed:
            self._reopen()
        if self._terminal.closed or self._spoken or not self._terminal.readable():
            return []
        self._spoken = True
        return [self._terminal]

    def fileno(self) -> int | None:
        """Return our end of the terminal, until a program has written to it."""
        return None if self._spoken or self._terminal is None else self._terminal.fileno()

    def close(self) -> None:
        """Remove the name, unless another program has replaced it, and close the terminal."""
        if self._terminal is None:
            return
        terminal, self._terminal = self._terminal, None
        with contextlib.suppress(OSError):
            if os.readlink(self.path) == terminal.device:
                self.path.unlink()
        terminal.disconnect()

    def _reopen(self) -> None:
        """Make a new terminal; if that fails, say so once, and try again later."""
        if self._now() - self._failed_s < REOPEN_S:
            return
        try:
            self._terminal, self._spoken = self._open(), False
        except ConfigError as error:
            if self._failed_s == -math.inf:
                log.warning("%s", error)
            self._failed_s = self._now()
        else:
            self._failed_s = -math.inf

    def _open(self) -> Terminal:
        terminal = Terminal(str(self.path), now=self._now)
        try:
            _make_link(self.path, terminal.device)
        except BaseException:
            terminal.disconnect()
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
        self._received_s = now()
        # keep the terminal open: otherwise our end reads an error instead of nothing while no program has it open
        self._end, self._terminal = _open_terminal()
        self.device = os.ttyname(self._terminal)
        self._session = _lead_session(self.device)

    def receive(self) -> list[bytes]:
        """Return the telegrams that arrived since the last call; invalid data is dropped, as a brick does."""
        data = self._read()
        if self._now() - self._received_s > PARTIAL_LIMIT_S:
            self._frames.reset()
        if not data:
            return []
        self._received_s = self._now()
        return completed(self._frames, data)

    def send(self, data: bytes) -> None:
        """Write a frame in one piece, as many programs read once per frame. It need not be read."""
        self._discard_unread()
        with contextlib.suppress(BlockingIOError):  # the other program has stopped its terminal
            os.write(self._end, data)

    def disconnect(self) -> None:
        """Close the terminal; programs that have it open read an error."""
        if self.closed:
            return
        self.closed = True
        os.close(self._terminal)
        os.close(self._end)
        if self._session is not None:
            with self._session:
                self._session.kill()

    def readable(self) -> bool:
        """Return whether there is data to read."""
        return wait_readable([self._end], 0)

    def fileno(self) -> int:
        """Return the file descriptor of our end."""
        return self._end

    def _read(self) -> bytes:
        try:
            return os.read(self._end, CHUNK)
        except BlockingIOError:
            return b""

    def _discard_unread(self) -> None:
        """Discard replies that a program left unread, so that the next one does not read them."""
        import fcntl
        import termios

        unread = bytearray(4)
        fcntl.ioctl(self._terminal, termios.FIONREAD, unread)
        if int.from_bytes(unread, sys.byteorder) > UNREAD_LIMIT:
            termios.tcflush(self._terminal, termios.TCIFLUSH)


def _open_terminal() -> tuple[int, int]:
    """Open our end and the terminal itself, in raw mode."""
    try:
        import pty
        import tty
    except ImportError:
        raise ConfigError("this system has no pseudo-terminals.", remedy="Use Linux or macOS, or a TCP port.") from None
    try:
        end, terminal = pty.openpty()
    except OSError as error:
        raise ConfigError(
            f"no pseudo-terminal is available: {os.strerror(error.errno or errno.EIO)}.",
            remedy="End programs that use some, or serve on a TCP port: nxtdrive sim serve --tcp 0.",
        ) from error
    tty.setraw(terminal)
    os.set_blocking(end, False)
    return end, terminal


def _lead_session(device: str) -> subprocess.Popen[bytes] | None:
    """Start a process that makes the terminal its controlling terminal.

    On Linux a session leader that opens a terminal without O_NOCTTY, as most programs do, gets it as its controlling
    terminal unless another session has it, and is killed by SIGHUP when our end is closed. The shell below holds the
    terminal instead; it ends with us, when its standard input is closed.
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
    except OSError:  # without it, programs behave as on a Bluetooth port
        return None
    if leader.stdout is not None:
        leader.stdout.readline()  # wait until it has the terminal or has failed
    return leader


def _refuse_terminal(path: Path) -> None:
    """Refuse a path that is a link to a terminal that exists."""
    if path.is_symlink() and path.is_char_device():
        raise ConfigError(
            f"{path} is the port of another program ({os.readlink(path)}).",
            remedy="Choose another name, or end that program; if none serves there, remove the link.",
        )


def _make_link(path: Path, device: str) -> None:
    """Make `path` a symbolic link to `device` atomically."""
    if path.exists() and not path.is_symlink():
        raise ConfigError(f"{path} exists and is not a link.", remedy="Choose another name for the port.")
    fresh = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        fresh.symlink_to(device)
        fresh.replace(path)
    except OSError as error:
        raise ConfigError(
            f"the port cannot be named {path}: {os.strerror(error.errno or errno.EIO)}.",
            remedy="Choose a name in a folder that exists and that you may write to.",
        ) from error
