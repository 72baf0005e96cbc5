"""Real-time pace of the simulator for interactive commands."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nxtdrive.transports.address import Address


def in_real_time(address: str | Address) -> Address:
    """Return the address with ``pace=realtime`` if it is simulated, recorded or not, and names no pace.

    Raises:
        AddressError: The text is not an address.
    """
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.record import with_brick

    return with_brick(Address.parse(address) if isinstance(address, str) else address, _paced)


def _paced(brick: Address) -> Address:
    if brick.scheme != "sim":
        return brick
    return replace(brick, options={**brick.options, "pace": brick.options.get("pace", "realtime")})
