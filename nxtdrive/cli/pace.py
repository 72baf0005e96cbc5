"""The pace of the simulator for programs that people watch."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nxtdrive.transports.address import Address


def in_real_time(address: str) -> Address:
    """The same brick; a simulated one whose pace nobody chose lets time pass as the clock on the wall does.

    Raises:
        AddressError: It is no address.
    """
    from nxtdrive.transports.address import Address

    parsed = Address.parse(address)
    if parsed.scheme != "sim" or "pace" in parsed.options:
        return parsed
    return replace(parsed, options={**parsed.options, "pace": "realtime"})
