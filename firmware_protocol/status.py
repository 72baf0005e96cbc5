"""The status byte of every reply: what it means and what to do about it.

Source: docs/firmware.md section 5.1.
"""

from __future__ import annotations

from firmware_protocol.enums import OpenEnum


class Status(OpenEnum):
    """Third byte of a reply."""

    OK = 0x00
    IN_PROGRESS = 0x01
    PENDING = 0x20
    MAILBOX_EMPTY = 0x40
    NO_MORE_HANDLES = 0x81
    NO_SPACE = 0x82
    NO_MORE_FILES = 0x83
    END_OF_FILE_EXPECTED = 0x84
    END_OF_FILE = 0x85
    NOT_A_LINEAR_FILE = 0x86
    FILE_NOT_FOUND = 0x87
    HANDLE_ALREADY_CLOSED = 0x88
    NO_LINEAR_SPACE = 0x89
    UNDEFINED_ERROR = 0x8A
    FILE_IS_BUSY = 0x8B
    NO_WRITE_BUFFERS = 0x8C
    APPEND_NOT_POSSIBLE = 0x8D
    FILE_IS_FULL = 0x8E
    FILE_EXISTS = 0x8F
    MODULE_NOT_FOUND = 0x90
    OUT_OF_BOUNDARY = 0x91
    ILLEGAL_FILE_NAME = 0x92
    ILLEGAL_HANDLE = 0x93
    BLUETOOTH_BUSY = 0x94
    BLUETOOTH_CONNECT_FAILED = 0x95
    BLUETOOTH_TIMEOUT = 0x96
    FILE_TRANSFER_TIMEOUT = 0x97
    FILE_TRANSFER_FILE_EXISTS = 0x98
    FILE_TRANSFER_BUFFER_FULL = 0x99
    FILE_TRANSFER_CORRUPT = 0x9A
    FILE_TRANSFER_ABORTED = 0x9B
    REQUEST_FAILED = 0xBD
    UNKNOWN_OPCODE = 0xBE
    INSANE_PACKET = 0xBF
    OUT_OF_RANGE = 0xC0
    BUS_ERROR = 0xDD
    NO_FREE_MEMORY = 0xDE
    CHANNEL_INVALID = 0xDF
    CHANNEL_NOT_CONFIGURED = 0xE0
    NO_ACTIVE_PROGRAM = 0xEC
    ILLEGAL_SIZE = 0xED
    ILLEGAL_MAILBOX = 0xEE
    INVALID_FIELD = 0xEF
    BAD_INPUT_OUTPUT = 0xF0
    OUT_OF_MEMORY = 0xFB
    BAD_ARGUMENTS = 0xFF

    @property
    def remedy(self) -> str:
        """What the user can do about this status, or an empty string."""
        return _REMEDIES.get(self, "")


_REMEDIES = {
    Status.NO_MORE_HANDLES: "Close files that are open, or switch the brick off and on.",
    Status.NO_SPACE: "Delete files on the brick to make room.",
    Status.NO_LINEAR_SPACE: "Delete files on the brick; programs need one contiguous block.",
    Status.FILE_NOT_FOUND: "List the files to see what is on the brick.",
    Status.FILE_EXISTS: "Delete the file first, or choose another name.",
    Status.FILE_IS_BUSY: "Stop the program that uses the file, then try again.",
    Status.ILLEGAL_FILE_NAME: "Names have at most 19 characters, the dot included.",
    Status.BLUETOOTH_BUSY: "Wait until the brick's radio has finished, then try again.",
    Status.UNKNOWN_OPCODE: "This brick's firmware lacks this command; `nxtdrive info` shows its version.",
    Status.OUT_OF_RANGE: "Check the port, and that the named file is on the brick.",
    Status.BUS_ERROR: "Check the sensor's cable and that it is plugged into the port you named.",
    Status.CHANNEL_NOT_CONFIGURED: (
        "Use the port for no other sensor. Set it to a digital sensor first and wait 20 ms; the bus may also be busy."
    ),
    Status.NO_ACTIVE_PROGRAM: "Start a program on the brick first.",
}
