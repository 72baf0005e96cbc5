"""All errors, as one tree.

::

    NXTError
    ├── AddressError(ValueError)              an address that cannot be opened
    ├── BrickNotFound(LookupError)            a valid address, but no brick there
    ├── LinkError                             the link to the brick
    │   ├── LinkTimeout(TimeoutError)         no reply within the deadline
    │   │   └── SensorTimeout                 the brick replies, but the sensor does not
    │   ├── LinkLost(ConnectionError)         the cable, the radio or the peer is gone
    │   │   └── Interrupted                   the link is back, but the motors have stopped
    │   ├── LinkBusy                          another program uses the brick
    │   └── PermissionDenied(PermissionError) the operating system denies access
    ├── ProtocolError
    │   ├── LocalProtocolError(ValueError)    our mistake; nothing was sent
    │   └── RemoteProtocolError               the peer's mistake; carries the bytes
    ├── BrickError                            the brick replied with an error status
    │   ├── CommunicationPending              0x20: I2C reply not available yet
    │   └── MailboxEmpty                      0x40
    ├── BrickBusy                             the brick is busy, or did not do what it had acknowledged
    ├── ConfigError(ValueError)               a mission or world file with mistakes
    └── CameraError                           no frames

Classes also inherit the builtin exception that programs already catch. Errors are raised as fresh instances, never as
shared objects, so a caught error keeps nothing alive. `remedy` is one sentence a hobbyist can act on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_protocol.status import Status

SHOWN_BYTES = 128
"""Most bytes that a message shows: as many as the brick buffers of a telegram (docs/firmware.md section 2)."""


class NXTError(Exception):
    """Root of all errors of this project.

    Attributes:
        remedy: What to do next, one sentence, or an empty string.
    """

    def __init__(self, message: str, *, remedy: str = "") -> None:
        super().__init__(message)
        self.remedy = remedy

    def __str__(self) -> str:
        message = super().__str__()
        return f"{message} {self.remedy}" if self.remedy else message


class AddressError(NXTError, ValueError):
    """The address is not valid; the message lists what is."""


class BrickNotFound(NXTError, LookupError):
    """The address is valid, but no brick answers there."""


class LinkError(NXTError):
    """The link to the brick failed."""


class LinkTimeout(LinkError, TimeoutError):
    """No reply within the deadline."""


class SensorTimeout(LinkTimeout):
    """The brick answers, but the sensor does not."""


class LinkLost(LinkError, ConnectionError):
    """The cable was unplugged, the radio is out of range or the peer closed the link."""


class Interrupted(LinkLost):
    """The link was lost and is open again, but the motors that were driven have stopped."""


class LinkBusy(LinkError):
    """Another program uses the brick."""


class PermissionDenied(LinkError, PermissionError):
    """The operating system does not let this user open the device."""


class ProtocolError(NXTError):
    """A telegram that does not follow the protocol."""


class LocalProtocolError(ProtocolError, ValueError):
    """The program tried to send something that is not a telegram; nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The peer sent something else than the expected telegram.

    Attributes:
        telegram: The bytes as received.
    """

    def __init__(self, message: str, telegram: bytes = b"", *, remedy: str = "") -> None:
        received = telegram[:SHOWN_BYTES].hex(" ") or "nothing"
        if len(telegram) > SHOWN_BYTES:
            received += f" and {len(telegram) - SHOWN_BYTES} bytes more"
        super().__init__(f"{message} (received: {received})", remedy=remedy)
        self.telegram = telegram


class BrickError(NXTError):
    """The brick refused a command.

    Attributes:
        status: The status byte of the reply.
        command: Name of the command that was refused.
        port: The port that it was for, as printed on the brick, or an empty string.
    """

    def __init__(self, status: Status, command: str, port: str = "") -> None:
        subject = f"{command} on port {port}" if port else command
        message = f"the brick refused {subject}: {status.label} (status 0x{int(status):02X})."
        super().__init__(message, remedy=status.remedy)
        self.status = status
        self.command = command
        self.port = port


class CommunicationPending(BrickError):
    """Status 0x20: the I2C transaction is still running; retry."""


class MailboxEmpty(BrickError):
    """Status 0x40: there is no message in this mailbox."""


class BrickBusy(NXTError):
    """The brick is busy, or did not do what it had acknowledged with OK."""


class ConfigError(NXTError, ValueError):
    """A mission or world file with mistakes; the message lists all of them with their paths."""


class CameraError(NXTError):
    """The camera, file or stream delivers no frames."""


def system_words(error: OSError) -> str:
    """Return what the operating system says, without what Python adds, such as the address of a port in use."""
    return (error.strerror or str(error)).partition(" (while attempting to bind")[0]
