"""Timeouts of replies."""

from __future__ import annotations

from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from nxtdrive.transports.base import Transport

USB_REPLY_TIMEOUT_S = 1.0
"""Default timeout over USB, where a reply usually takes 2 ms."""
BLUETOOTH_REPLY_TIMEOUT_S = 2.0
"""Default timeout over Bluetooth, which loses nothing but stalls. Source: the RWTH toolbox (docs/connecting.md)."""
TIMEOUT_RANGE_S = (0.001, 3600.0)
"""Longer timeouts are refused: they mean to wait forever, which no transport can."""


def default_timeout_s(transport: Transport) -> float:
    """Return the default timeout of a reply; longer telegrams than USB has mean Bluetooth."""
    return USB_REPLY_TIMEOUT_S if transport.max_telegram <= USB_TELEGRAM_LIMIT else BLUETOOTH_REPLY_TIMEOUT_S
