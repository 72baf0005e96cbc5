"""A handle of the loader: an open file, a search, or nothing. Source: docs/firmware.md section 5."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto

from sim_backend.firmware.files.file_header import Cursor, File, Kind
from sim_backend.firmware.files.flash_memory import ERASED, POINTER, SECTOR, WORD, FlashMemory, address_of
from sim_backend.firmware.files.sector_table import NewFile


class Use(Enum):
    """Use of a handle."""

    FREE = auto()
    READ = auto()
    WRITE = auto()
    SEARCH = auto()


class WriteBuffer:
    """The sector that is being written, which enters the flash when it is full.

    Attributes:
        taken: Whether a handle has it.
        overrun: Whether more was written than announced.
        filled: Number of its bytes before the next one; those after it are erased, or what was written before a seek.
    """

    __slots__ = ("_page", "filled", "overrun", "taken")

    def __init__(self) -> None:
        self.taken = self.overrun = False
        self.filled = 0
        self._page = bytearray()

    def take(self) -> None:
        """Begin with an erased sector."""
        self.taken, self.overrun = True, False
        self._erase()

    def begin(self, content: bytes) -> None:
        """Set the bytes before the next one."""
        self._page[: len(content)] = content
        self.filled = len(content)

    def put(self, data: bytes) -> None:
        """Add bytes."""
        self._page[self.filled : self.filled + len(data)] = data
        self.filled += len(data)

    def flush(self, memory: FlashMemory, address: int) -> None:
        """Write to an address's sector as many words as there are bytes, if any."""
        if self.filled:
            memory.write(address, self._page[: -(-self.filled // WORD) * WORD])
        if self.filled == SECTOR:
            self._erase()
        self.filled = 0

    def _erase(self) -> None:
        self._page, self.filled = bytearray(ERASED * SECTOR), 0


class Handle:
    """One entry of the table.

    A handle keeps the values of its former use: a program's handle gets no place to read from, so a read continues
    where that use ended.

    Attributes:
        use: See `Use`.
        cursor: The next byte to read, or the sector that is being written.
        position: Number of bytes that were read.
        size: Number of bytes that can be read, or that are still to be written.
        header: Address of the header of the file that is being written.
        kind: Kind of that file.
        name: What the last look-up looked for; every look-up uses a handle.
        matches: Test of that look-up.
        index: Directory entry that the last look-up found, `NOWHERE` if none.
        buffer: The last write buffer that it had.
    """

    __slots__ = ("_memory", "buffer", "cursor", "header", "index", "kind", "matches", "name", "position", "size", "use")

    def __init__(self, memory: FlashMemory) -> None:
        self._memory = memory
        self.use = Use.FREE
        self.cursor = Cursor(memory)
        self.position = self.size = self.header = self.index = 0
        self.kind = Kind(0)
        self.name = ""
        self.matches: Callable[[str], bool] = lambda _: True
        self.buffer = WriteBuffer()

    def begin_reading(self, file: File) -> None:
        """Go to the first byte of a file."""
        self.cursor.begin(file)
        self.position, self.size = 0, file.data_size

    def read(self, size: int) -> bytes:
        """Read on."""
        data = self.cursor.read(max(0, min(size, self.size - self.position)))
        self.position += len(data)
        return data

    def seek(self, place: int, file: File) -> None:
        """Go to a byte of a file: back from its beginning, forward from where the handle is.

        A handle that writes goes from where the sector begins that is being written; it leaves what is in its buffer.
        """
        if place == self.position:
            return
        if place < self.position:
            self.cursor.begin(file)
            self.position = 0
        self.cursor.read(place - self.position)
        self.position = place
        if self.use == Use.WRITE:
            self._fill_buffer()

    def begin_writing(self, new: NewFile, buffer: WriteBuffer) -> None:
        """Begin to write a new file; its header is written at once, and its end once more with the first bytes."""
        page, address = b"", new.address
        for at in range(0, len(new.header), SECTOR):
            page = new.header[at : at + SECTOR]
            self._memory.write(address, page)
            address = address_of(int.from_bytes(page[-POINTER:], "little"))
        file = File(self._memory, new.address)
        self._write_on(file, buffer)
        self.cursor.begin(file)
        self.size = file.size
        buffer.begin(page[: file.start % SECTOR])

    def begin_appending(self, file: File, buffer: WriteBuffer) -> None:
        """Begin to write after the data of a file."""
        self._write_on(file, buffer)
        self.cursor.find(file, file.data_size)
        self.size = file.size - file.data_size
        self._fill_buffer()

    def _fill_buffer(self) -> None:
        """Begin with what is in the flash in front of the next byte."""
        self.buffer.begin(self._memory.read(self.cursor.sector, self.cursor.at % SECTOR))

    def _write_on(self, file: File, buffer: WriteBuffer) -> None:
        self.use, self.buffer, self.header, self.kind = Use.WRITE, buffer, file.address, file.kind
        buffer.take()

    def write(self, data: bytes) -> int:
        """Write on; return the number of bytes that fitted."""
        buffer = self.buffer
        if len(data) > self.size:
            data, buffer.overrun = data[: self.size], True
        self.size -= len(data)
        rest = data
        while rest:
            room = SECTOR - buffer.filled
            buffer.put(rest[:room])
            rest = rest[room:]
            if buffer.filled == SECTOR:
                buffer.flush(self._memory, self.cursor.at)
                self.cursor.next_sector()
        if not self.size:
            buffer.flush(self._memory, self.cursor.at)
        return len(data)

    def end_writing(self) -> bool:
        """Give the write buffer back; return whether a download was complete. A data file ends here."""
        buffer = self.buffer
        if self.kind & Kind.DATA:
            buffer.flush(self._memory, self.cursor.at)
            file = File(self._memory, self.header)
            file.set_data_size(file.size - self.size)
        buffer.taken = False
        return not self.kind & Kind.DATA and not buffer.overrun and not self.size
