"""``record://FILE?nxt=ADDRESS``: wraps any other transport and writes its traffic to a trace file.

The command line translates ``--trace FILE`` to such an address.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Self

from firmware_protocol.errors import AddressError, NXTError
from nxtdrive.transports.address import Address
from nxtdrive.transports.base import Transport
from nxtdrive.transports.trace_file import Entry, EntryKind, Trace, TraceWriter


class RecordTransport:
    """A transport that records another one.

    Attributes:
        inner: The recorded transport.
        address: Address of the recorded transport.
    """

    def __init__(self, inner: Transport, writer: TraceWriter, started_s: float) -> None:
        self.inner = inner
        self.address, self.max_telegram, self.simulated = inner.address, inner.max_telegram, inner.simulated
        self.now, self.sleep = inner.now, inner.sleep
        self._writer, self._started_s = writer, started_s

    @classmethod
    def open(cls, address: Address, timeout_s: float = 1.0) -> Self:
        """Open the address in ``nxt`` and begin the trace.

        Raises:
            AddressError: The address lacks the file or the brick.
            ConfigError: The file cannot be written.
            NXTError: Opening the brick failed; then there is no trace.
        """
        from nxtdrive.transports import open_transport

        options = address.read_options({"nxt": str, "command": shlex.split})
        if not address.target or "nxt" not in options:
            raise AddressError(f"{address} is incomplete.", remedy="Write record://FILE.nxttrace?nxt=ADDRESS.")
        inner, path = open_transport(options["nxt"], timeout_s=timeout_s), Path(address.target)
        try:
            header = Trace(inner.address, inner.max_telegram, tuple(options.get("command", ())))
            return cls(inner, TraceWriter(path, header), inner.now())
        except BaseException:
            inner.close()
            raise

    def send(self, telegram: bytes) -> None:
        """Send and record a telegram."""
        try:
            self.inner.send(telegram)
        except NXTError as error:
            self._write(EntryKind.TO_BRICK, telegram, error)
            raise
        self._write(EntryKind.TO_BRICK, telegram)

    def receive(self, timeout_s: float) -> bytes | None:
        """Receive and record a telegram."""
        try:
            telegram = self.inner.receive(timeout_s)
        except NXTError as error:
            self._write(EntryKind.ERROR, b"", error)
            raise
        if telegram is not None:
            self._write(EntryKind.FROM_BRICK, telegram)
        return telegram

    def waiting(self) -> bool:
        """See the recorded transport; records the error that it raises."""
        try:
            return self.inner.waiting()
        except NXTError as error:
            self._write(EntryKind.ERROR, b"", error)
            raise

    def close(self) -> None:
        """Close the transport and the file."""
        try:
            self.inner.close()
        finally:
            self._writer.close()

    def reopen(self, timeout_s: float = 1.0) -> Self:
        """Open the transport again and continue the trace."""
        from nxtdrive.transports import reopen_transport

        inner = reopen_transport(self.inner, timeout_s=timeout_s)
        self._writer.reopen()
        again = type(self)(inner, self._writer, self._started_s)
        again._write(EntryKind.REOPENED)
        return again

    def _write(self, kind: EntryKind, telegram: bytes = b"", error: NXTError | None = None) -> None:
        name, text = (type(error).__name__, str(error)) if error else ("", "")
        self._writer.write(Entry(self.now() - self._started_s, kind, telegram, name, text))


def recording_address(path: Path, address: str, command: str) -> str:
    """Return the address that opens and records `address`.

    Args:
        path: The trace file.
        address: Address of the brick.
        command: The command line to note in the trace, quoted for a shell.
    """
    return str(Address("record", str(path), {"nxt": address, "command": command}))


def brick_address(address: Address) -> Address:
    """Return the address of the brick that a recording address opens; any other address unchanged."""
    if address.scheme != "record" or "nxt" not in address.options:
        return address
    return brick_address(Address.parse(address.options["nxt"]))


def with_brick(address: Address, change: Callable[[Address], Address]) -> Address:
    """Return the address with that of its brick changed; see `brick_address`."""
    if address.scheme != "record" or "nxt" not in address.options:
        return change(address)
    brick = with_brick(Address.parse(address.options["nxt"]), change)
    return replace(address, options={**address.options, "nxt": str(brick)})


def in_room(address: Address, room: str) -> Address:
    """Return the address with a room, a world's file or name, if it is a simulated brick's and names none.

    A recording address gets the room for the brick that it records.
    """

    def into_room(brick: Address) -> Address:
        return replace(brick, target=room) if brick.scheme == "sim" and not brick.target else brick

    return with_brick(address, into_room)


def recorded(transport: Transport) -> Transport:
    """Return the recorded transport of a `RecordTransport`; any other transport unchanged."""
    return transport.inner if isinstance(transport, RecordTransport) else transport
