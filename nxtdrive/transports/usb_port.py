"""The brick on a USB cable, through pyusb and libusb.

One packet is one telegram, without any header (docs/firmware.md section 2).
"""

from __future__ import annotations

import contextlib
import errno
import math
import sys
from collections.abc import Iterator
from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any, Self

import usb.core
import usb.util
from usb.backend import libusb1

from firmware_protocol.errors import (
    AddressError,
    BrickNotFound,
    LinkBusy,
    LinkError,
    LinkLost,
    LinkTimeout,
    LocalProtocolError,
    PermissionDenied,
    system_words,
)
from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from nxtdrive.host.access import usb_remedy
from nxtdrive.transports.address import BRICK_ID, Address
from nxtdrive.transports.base import WallClock, closed
from nxtdrive.transports.usb_context import UsbContext

if TYPE_CHECKING:
    from usb.backend import IBackend
    from usb.core import Device

VENDOR, PRODUCT = 0x0694, 0x0002
SAMBA = 0x03EB, 0x6124
"""Vendor and product of the brick's processor while it waits for a firmware. Source: Atmel, AT91SAM7S data sheet."""
ENDPOINT_OUT, ENDPOINT_IN = 0x01, 0x82
"""Source of all of these: docs/firmware.md section 2."""

SEND_TIMEOUT_MS = 1000
LOOK_EVERY_S = 1.0
LOOK_MS = 1
"""Interval and duration of checks for surplus packets; rare, since USB itself delivers each packet once."""
STALE_PACKETS = 8
"""Upper bound of the replies that can be left over from a program that died."""

_UNREADABLE = (ValueError, NotImplementedError, usb.core.USBError)
"""Exceptions of pyusb for texts of a device that cannot be opened."""

_PLUG_IN = "Plug the brick in and switch it on, then wait a few seconds."
_HOLDERS = (
    "Close the other program that holds the brick: another nxtdrive, an nxt-server, LEGO's or Bricx's software, "
    "or a virtual machine that has taken it over."
)
_NO_LIBUSB = (
    "Install libusb 1.0 (Debian: `sudo apt install libusb-1.0-0`; macOS: `brew install libusb`; "
    "Windows: install nxtdrive again, which brings it)."
)


class UsbTransport(WallClock):
    """``usb://`` for the first brick, ``usb://0016530A1B2C`` for a specific one."""

    max_telegram = USB_TELEGRAM_LIMIT

    def __init__(self, device: Device, address: str, backend: IBackend | None = None) -> None:
        self.address = address
        self._device: Device | None = device
        self._backend = backend
        self._looked_at = -math.inf
        self._found = b""

    @classmethod
    def open(
        cls,
        address: Address,
        timeout_s: float = 1.0,  # noqa: ARG003 - opened like any other
        *,
        backend: IBackend | None = None,
    ) -> Self:
        """Find the brick and claim it.

        Args:
            address: Its id may be empty; colons in it do not matter.
            timeout_s: Not used: USB answers at once.
            backend: Another libusb, e.g. a simulated one. By default each call makes a fresh libusb context, because
                without udevd an old context does not see a brick that was plugged in again.

        Raises:
            AddressError: The target is not an id.
            BrickNotFound: There is no brick on USB, or no libusb to search with.
            PermissionDenied: The operating system denies this user access.
            LinkBusy: Another program has claimed the brick.
        """
        address.read_options({})
        wanted = address.target.replace(":", "").upper()
        if wanted and not BRICK_ID.fullmatch(wanted):
            raise AddressError(f"{address}: a brick's id has 12 hex digits, e.g. usb://0016530A1B2C.")
        with _translated(str(address)):
            device = _find(wanted, backend or _fresh_backend())
            try:
                device.set_configuration()
                _discard_stale(device)  # pyusb claims the interface first
                return cls(device, f"usb://{_serial_number(device)}", backend)
            except BaseException:
                _release(device)
                raise

    @classmethod
    def discover(cls, backend: IBackend | None = None) -> list[str]:
        """Return the addresses of all bricks on USB; a brick this user may not open appears as plain ``usb://``."""
        with _translated("usb://"):
            return [f"usb://{_serial_number(device)}" for device in _bricks(backend or _fresh_backend())]

    def send(self, telegram: bytes) -> None:
        """Write one packet."""
        if len(telegram) > USB_TELEGRAM_LIMIT:
            raise LocalProtocolError(
                f"a telegram over USB has at most {USB_TELEGRAM_LIMIT} bytes, not {len(telegram)}."
            )
        device = self._opened()
        with _translated(self.address):
            try:
                written = device.write(ENDPOINT_OUT, telegram, SEND_TIMEOUT_MS)
            except usb.core.USBError as error:
                if error.errno != errno.EPIPE:
                    raise
                device.clear_halt(ENDPOINT_OUT)  # the halted endpoint has not taken the telegram
                written = device.write(ENDPOINT_OUT, telegram, SEND_TIMEOUT_MS)
        if written != len(telegram):
            raise LinkTimeout(f"{self.address} took only part of a telegram.")

    def receive(self, timeout_s: float) -> bytes | None:
        """Read one packet."""
        packet, self._found = self._found, b""
        return packet or self._read(max(1, round(timeout_s * 1000)))  # libusb interprets 0 as "no timeout"

    def waiting(self) -> bool:
        """Check for a packet once a second; between the checks return False."""
        self._opened()
        if not self._found and self.now() >= self._looked_at + LOOK_EVERY_S:
            self._looked_at = self.now()
            self._found = self._read(LOOK_MS) or b""
        return bool(self._found)

    def _read(self, timeout_ms: int) -> bytes | None:
        device = self._opened()
        with _translated(self.address):
            try:
                return bytes(device.read(ENDPOINT_IN, USB_TELEGRAM_LIMIT, timeout_ms))
            except usb.core.USBTimeoutError:
                return None
            except usb.core.USBError as error:
                if error.errno != errno.EPIPE:
                    raise
                device.clear_halt(ENDPOINT_IN)
                return None

    def close(self) -> None:
        """Release the brick."""
        if self._device is not None:
            device, self._device = self._device, None
            _release(device)

    def reopen(self, timeout_s: float) -> Self:
        """Open the same brick again, found by its id through a fresh libusb context."""
        return self.open(Address.parse(self.address), timeout_s, backend=self._backend)

    def _opened(self) -> Device:
        if self._device is None:
            raise closed(self.address)
        return self._device


def _fresh_backend() -> IBackend:
    backend = libusb1.get_backend(find_library=_libusb)
    if backend is None:
        raise BrickNotFound("USB cannot be searched: this computer has no libusb.", remedy=_NO_LIBUSB)
    if not isinstance(backend, libusb1._LibUSB):  # replaced by another bus, e.g. that of `nxtdrive sim exec`
        return backend
    return UsbContext(libusb1._lib)


def _libusb(name: str) -> str | None:
    """Find libusb: Linux brings one with udev; elsewhere it comes as a Python package, which pyusb does not search."""
    from ctypes.util import find_library

    packaged = import_module("libusb_package").find_library if find_spec("libusb_package") else find_library
    places = (find_library, packaged) if sys.platform == "linux" else (packaged, find_library)
    return places[0](name) or places[1](name)


def _bricks(backend: IBackend) -> list[Any]:
    return list(usb.core.find(find_all=True, idVendor=VENDOR, idProduct=PRODUCT, backend=backend))


def lego_devices(backend: IBackend | None = None) -> list[tuple[int, int, str]]:
    """Return vendor, product and name of all LEGO devices on USB, and of bricks that wait for a firmware (`SAMBA`).

    Raises:
        BrickNotFound: There is no libusb to search with.
    """

    def match(device: Device) -> bool:
        return device.idVendor == VENDOR or (device.idVendor, device.idProduct) == SAMBA

    with _translated("usb://"):
        found = usb.core.find(find_all=True, custom_match=match, backend=backend or _fresh_backend())
        return [(device.idVendor, device.idProduct, _product_name(device)) for device in found]


def _product_name(device: Device) -> str:
    """Return the name that a device gives itself; an NXT has none, and others may not be readable."""
    try:
        return device.product or ""
    except _UNREADABLE:
        return ""


def _find(wanted: str, backend: IBackend) -> Device:
    bricks = _bricks(backend)
    if not bricks:
        raise BrickNotFound("no brick on USB.", remedy=_PLUG_IN)
    if not wanted:
        return bricks[0]
    ids = [_serial_number(device) for device in bricks]
    if wanted in ids:
        return bricks[ids.index(wanted)]
    if "" in ids:
        raise _not_allowed()
    raise BrickNotFound(f"no brick {wanted} on USB.", remedy=f"There are: {', '.join(ids)}.")


def _serial_number(device: Device) -> str:
    """Return the brick's id, or an empty string if this user may not read it."""
    try:
        return str(device.serial_number).upper()
    except _UNREADABLE:
        return ""


def _release(device: Device) -> None:
    with contextlib.suppress(usb.core.USBError):
        usb.util.dispose_resources(device)


def _discard_stale(device: Device) -> None:
    """Discard replies left over from a program that died."""
    for _ in range(STALE_PACKETS):
        try:
            device.read(ENDPOINT_IN, USB_TELEGRAM_LIMIT, 1)
        except usb.core.USBTimeoutError:
            return
        except usb.core.USBError as error:
            if error.errno != errno.EPIPE:
                raise
            device.clear_halt(ENDPOINT_IN)


def _not_allowed() -> PermissionDenied:
    return PermissionDenied("this user may not open the brick on USB.", remedy=usb_remedy())


@contextlib.contextmanager
def _translated(address: str) -> Iterator[None]:
    """Translate exceptions of pyusb to the driver's own."""
    try:
        yield
    except NotImplementedError as error:  # pyusb's translation of LIBUSB_ERROR_NOT_SUPPORTED
        raise LinkError(
            f"{address}: another driver has the brick ({error}).",
            remedy="On Windows replace LEGO's driver with WinUSB, using Zadig (zadig.akeo.ie).",
        ) from error
    except usb.core.USBTimeoutError as error:
        raise LinkTimeout(f"{address} accepts no more telegrams.", remedy="Is the brick still on?") from error
    except usb.core.USBError as error:
        if error.errno == errno.EACCES:
            raise _not_allowed() from error
        if error.errno == errno.EBUSY:
            raise LinkBusy(f"{address} is in use.", remedy=_HOLDERS) from error
        if error.errno in (errno.ENODEV, errno.EIO, errno.ENOENT, errno.ESHUTDOWN, errno.EPROTO, errno.EPIPE):
            raise LinkLost(f"the cable to {address} is unplugged: {system_words(error)}.", remedy=_PLUG_IN) from error
        raise LinkError(f"{address}: {system_words(error)}.", remedy="Unplug it and plug it in again.") from error
