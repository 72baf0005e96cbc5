"""How long replies take, and how long they may take."""

from __future__ import annotations

from firmware_protocol.framing import USB_TELEGRAM_LIMIT
from nxtdrive.transports.base import Transport

CABLE_ANSWER_S = 1.0
"""How long a reply may take over USB, where 2 ms are usual."""
RADIO_ANSWER_S = 2.0
"""Over Bluetooth, which loses nothing but falters. Source: the RWTH toolbox (docs/connecting.md)."""

LATENCY_EVERY_S = 0.05
"""How often a round trip is measured; measuring each would cost every request."""
LATENCIES = 15
"""Round trips of which the median is taken."""


def answer_s(transport: Transport) -> float:
    """How long a reply may take on such a link by default; Bluetooth is told by its longer telegrams."""
    return CABLE_ANSWER_S if transport.max_telegram <= USB_TELEGRAM_LIMIT else RADIO_ANSWER_S
