"""A Read over Bluetooth of more bytes than fit into a buffer. Source: docs/firmware.md section 2."""

from __future__ import annotations

from firmware_protocol.status import Status
from firmware_protocol.system import FileData, Read
from firmware_protocol.telegram import Kind
from sim_backend.firmware.files.loader import Loader

_HEADER, _FIRST = 6, 120
"""Bytes before the first piece of data, and of that piece."""


class LongRead:
    """The last long Read: its buffer is sent, filled from its start, and sent again, once in a pass.

    Attributes:
        left: Bytes of data that are still to be sent; no other long Read begins before they are.
    """

    def __init__(self, loader: Loader, size: int) -> None:
        self._loader = loader
        self._buffer = bytearray(size)
        self._handle = self.left = 0
        self._status = int(Status.OK)

    def begin(self, handle: int, size: int) -> bytes:
        """Return the header and the first piece, which is whole even if the file is shorter."""
        self._handle, self.left = handle, size - _FIRST
        self._status, data = self._loader.read(handle, _FIRST)
        header = bytes((Kind.REPLY, Read.opcode, self._status)) + FileData(handle, size, b"").pack()
        self._buffer[: _HEADER + len(data)] = header + data
        return bytes(self._buffer[: _HEADER + _FIRST])

    def next_piece(self) -> bytes:
        """Return the next piece: after the end of the file nothing, without a readable file the buffer as it is."""
        size = min(self.left, len(self._buffer))
        self.left -= size
        if self._status == Status.END_OF_FILE:
            return b""
        self._status, data = self._loader.read(self._handle, size)
        self._buffer[: len(data)] = data
        return bytes(self._buffer[: len(data) if self._status == Status.END_OF_FILE else size])
