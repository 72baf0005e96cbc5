"""A handle of the loader: an open file, a search, or nothing. Source: docs/firmware.md section 5."""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto

from sim_backend.firmware.files.file_header import Cursor, File, Kind
from sim_backend.firmware.files.flash_memory import POINTER, SECTOR, FlashMemory, address_of
from sim_backend.firmware.files.sector_table import NewFile


class Use(Enum):
    """Use of a handle."""

    FREE = auto()
    READ = auto()
    WRITE = auto()
    SEARCH = auto()


class WriteBuffer:
    """The beginning of the sector that is being written, which enters the flash when it is full.

    Attributes:
        taken: Whether a handle has it.
        overrun: Whether more was written than announced.
        page: The bytes.
    """

    __slots__ = ("overrun", "page", "taken")

    def __init__(self) -> None:
        self.taken = self.overrun = False
        self.page = bytearray()

    def take(self, page: bytes) -> None:
        """Begin with the bytes before the first one that will be written."""
        self.taken, self.overrun, self.page = True, False, bytearray(page)


class Handle:
    """One entry of the table.

    What a use leaves stays: a program's handle is not given a place to read from, and reads on where another use ended.

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
        """Go to a byte of a file: back from its beginning, forward from where the handle is."""
        if place < self.position:
            self.cursor.begin(file)
            self.position = 0
        self.cursor.read(place - self.position)
        self.position = place

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
        self.position, self.size = 0, file.size
        buffer.take(page[: file.start % SECTOR])

    def begin_appending(self, file: File, buffer: WriteBuffer) -> None:
        """Begin to write behind the data of a file."""
        self._write_on(file, buffer)
        self.cursor.find(file, file.data_size)
        self.position, self.size = 0, file.size - file.data_size
        buffer.take(self._memory.read(self.cursor.sector, self.cursor.at % SECTOR))

    def _write_on(self, file: File, buffer: WriteBuffer) -> None:
        self.use, self.buffer, self.header, self.kind = Use.WRITE, buffer, file.address, file.kind

    def write(self, data: bytes) -> int:
        """Write on; return the number of bytes that fitted."""
        page = self.buffer.page
        if len(data) > self.size:
            data, self.buffer.overrun = data[: self.size], True
        self.size -= len(data)
        rest = data
        while rest:
            room = SECTOR - len(page)
            page += rest[:room]
            rest = rest[room:]
            if len(page) == SECTOR:
                self._write_page()
                self.cursor.next_sector()
        if not self.size:
            self._write_page()
        return len(data)

    def end_writing(self) -> bool:
        """Give the write buffer back; return whether a download was complete. A data file ends here."""
        buffer = self.buffer
        if self.kind & Kind.DATA:
            self._write_page()
            file = File(self._memory, self.header)
            file.set_data_size(file.size - self.size)
        buffer.taken = False
        return not self.kind & Kind.DATA and not buffer.overrun and not self.size

    def _write_page(self) -> None:
        page = self.buffer.page
        if page:
            self._memory.write(self.cursor.at, page)
            page.clear()
