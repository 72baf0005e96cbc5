"""System calls for mailboxes and Bluetooth messages. Source: docs/firmware.md section 8.4."""

from __future__ import annotations

from collections.abc import Mapping

from firmware_protocol.direct import MESSAGE_LIMIT
from firmware_protocol.status import Status
from sim_backend.firmware.mailboxes import MAILBOXES
from sim_backend.firmware.vm.calls import Call, Function
from sim_backend.firmware.vm.memory import OutOfMemory

CONNECTIONS = 4


def _write(call: Call) -> None:
    """Append a message to a mailbox: status, box, text.

    Raises:
        OutOfMemory: The pool is full, which ends the program.
    """
    box, message = call.number(1), call.live(2)
    if box >= MAILBOXES:
        call.put(0, Status.ILLEGAL_MAILBOX)
    elif len(message) > MESSAGE_LIMIT:
        call.put(0, Status.ILLEGAL_SIZE)
    else:
        try:
            call.devices.mailboxes.write(box, message)
            call.put(0, Status.OK)
        except OutOfMemory:
            call.put(0, Status.OUT_OF_MEMORY)
            raise


def _read(call: Call) -> None:
    """Fetch the oldest message: status, box, whether to remove it, text."""
    box = call.number(1)
    if box >= MAILBOXES:
        message, status = None, Status.ILLEGAL_MAILBOX
    else:
        message = call.devices.mailboxes.read(box, remove=bool(call.number(2)))
        status = Status.MAILBOX_EMPTY if message is None else Status.OK
    call.put_bytes(3, message or b"\0")
    call.put(0, status)


def _connection(call: Call) -> None:
    """Read a Bluetooth connection: status, connection; while something is being sent, the state of that."""
    known = Status.PENDING if call.devices.radio.sending else Status.CHANNEL_NOT_CONFIGURED
    call.put(0, known if call.number(1) < CONNECTIONS else Status.BAD_INPUT_OUTPUT)


def _send(call: Call) -> None:
    """Send bytes over a Bluetooth connection: status, connection, bytes."""
    call.devices.radio.sending = True
    call.put(0, Status.PENDING)


TABLE: Mapping[int, Function] = {
    26: _write,
    27: _read,
    28: _connection,
    29: _send,
}
"""Number of each call to its function."""
