"""USB descriptors of the NXT. Source: docs/firmware.md section 2, and the firmware's d_usb.c.

Only constants: programs that cannot import this project load the file by its path.
"""

from __future__ import annotations

DEVICE = bytes.fromhex("12 01 0002 00 00 00 08 9406 0200 0000 00 00 01 01")
"""Full speed, vendor 0694, product 0002, one string: the serial number, which is the Bluetooth address."""

CONFIGURATION = bytes.fromhex("09 02 2000 01 01 00 C0 00")
INTERFACE = bytes.fromhex("09 04 00 00 02 FF FF FF 00")
ENDPOINT_OUT, ENDPOINT_IN = 0x01, 0x82
PACKET_SIZE = 64
ENDPOINTS = [bytes.fromhex(f"07 05 {address:02X} 02 4000 00") for address in (ENDPOINT_OUT, ENDPOINT_IN)]
WHOLE_CONFIGURATION = CONFIGURATION + INTERFACE + b"".join(ENDPOINTS)
