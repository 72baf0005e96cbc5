"""Everything that can go wrong, as one tree.

::

    NXTError
    ├── AddressError(ValueError)              an address nobody can open
    ├── BrickNotFound(LookupError)            a good address, but no brick there
    ├── LinkError                             the way to the brick
    │   ├── LinkTimeout(TimeoutError)         no answer within the deadline
    │   ├── LinkLost(ConnectionError)         the cable, the radio or the peer is gone
    │   ├── LinkBusy                          another program holds the brick
    │   └── PermissionDenied(PermissionError) the operating system says no
    ├── ProtocolError
    │   ├── LocalProtocolError(ValueError)    we are wrong; nothing was sent
    │   └── RemoteProtocolError               the peer is wrong; carries the bytes
    ├── BrickError                            the brick answered with an error status
    │   ├── CommunicationPending              0x20: I2C answer not there yet
    │   └── MailboxEmpty                      0x40
    ├── BrickBusy                             the brick does something else, or nothing came of what it said OK to
    ├── ConfigError(ValueError)               a mission or world file with mistakes
    └── CameraError                           no frames

Where people already catch a builtin, the class inherits that builtin too. Errors are raised as fresh instances, never
as shared objects, so a caught error keeps nothing alive. `remedy` is one sentence a hobbyist can act on.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from firmware_protocol.status import Status


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
    """The address cannot be understood; the message lists what can."""


class BrickNotFound(NXTError, LookupError):
    """The address is good, but no brick answers there."""


class LinkError(NXTError):
    """The way to the brick failed."""


class LinkTimeout(LinkError, TimeoutError):
    """No answer within the deadline."""


class LinkLost(LinkError, ConnectionError):
    """The cable was pulled, the radio went away or the peer closed."""


class LinkBusy(LinkError):
    """Another program holds the brick."""


class PermissionDenied(LinkError, PermissionError):
    """The operating system does not let this user open the device."""


class ProtocolError(NXTError):
    """A telegram that does not follow the protocol."""


class LocalProtocolError(ProtocolError, ValueError):
    """We were asked to send something that is not a telegram; nothing was sent."""


class RemoteProtocolError(ProtocolError):
    """The peer sent something that is not the telegram it should be.

    Attributes:
        telegram: The bytes as received.
    """

    def __init__(self, message: str, telegram: bytes = b"", *, remedy: str = "") -> None:
        super().__init__(f"{message} (received: {telegram.hex(' ') or 'nothing'})", remedy=remedy)
        self.telegram = telegram


class BrickError(NXTError):
    """The brick understood and refused.

    Attributes:
        status: The status byte of the reply.
        command: Name of the command that was refused.
    """

    def __init__(self, status: Status, command: str) -> None:
        message = f"the brick refused {command}: {status.label} (status 0x{int(status):02X})."
        super().__init__(message, remedy=status.remedy)
        self.status = status
        self.command = command


class CommunicationPending(BrickError):
    """Status 0x20: the I2C transaction is still running; ask again."""


class MailboxEmpty(BrickError):
    """Status 0x40: there is no message in this mailbox."""


class BrickBusy(NXTError):
    """The brick does something else, or nothing came of what it had said OK to."""


class ConfigError(NXTError, ValueError):
    """A mission or world file with mistakes; the message lists all of them with their paths."""


class CameraError(NXTError):
    """The camera, file or stream gives no frames."""
