"""The simulated brick on USB, for any program that uses pyusb.

This file needs only the standard library and pyusb, so that any interpreter can load it: the one that runs a user's
program need not have this project installed (see ``usb_hook/sitecustomize.py``).
"""

from __future__ import annotations

import errno
import os
import runpy
import struct
from array import array
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn, Protocol

import usb.backend
import usb.core

NXT = SimpleNamespace(**runpy.run_path(str(Path(__file__).with_name("nxt_descriptors.py"))))
"""By its path, for interpreters that cannot import this project."""

ENDPOINT_OUT, ENDPOINT_IN = NXT.ENDPOINT_OUT, NXT.ENDPOINT_IN
PACKET_SIZE = NXT.PACKET_SIZE
FULL_SPEED = 2
ENGLISH = 0x0409
SERIAL_NUMBER_INDEX = 1

GET_DESCRIPTOR, STRING_DESCRIPTOR = 0x06, 3
LIBUSB_TIMEOUT = -7


def _descriptor(layout: str, names: str, data: bytes, **more: object) -> SimpleNamespace:
    """Make a descriptor as pyusb expects it: its fields by name; `layout` is struct's."""
    return SimpleNamespace(**dict(zip(names.split(), struct.unpack(layout, data), strict=True)), **more)


DEVICE = _descriptor(
    "<BBHBBBBHHHBBBB",
    "bLength bDescriptorType bcdUSB bDeviceClass bDeviceSubClass bDeviceProtocol bMaxPacketSize0 idVendor idProduct"
    " bcdDevice iManufacturer iProduct iSerialNumber bNumConfigurations",
    NXT.DEVICE,
    # the device's place on the bus
    address=1,
    bus=1,
    port_number=1,
    port_numbers=(1,),
    speed=FULL_SPEED,
)
CONFIGURATION = _descriptor(
    "<BBHBBBBB",
    "bLength bDescriptorType wTotalLength bNumInterfaces bConfigurationValue iConfiguration bmAttributes bMaxPower",
    NXT.CONFIGURATION,
    extra_descriptors=[],
)
INTERFACE = _descriptor(
    "<9B",
    "bLength bDescriptorType bInterfaceNumber bAlternateSetting bNumEndpoints bInterfaceClass bInterfaceSubClass"
    " bInterfaceProtocol iInterface",
    NXT.INTERFACE,
    extra_descriptors=[],
)
ENDPOINTS = [
    _descriptor(
        "<BBBBHB",
        "bLength bDescriptorType bEndpointAddress bmAttributes wMaxPacketSize bInterval",
        data,
        bRefresh=0,
        bSynchAddress=0,
        extra_descriptors=[],
    )
    for data in NXT.ENDPOINTS
]


class Cable(Protocol):
    """Carries packets to and from the brick. OSError means that it is unplugged."""

    def write(self, packet: bytes, timeout_s: float | None) -> None:
        """Send a packet; TimeoutError if the brick accepts none. None waits without limit."""

    def read(self, timeout_s: float | None) -> bytes | None:
        """Return the next packet from the brick, or None on timeout. None as timeout waits without limit."""

    def close(self) -> None:
        """Unplug this end."""


class UsbBackend(usb.backend.IBackend):  # type: ignore[misc] # pyusb has no types
    """A bus with one brick, for pyusb's argument ``backend=``."""

    def __init__(self, plug_in: Callable[[], Cable], serial_number: str) -> None:
        """Make the bus.

        Args:
            plug_in: Makes a cable when a program claims the brick; raises BlockingIOError if another program has it,
                and any other OSError if the brick is gone.
            serial_number: The brick's address, 12 hex digits.
        """
        self._plug_in = plug_in
        self._serial_number = serial_number

    def enumerate_devices(self) -> Iterator[SimpleNamespace]:
        """Yield the only brick."""
        return iter([DEVICE])

    def get_parent(self, dev: object) -> None:
        """Return None: there is no hub."""

    def get_device_descriptor(self, dev: object) -> SimpleNamespace:  # noqa: ARG002
        """Return the device descriptor."""
        return DEVICE

    def get_configuration_descriptor(self, dev: object, config: int) -> SimpleNamespace:  # noqa: ARG002
        """Return the only configuration."""
        return [CONFIGURATION][config]

    def get_interface_descriptor(self, dev: object, intf: int, alt: int, config: int) -> SimpleNamespace:  # noqa: ARG002
        """Return the only interface."""
        return [[[INTERFACE]]][config][intf][alt]

    def get_endpoint_descriptor(self, dev: object, ep: int, intf: int, alt: int, config: int) -> SimpleNamespace:  # noqa: ARG002
        """Return one of the two endpoints, one for each direction."""
        return ENDPOINTS[ep]

    def open_device(self, dev: object) -> Handle:  # noqa: ARG002
        """Open the brick without claiming it."""
        return Handle(self._plug_in)

    def close_device(self, dev_handle: Handle) -> None:
        """Release the brick."""
        dev_handle.release()

    def set_configuration(self, dev_handle: Handle, config_value: int) -> None:  # noqa: ARG002
        """Do nothing: there is only one."""
        if config_value != CONFIGURATION.bConfigurationValue:
            _fail(errno.EINVAL)

    def get_configuration(self, dev_handle: Handle) -> int:  # noqa: ARG002
        """Return the number of the only configuration, which the operating system has set."""
        return int(CONFIGURATION.bConfigurationValue)

    def set_interface_altsetting(self, dev_handle: Handle, intf: int, altsetting: int) -> None:  # noqa: ARG002
        """Do nothing: there is only one."""
        if intf or altsetting:
            _fail(errno.EINVAL)

    def claim_interface(self, dev_handle: Handle, intf: int) -> None:
        """Claim the brick."""
        if intf:
            _fail(errno.EINVAL)
        dev_handle.claim()

    def release_interface(self, dev_handle: Handle, intf: int) -> None:  # noqa: ARG002
        """Release the brick."""
        dev_handle.release()

    def bulk_write(self, dev_handle: Handle, ep: int, intf: int, data: array[int], timeout: int) -> int:  # noqa: ARG002
        """Send packets of at most 64 bytes; each is one telegram to the brick."""
        if ep != ENDPOINT_OUT:
            _fail(errno.EINVAL)
        sent = bytes(data)
        for start in range(0, len(sent), PACKET_SIZE):
            dev_handle.write(sent[start : start + PACKET_SIZE], _seconds(timeout))
        return len(sent)

    def bulk_read(self, dev_handle: Handle, ep: int, intf: int, buff: array[int], timeout: int) -> int:  # noqa: ARG002
        """Read packets until one is short or the buffer is full."""
        if ep != ENDPOINT_IN:
            _fail(errno.EINVAL)
        filled = 0
        while filled < len(buff):
            packet = dev_handle.read(_seconds(timeout))
            if packet is None and filled:
                return filled
            if packet is None:
                _fail_late()
            if len(packet) > len(buff) - filled:
                _fail(errno.EOVERFLOW)
            buff[filled : filled + len(packet)] = array("B", packet)
            filled += len(packet)
            if len(packet) < PACKET_SIZE:
                break
        return filled

    def ctrl_transfer(
        self,
        dev_handle: Handle,  # noqa: ARG002
        bmRequestType: int,  # noqa: N803 - pyusb's names
        bRequest: int,  # noqa: N803
        wValue: int,  # noqa: N803
        wIndex: int,  # noqa: N803, ARG002
        data: array[int],
        timeout: int,  # noqa: ARG002
    ) -> int:
        """Return string descriptors; the brick stalls on other requests to the host."""
        if not bmRequestType & 0x80:
            return len(data)
        if (bRequest, wValue >> 8) != (GET_DESCRIPTOR, STRING_DESCRIPTOR):
            _fail(errno.EPIPE)
        if wValue & 0xFF == 0:
            text = ENGLISH.to_bytes(2, "little")
        elif wValue & 0xFF == SERIAL_NUMBER_INDEX:
            text = self._serial_number.encode("utf-16-le")
        else:
            _fail(errno.EPIPE)
        descriptor = bytes((len(text) + 2, STRING_DESCRIPTOR)) + text
        size = min(len(data), len(descriptor))
        data[:size] = array("B", descriptor[:size])
        return size

    def clear_halt(self, dev_handle: Handle, ep: int) -> None:
        """Do nothing: endpoints of the brick never halt."""

    def reset_device(self, dev_handle: Handle) -> None:
        """Discard unread packets."""
        dev_handle.discard()

    def is_kernel_driver_active(self, dev_handle: Handle, intf: int) -> bool:  # noqa: ARG002
        """Return False: no system has a kernel driver for the brick."""
        return False


class Handle:
    """One program's handle of the brick; its methods raise the errors that libusb would."""

    def __init__(self, plug_in: Callable[[], Cable]) -> None:
        self._plug_in = plug_in
        self._cable: Cable | None = None

    def claim(self) -> None:
        """Claim the brick once."""
        if self._cable is None:
            try:
                self._cable = self._plug_in()
            except BlockingIOError:
                _fail(errno.EBUSY)
            except OSError:
                _fail(errno.ENODEV)

    def release(self) -> None:
        """Release the brick."""
        if self._cable is not None:
            self._cable.close()
            self._cable = None

    def write(self, packet: bytes, timeout_s: float | None) -> None:
        """Send a packet."""
        try:
            self._claimed().write(packet, timeout_s)
        except TimeoutError:
            _fail_late()
        except OSError:
            _fail(errno.ENODEV)

    def read(self, timeout_s: float | None) -> bytes | None:
        """Return the next packet, or None on timeout."""
        try:
            return self._claimed().read(timeout_s)
        except OSError:
            _fail(errno.ENODEV)

    def discard(self) -> None:
        """Discard unread packets of the cable."""
        while self._cable is not None and self.read(0.0) is not None:
            pass

    def _claimed(self) -> Cable:
        if self._cable is None:
            raise OSError(errno.ENODEV, os.strerror(errno.ENODEV))
        return self._cable


def _seconds(timeout_ms: int) -> float | None:
    """Convert a timeout of libusb, where 0 means no limit."""
    return timeout_ms / 1000 if timeout_ms else None


def _fail(number: int) -> NoReturn:
    raise usb.core.USBError(os.strerror(number), None, number)


def _fail_late() -> NoReturn:
    kind: Any = getattr(usb.core, "USBTimeoutError", usb.core.USBError)  # pyusb before 1.1 has only one
    raise kind("Operation timed out", LIBUSB_TIMEOUT, errno.ETIMEDOUT)
