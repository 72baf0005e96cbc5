"""A Bluetooth controller for a Linux kernel and bumble's hosts: bumble's, with the commands that it lacks.

Opcodes, events and error codes are those of the Bluetooth Core Specification, volume 4, part E.
"""

from __future__ import annotations

import asyncio
import hashlib
from collections.abc import Callable
from typing import Any

from bumble import hci
from bumble.controller import Controller

COMMAND, EVENT = 0x01, 0x04
INQUIRY_COMPLETE, INQUIRY_RESULT, CONNECTION_COMPLETE, DISCONNECTION_COMPLETE = 0x01, 0x02, 0x03, 0x05
AUTHENTICATION_COMPLETE, ENCRYPTION_CHANGE, READ_REMOTE_VERSION_COMPLETE = 0x06, 0x08, 0x0C
COMMAND_COMPLETE, COMMAND_STATUS, READ_CLOCK_OFFSET_COMPLETE = 0x0E, 0x0F, 0x1C
PIN_CODE_REQUEST, LINK_KEY_REQUEST, LINK_KEY_NOTIFICATION = 0x16, 0x17, 0x18
PAGE_TIMEOUT, AUTHENTICATION_FAILURE, CONNECTION_TIMEOUT = 0x04, 0x05, 0x08

PAGE_TIMEOUT_S = 5.12
"""How long an adapter calls a device that is not there: the specification's default."""

INQUIRY_UNIT_S = 1.28

TOY_ROBOT = 0x000804
"""Class of device of an NXT: a toy, robot."""

BLUETOOTH_2_0 = 3
"""Version of the brick's BlueCore 4, and so of a kernel's conversation with it; bumble declares a far newer one."""

ANSWERS = {
    0x0402: "00",  # Inquiry Cancel
    0x080F: "00",  # Write Default Link Policy Settings
    0x0C05: "00",  # Set Event Filter
    0x0C0D: "0000000000",  # Read Stored Link Key: none
    0x0C12: "000000",  # Delete Stored Link Key: none
    0x0C16: "00",  # Write Connection Accept Timeout
    0x0C18: "00",  # Write Page Timeout
    0x0C1B: "0000081200",  # Read Page Scan Activity
    0x0C1C: "00",  # Write Page Scan Activity
    0x0C1E: "00",  # Write Inquiry Scan Activity
    0x0C20: "00",  # Write Authentication Enable
    0x0C22: "00",  # Write Encryption Mode
    0x0C25: "006000",  # Read Voice Setting
    0x0C26: "00",  # Write Voice Setting
    0x0C2F: "00",  # Write Synchronous Flow Control Enable
    0x0C31: "00",  # Set Controller To Host Flow Control
    0x0C33: "00",  # Host Buffer Size
    0x0C38: "0001",  # Read Number Of Supported IAC
    0x0C39: "0001338b9e",  # Read Current IAC LAP: the general one
    0x0C3A: "00",  # Write Current IAC LAP
    0x0C45: "00",  # Write Inquiry Mode
    0x0C46: "0000",  # Read Page Scan Type
    0x0C47: "00",  # Write Page Scan Type
    0x0C56: "00",  # Write Simple Pairing Mode
    0x0C58: "0000",  # Read Inquiry Response Transmit Power Level
    0x0C59: "0000",  # Read Default Erroneous Data Reporting
    0x0C5B: "00",  # Write Default Erroneous Data Reporting
}
"""Return parameters, beginning with the status, of commands that a Linux kernel sends and bumble lacks."""


class Radio(Controller):  # type: ignore[misc] # bumble's types are not read
    """A controller of Bluetooth 2.0, as far as Linux's and bumble's hosts need one.

    Attributes:
        pin: PIN that the other side asks for before it accepts a connection (security mode 3); None: it does not ask.
    """

    hci_version = lmp_version = BLUETOOTH_2_0
    lmp_features = hci.LmpFeatureMask(0x7)
    lmp_features_max_page_number = 0
    acl_data_packet_length, total_num_acl_data_packets = 310, 10

    pin: str | None = None
    _key = b""
    _authenticated: Callable[[bool], object] = staticmethod(bool)

    def on_packet(self, packet: bytes) -> None:
        """Answer a packet of the host."""
        opcode = int.from_bytes(packet[1:3], "little") if packet[0] == COMMAND else 0
        if opcode in ANSWERS:
            self._complete(opcode, bytes.fromhex(ANSWERS[opcode]))
        elif opcode in OWN:
            OWN[opcode](self, opcode, packet[4:])
        else:
            super().on_packet(packet)

    def event(self, code: int, parameters: bytes) -> None:
        """Send an event to the host, after what is being sent."""
        if self.host is not None:
            packet = bytes((EVENT, code, len(parameters))) + parameters
            asyncio.get_running_loop().call_soon(self.host.on_packet, packet)

    def lose(self) -> None:
        """Report to the host that its connections are lost."""
        for connection in list(self.classic_connections.values()):
            handle = connection.handle.to_bytes(2, "little")
            self.event(DISCONNECTION_COMPLETE, b"\0" + handle + bytes((CONNECTION_TIMEOUT,)))
        self.classic_connections.clear()

    def on_hci_command(self, command: hci.HCI_Command) -> Any:  # noqa: ANN401, ARG002 - bumble's
        """Accept commands that neither supports."""
        return hci.HCI_StatusReturnParameters(hci.HCI_ErrorCode.SUCCESS)

    # --- commands that bumble does not answer, or answers differently ---

    def _complete(self, opcode: int, parameters: bytes) -> None:
        self.event(COMMAND_COMPLETE, b"\1" + opcode.to_bytes(2, "little") + parameters)

    def _begin(self, opcode: int) -> None:
        self.event(COMMAND_STATUS, b"\0\1" + opcode.to_bytes(2, "little"))

    def _inquire(self, opcode: int, parameters: bytes) -> None:
        """Find the devices of the link, all at once, and end when the host's time is up."""
        self._begin(opcode)
        for controller in self.link.controllers if self.link else ():
            if controller is not self:
                found = bytes(controller.public_address) + b"\1\0\0" + TOY_ROBOT.to_bytes(3, "little") + b"\0\0"
                self.event(INQUIRY_RESULT, b"\1" + found)
        asyncio.get_running_loop().call_later(parameters[3] * INQUIRY_UNIT_S, self.event, INQUIRY_COMPLETE, b"\0")

    def _connect(self, opcode: int, parameters: bytes) -> None:
        address = parameters[:6]

        def fail(status: int) -> None:
            self.event(CONNECTION_COMPLETE, bytes((status, 0, 0)) + address + b"\1\0")

        def connect() -> None:
            Controller.on_packet(self, bytes((COMMAND, *opcode.to_bytes(2, "little"), len(parameters))) + parameters)

        if self.link is None or self.link.find_classic_controller(_address(address)) is None:
            self._begin(opcode)
            asyncio.get_running_loop().call_later(PAGE_TIMEOUT_S, fail, PAGE_TIMEOUT)
        elif self.pin is None:
            connect()
        else:
            self._begin(opcode)
            self._authenticate(address, lambda right: connect() if right else fail(AUTHENTICATION_FAILURE))

    def _cancel_connection(self, opcode: int, parameters: bytes) -> None:
        self._complete(opcode, b"\0" + parameters[:6])

    def _read_remote_version(self, opcode: int, parameters: bytes) -> None:
        self._begin(opcode)
        version = bytes((BLUETOOTH_2_0, 10, 0, 0, 0))
        self.event(READ_REMOTE_VERSION_COMPLETE, b"\0" + parameters[:2] + version)

    def _read_clock_offset(self, opcode: int, parameters: bytes) -> None:
        self._begin(opcode)
        self.event(READ_CLOCK_OFFSET_COMPLETE, b"\0" + parameters[:2] + b"\0\0")

    # --- pairing: the host shows the key of an earlier pairing, or a PIN makes a new one ---

    def _request_authentication(self, opcode: int, parameters: bytes) -> None:
        self._begin(opcode)
        handle = parameters[:2]

        def finish(right: bool) -> None:
            self.event(AUTHENTICATION_COMPLETE, bytes((0 if right else AUTHENTICATION_FAILURE,)) + handle)

        connection = self.find_classic_connection_by_handle(int.from_bytes(handle, "little"))
        if connection is None or self.pin is None:
            finish(right=True)
        else:
            self._authenticate(bytes(connection.peer_address), finish)

    def _authenticate(self, address: bytes, then: Callable[[bool], object]) -> None:
        self._authenticated = then
        self.event(LINK_KEY_REQUEST, address)

    def _take_link_key(self, opcode: int, parameters: bytes) -> None:
        """Compare the host's key; without the right one, ask for the PIN."""
        address, key = parameters[:6], parameters[6:22]
        self._complete(opcode, b"\0" + address)
        if key and key == self._key:
            self._authenticated(True)
        else:
            self.event(PIN_CODE_REQUEST, address)

    def _take_pin(self, opcode: int, parameters: bytes) -> None:
        """Compare the host's PIN; the right one makes a key. No PIN: the host declines."""
        address, pin = parameters[:6], parameters[7 : 7 + parameters[6]] if len(parameters) > 6 else b""
        self._complete(opcode, b"\0" + address)
        right = self.pin is not None and pin == self.pin.encode()
        if right:
            self._key = hashlib.md5(address + pin, usedforsecurity=False).digest()
            self.event(LINK_KEY_NOTIFICATION, address + self._key + b"\0")
        self._authenticated(right)

    def _encrypt(self, opcode: int, parameters: bytes) -> None:
        self._begin(opcode)
        self.event(ENCRYPTION_CHANGE, b"\0" + parameters[:3])


OWN: dict[int, Callable[[Radio, int, bytes], None]] = {
    0x0401: Radio._inquire,
    0x0405: Radio._connect,
    0x0408: Radio._cancel_connection,
    0x040B: Radio._take_link_key,
    0x040C: Radio._take_link_key,  # negative reply: no key
    0x040D: Radio._take_pin,
    0x040E: Radio._take_pin,  # negative reply: no PIN
    0x0411: Radio._request_authentication,
    0x0413: Radio._encrypt,
    0x041D: Radio._read_remote_version,
    0x041F: Radio._read_clock_offset,
}
"""Commands that this controller handles itself, by opcode."""


def _address(address: bytes) -> hci.Address:
    return hci.Address(address, hci.Address.PUBLIC_DEVICE_ADDRESS)
