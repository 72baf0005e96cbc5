"""A libusb context of our own that ends in order.

pyusb has one context per process and no public way to a second one. Its objects end in whatever order the garbage
collector finds them, and libusb crashes when a context ends before the devices and handles that belong to it.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from usb.backend import libusb1


class UsbContext(libusb1._LibUSB):  # type: ignore[misc] # pyusb has no types
    """A context that closes its handles and gives back its devices before it ends."""

    def __init__(self, lib: Any) -> None:  # noqa: ANN401 - ctypes
        self._handles: list[Any] = []
        self._devices: list[Any] = []
        super().__init__(lib)

    def enumerate_devices(self) -> Iterator[Any]:
        """Yield all devices on USB."""
        found = list(super().enumerate_devices())
        self._devices += found
        return iter(found)

    def open_device(self, dev: Any) -> Any:  # noqa: ANN401
        """Open a device."""
        handle = super().open_device(dev)
        self._handles.append(handle)
        return handle

    def close_device(self, dev_handle: Any) -> None:  # noqa: ANN401
        """Close a handle, once."""
        if dev_handle in self._handles:
            self._handles.remove(dev_handle)
            super().close_device(dev_handle)

    def release_interface(self, dev_handle: Any, intf: int) -> None:  # noqa: ANN401
        """Release an interface of a handle that is still open."""
        if dev_handle in self._handles:
            super().release_interface(dev_handle, intf)

    def _finalize_object(self) -> None:
        for handle in list(self._handles):
            self.close_device(handle)
        for device in self._devices:
            device.finalize()
        super()._finalize_object()
