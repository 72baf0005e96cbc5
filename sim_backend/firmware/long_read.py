"""A Read over Bluetooth of more bytes than fit into a buffer. Source: docs/firmware.md section 2."""

from __future__ import annotations

from firmware_protocol.status import Status
from firmware_protocol.system import FileData, Read
from firmware_protocol.telegram import Kind
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.radio import Radio

_HEADER, _FIRST = 6, 120
"""Bytes before the first piece of data, and of that piece."""


class LongRead:
    """The last long Read: its buffer is sent, filled from its start, and sent again, once in a pass.

    No other one begins before all is sent, nor while the radio is busy with something else.
    """

    def __init__(self, loader: Loader, radio: Radio, size: int) -> None:
        self._loader, self._radio = loader, radio
        self._buffer = bytearray(size)
        self._handle = self._unsent = 0
        self._status = int(Status.OK)

    def sending(self) -> bool:
        """Return whether the reply is still being sent, or would be if its file were longer."""
        return self._unsent > 0

    def begin(self, handle: int, size: int) -> bytes:
        """Return the header and the first piece, which is whole even if the file is shorter; nothing if it is lost."""
        if self._radio.busy:
            return b""
        self._handle, self._unsent = handle, size - _FIRST
        self._status, data = self._loader.read(handle, _FIRST)
        header = bytes((Kind.REPLY, Read.opcode, self._status)) + FileData(handle, size, b"").pack()
        self._buffer[: _HEADER + len(data)] = header + data
        return bytes(self._buffer[: _HEADER + _FIRST])

    def next_piece(self) -> bytes:
        """Return the next piece: after the end of the file nothing, without a readable file the buffer as it is."""
        size = min(self._unsent, len(self._buffer))
        self._unsent -= size
        if self._status == Status.END_OF_FILE:
            return b""
        self._status, data = self._loader.read(self._handle, size)
        self._buffer[: len(data)] = data
        return bytes(self._buffer[: len(data) if self._status == Status.END_OF_FILE else size])
