"""Real-time pace of the simulator for interactive commands."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nxtdrive.transports.address import Address


def in_real_time(address: str) -> Address:
    """Return the address with ``pace=realtime`` if it is simulated, recorded or not, and names no pace.

    Raises:
        AddressError: The text is not an address.
    """
    from nxtdrive.transports.address import Address

    parsed = Address.parse(address)
    options = dict(parsed.options)
    if parsed.scheme == "sim":
        options.setdefault("pace", "realtime")
    elif parsed.scheme == "record" and "nxt" in options:
        options["nxt"] = str(in_real_time(options["nxt"]))
    return replace(parsed, options=options)
