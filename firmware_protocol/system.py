"""The system commands, 0x80 to 0xA4: files, modules, IO maps and the brick itself.

Source of all opcodes, layouts and remarks: docs/firmware.md section 5. LEGO's firmware does not route other opcodes
(0x8A and 0xA3 among them): it answers them with stale bytes (section 1, fact 7).

No ``from __future__ import annotations`` here: the declarations' annotations are read as objects.
"""

from typing import Annotated, Self

from firmware_protocol.status import Status
from firmware_protocol.telegram import Ack, Command, Reply, counted_reply, reply, system
from firmware_protocol.wire import U8, U16, U32, Block, BrickName, ByteCount, FileName, ReportedName, Tail, Text

BOOT_TEXT = "Let's dance: SAMBA"
"""The text without which `Boot` is refused (docs/firmware.md section 5, 0x97)."""

FILE_READ_LIMIT = 65535
FILE_WRITE_LIMIT = 65532
"""Most data bytes of one Read reply and one Write request, over Bluetooth; USB allows 58 and 61 (section 2)."""

IO_MAP_READ_LIMIT = 119
IO_MAP_READ_LIMIT_USB = 55
IO_MAP_WRITE_LIMIT = 118
"""Most data bytes of one IO map access, over Bluetooth and USB (section 2)."""
IO_MAP_READ_HEADER = 9
"""Bytes of an IOMapRead reply in front of the data; a longer reply is cut short without an error (section 2)."""

POLL_LIMIT = 121
"""Most bytes of one Poll over Bluetooth; USB allows 59 (section 2)."""


@reply
class FileHandle(Reply):
    """`handle`: Number of the open file, 0..15."""

    handle: U8


@reply
class FileOpened(Reply):
    """An open file and its size in bytes: the only reliable source of how much can be read."""

    handle: U8
    size: ByteCount


@system(0x80)
class OpenRead(Command[FileOpened]):
    """Open a file for reading. Never open an empty file: that closes another file's handle (section 1, fact 9)."""

    name: FileName


@system(0x81)
class OpenWrite(Command[FileHandle]):
    """Create a file of `size` bytes; programs (.rxe, .sys, .rtm) get one contiguous block."""

    name: FileName
    size: ByteCount


@reply
class FileData(Reply):
    """A piece of a file."""

    handle: U8  # echo
    size: U16  # echo of the requested length, *not* of the delivered one
    data: Annotated[bytes, Tail(FILE_READ_LIMIT)]  # past the end of the file zeros


@system(0x82, success=(Status.OK, Status.END_OF_FILE))
class Read(Command[FileData]):
    """Read on; END_OF_FILE comes with valid data. Over USB never ask for more than 58 bytes (section 1, fact 17)."""

    handle: U8
    size: U16


@reply
class FileWritten(Reply):
    """How many bytes fitted."""

    handle: U8
    size: U16


@system(0x83)
class Write(Command[FileWritten]):
    """Write on; END_OF_FILE_EXPECTED beyond the announced size, and the file is then lost."""

    handle: U8
    data: Annotated[bytes, Tail(FILE_WRITE_LIMIT)]


@system(0x84)
class Close(Command[FileHandle]):
    """Close a file or a search; a complete download is committed here, an incomplete one dropped with OK."""

    handle: U8


@reply
class FileDeleted(Reply):
    """`name`: As sent."""

    name: FileName


@system(0x85)
class Delete(Command[FileDeleted]):
    """Delete a file; never while a download is open (section 1, fact 18)."""

    name: FileName


@reply
class FileFound(Reply):
    """A file in a listing, and the handle that continues the search."""

    handle: U8
    name: FileName
    size: ByteCount


@system(0x86)
class FindFirst(Command[FileFound]):
    """Start a listing: ``*.*``, ``*.ext``, ``name.*`` or an exact name; FILE_NOT_FOUND closes the handle again."""

    pattern: FileName


@system(0x87)
class FindNext(Command[FileFound]):
    """Continue a listing; FILE_NOT_FOUND at its end leaves the handle open."""

    handle: U8


@reply
class Versions(Reply):
    """Versions of the protocol and the firmware."""

    protocol_minor: U8
    protocol_major: U8
    firmware_minor: U8
    firmware_major: U8

    @property
    def protocol(self) -> str:
        """As people write it, such as 1.124."""
        return f"{self.protocol_major}.{self.protocol_minor}"

    @property
    def firmware(self) -> str:
        """As people write it, such as 1.05 or 1.29."""
        return f"{self.firmware_major}.{self.firmware_minor:02}"


@system(0x88)
class GetVersions(Command[Versions]):
    """Read the versions of protocol and firmware."""


@system(0x89)
class OpenWriteLinear(Command[FileHandle]):
    """Create a file in one contiguous block; NO_LINEAR_SPACE if there is none."""

    name: FileName
    size: ByteCount


@system(0x8B)
class OpenWriteData(Command[FileHandle]):
    """Create a data file, reserving `size` bytes; its real size is set when it is closed."""

    name: FileName
    size: ByteCount


@reply
class AppendOpened(Reply):
    """A data file open for appending, and how many bytes are left in it."""

    handle: U8
    remaining: ByteCount


@system(0x8C)
class OpenAppendData(Command[AppendOpened]):
    """Open a data file to continue writing after its data."""

    name: FileName


@system(0x8D, since="1.28")
class CropDataFile(Command[FileHandle]):
    """Close a data file and shrink it to what was written."""

    handle: U8


@reply
class ModuleFound(Reply):
    """A firmware module.

    Attributes:
        handle: Always 0.
        name: Such as ``Output.mod``.
        module_id: Identifies the module in IOMapRead and IOMapWrite.
        module_size: Always 0.
        io_map_size: Bytes of its IO map.
    """

    handle: U8
    name: FileName
    module_id: U32
    module_size: U32
    io_map_size: U16


@reply
class ModuleHandle(Reply):
    """`handle`: Always 0."""

    handle: U8


@system(0x90)
class FindFirstModule(Command[ModuleFound]):
    """Start a listing of modules; NO_MORE_HANDLES if one is already open."""

    pattern: FileName


@system(0x91)
class FindNextModule(Command[ModuleFound]):
    """Continue the listing of modules; there is only one, so the firmware ignores `search`."""

    search: U8


@system(0x92)
class CloseModuleHandle(Command[ModuleHandle]):
    """End the listing of modules; always OK, and the firmware ignores `search`."""

    search: U8


@counted_reply("size")
class IOMapData(Reply):
    """A piece of an IO map."""

    module_id: U32  # echo
    size: U16  # of `data`: as requested, but over USB at most 55, over Bluetooth 119
    data: Annotated[bytes, Tail(IO_MAP_READ_LIMIT)]


@system(0x94)
class IOMapRead(Command[IOMapData]):
    """Read a piece of a module's IO map; OUT_OF_BOUNDARY beyond its end."""

    module_id: U32
    offset: U16
    size: U16

    @classmethod
    def reply_head(cls, request: bytes) -> bytes:
        """See `Command.reply_head`; a length that USB would cut short is not compared."""
        size = request[8:10]
        module = cls.encode_reply() + request[2:6]
        return module + size if int.from_bytes(size, "little") <= IO_MAP_READ_LIMIT_USB else module


@reply
class IOMapWritten(Reply):
    """How many bytes were written."""

    module_id: U32
    size: U16


@system(0x95)
class IOMapWrite(Command[IOMapWritten]):
    """Write a piece of a module's IO map; see `put`."""

    module_id: U32
    offset: U16
    size: U16  # bytes of `data`
    data: Annotated[bytes, Tail(IO_MAP_WRITE_LIMIT)]  # over USB at most 54 bytes

    @classmethod
    def put(cls, module_id: int, offset: int, data: bytes) -> Self:
        """Write `data`; its length is counted here."""
        return cls(module_id, offset, len(data), data)


@reply
class BootAnswer(Reply):
    """`answer`: ``Yes``."""

    answer: Annotated[str, Text(4)]


@system(0x97)
class Boot(Command[BootAnswer]):
    """Reboot into the loader for new firmware, over USB only; `text` must be `BOOT_TEXT`. No command works after it."""

    text: Annotated[str, Text(19)]


@system(0x98)
class SetBrickName(Command[Ack]):
    """Rename the brick; BLUETOOTH_BUSY while a radio operation runs."""

    name: BrickName


@reply
class BluetoothAddress(Reply):
    """`address`: Six bytes and a zero."""

    address: Annotated[bytes, Block(7)]


@system(0x9A)
class GetBluetoothAddress(Command[BluetoothAddress]):
    """Read the address of the brick's radio."""


@reply
class DeviceInfo(Reply):
    """Identity of the brick, and its free memory.

    Attributes:
        name: Its name, at most 15 characters.
        address: Of its radio, six bytes and a zero.
        link_quality: One byte for each of the four connections.
        free_flash: Bytes; refreshed by opening for writing, deleting and cropping, not by closing.
    """

    name: ReportedName
    address: Annotated[bytes, Block(7)]
    link_quality: Annotated[bytes, Block(4)]
    free_flash: ByteCount


@system(0x9B)
class GetDeviceInfo(Command[DeviceInfo]):
    """Read name, address and free memory."""


@system(0xA0)
class DeleteUserFlash(Command[Ack]):
    """Delete all files and settings and close all handles."""


@reply
class PollReady(Reply):
    """How many bytes wait in a poll buffer."""

    buffer: U8
    size: U8


@system(0xA1)
class PollLength(Command[PollReady]):
    """Read how many bytes wait in buffer 0 (USB, always empty) or 1 (high speed, port 4)."""

    buffer: U8


@counted_reply("count")
class PollData(Reply):
    """Bytes from a poll buffer.

    Attributes:
        buffer: Echo.
        count: Bytes that count.
        data: Those bytes, padded with zeros to the requested length.
    """

    buffer: U8
    count: U8
    data: Annotated[bytes, Tail(POLL_LIMIT)]


@system(0xA2)
class Poll(Command[PollData]):
    """Fetch from a poll buffer; over USB at most 59 bytes, over Bluetooth 121."""

    buffer: U8
    size: U8


@system(0xA4)
class BluetoothFactoryReset(Command[Ack]):
    """Reset all Bluetooth settings; over USB only."""
