"""A USB device as the host's kernel sees it: descriptors, control requests, and queues of bulk packets. No I/O.

Numbers are those of the USB 2.0 specification, chapter 9.
"""

from __future__ import annotations

import struct
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

DEVICE_TO_HOST = 0x80
ENGLISH = 0x0409


class Speed(IntEnum):
    """Speeds in the order of Linux's `enum usb_device_speed`, which USB/IP sends."""

    FULL = 2
    HIGH = 3


class Request(IntEnum):
    """Standard requests, table 9-4."""

    GET_STATUS = 0
    CLEAR_FEATURE = 1
    SET_FEATURE = 3
    SET_ADDRESS = 5
    GET_DESCRIPTOR = 6
    GET_CONFIGURATION = 8
    SET_CONFIGURATION = 9
    GET_INTERFACE = 10
    SET_INTERFACE = 11


class Descriptor(IntEnum):
    """Types of descriptors, table 9-5."""

    DEVICE = 1
    CONFIGURATION = 2
    STRING = 3


STANDARD_MASK, RECIPIENT_MASK, RECIPIENT_ENDPOINT = 0x60, 0x1F, 0x02
ENDPOINT_HALT = 0
"""Feature selector of a halted endpoint, table 9-6."""


class Stall(Exception):
    """The device does not support the request; the host reads EPIPE."""


@dataclass(frozen=True, slots=True)
class Setup:
    """The eight bytes of a control request, table 9-2."""

    request_type: int
    request: int
    value: int
    index: int
    length: int

    @classmethod
    def decode(cls, data: bytes) -> Setup:
        """Decode the setup packet."""
        return cls(*struct.unpack("<BBHHH", data))

    @property
    def to_host(self) -> bool:
        """Whether the data go from the device to the host."""
        return bool(self.request_type & DEVICE_TO_HOST)

    @property
    def standard(self) -> bool:
        """Whether this is one of the standard requests, which every device supports."""
        return not self.request_type & STANDARD_MASK


class UsbDevice:
    """A device with one configuration.

    Attributes:
        descriptor: The device descriptor.
        configuration: The configuration with its interfaces and endpoints.
        speed: Speed of the bus.
        packet_size: Largest packet of the bulk endpoints.
        halted: Addresses of halted endpoints, as after a fault; the host clears them.
        outbox: Packets for the host by the address of their endpoint; a short one ends a transfer.
    """

    def __init__(
        self,
        descriptor: bytes,
        configuration: bytes,
        strings: Sequence[str],
        *,
        speed: Speed,
        packet_size: int,
        endpoint_in: int,
    ) -> None:
        """Describe the device.

        Args:
            descriptor: The device descriptor.
            configuration: The configuration descriptor with all that belongs to it.
            strings: String descriptors, numbered from 1.
            speed: Speed of the bus.
            packet_size: Largest packet of the bulk endpoints in bytes.
            endpoint_in: Address of the only bulk endpoint to the host.
        """
        self.descriptor, self.configuration = descriptor, configuration
        self.speed, self.packet_size = speed, packet_size
        self.halted: set[int] = set()
        self.outbox: dict[int, deque[bytes]] = {endpoint_in: deque()}
        self._strings = strings
        self._configured = 0

    def reset(self) -> None:
        """Forget everything from the previous host, like a device that has just been plugged in."""
        self.halted.clear()
        self._configured = 0
        for packets in self.outbox.values():
            packets.clear()

    def control(self, setup: Setup, data: bytes) -> bytes:
        """Answer a control request with at most `setup.length` bytes.

        Raises:
            Stall: The device does not support it.
        """
        answer = self._standard(setup) if setup.standard else self.class_request(setup, data)
        return answer[: setup.length]

    def class_request(self, setup: Setup, data: bytes) -> bytes:  # noqa: ARG002 - for subclasses
        """Answer a request that only this class of devices supports; see `control`."""
        raise Stall

    def take(self, endpoint: int, data: bytes) -> None:  # noqa: ARG002 - for subclasses
        """Take a bulk transfer from the host.

        Raises:
            Stall: There is no such endpoint.
        """
        raise Stall

    def _standard(self, setup: Setup) -> bytes:
        recipient = setup.request_type & RECIPIENT_MASK
        match setup.request:
            case Request.GET_DESCRIPTOR:
                return self._described(setup.value >> 8, setup.value & 0xFF)
            case Request.GET_STATUS:
                halted = recipient == RECIPIENT_ENDPOINT and setup.index in self.halted
                return bytes((halted, 0))
            case Request.CLEAR_FEATURE | Request.SET_FEATURE:
                self._feature(setup, recipient)
            case Request.GET_CONFIGURATION:
                return bytes((self._configured,))
            case Request.SET_CONFIGURATION:
                self._configured = setup.value & 0xFF
                self.halted.clear()  # section 9.4.5
            case Request.GET_INTERFACE:
                return b"\0"
            case Request.SET_INTERFACE | Request.SET_ADDRESS:
                pass
            case _:
                raise Stall
        return b""

    def _described(self, kind: int, number: int) -> bytes:
        if kind == Descriptor.DEVICE:
            return self.descriptor
        if kind == Descriptor.CONFIGURATION and number == 0:
            return self.configuration
        if kind == Descriptor.STRING and number <= len(self._strings):
            text = self._strings[number - 1].encode("utf-16-le") if number else struct.pack("<H", ENGLISH)
            return bytes((len(text) + 2, Descriptor.STRING)) + text
        raise Stall

    def _feature(self, setup: Setup, recipient: int) -> None:
        if recipient != RECIPIENT_ENDPOINT:
            return  # remote wake-up, which means nothing here
        if setup.value != ENDPOINT_HALT:
            raise Stall
        if setup.request == Request.SET_FEATURE:
            self.halted.add(setup.index)
        else:
            self.halted.discard(setup.index)
