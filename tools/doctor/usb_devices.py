"""Devices on USB that look like a brick but do not run LEGO's firmware for the NXT."""

from __future__ import annotations

from collections.abc import Iterator

from nxtdrive.transports.usb_port import PRODUCT, SAMBA, VENDOR, lego_devices

from .finding import Finding, warning

_INSTALL = "Install LEGO's firmware 1.29 with LEGO's own software or Bricx; nxtdrive installs no firmware."
_ONLY_NXT = "nxtdrive drives only the NXT."

_OTHERS = {
    (VENDOR, 0x0005): ("an EV3, not an NXT.", _ONLY_NXT),
    (VENDOR, 0x0006): ("an EV3 that waits for a firmware, not an NXT.", _ONLY_NXT),
    (VENDOR, 0xFF00): ("an NXT that runs leJOS or NxOS, not LEGO's firmware.", _INSTALL),
    SAMBA: ("a device in firmware update mode (SAM-BA), probably an NXT: it clicks and its display is dark.", _INSTALL),
}
"""Source: pybricks-micropython, lib/lego/lego_usb.h; leJOS and NxOS, USB descriptors; Atmel, AT91SAM7S data sheet."""


def other_devices() -> Iterator[Finding]:
    """Name the devices that nxtdrive does not use although they look like a brick."""
    for vendor, product, name in lego_devices():
        if (vendor, product) == (VENDOR, PRODUCT):
            # Pybricks keeps LEGO's ids and adds itself to the name; LEGO's firmware has no name
            if "pybricks" in name.lower():
                yield warning("USB device", f"an NXT that runs Pybricks ({name}), not LEGO's firmware.", _INSTALL)
            continue
        other = f"another LEGO device, {name}".removesuffix(", ") + f" ({vendor:04x}:{product:04x})."
        yield warning("USB device", *_OTHERS.get((vendor, product), (other, _ONLY_NXT)))
