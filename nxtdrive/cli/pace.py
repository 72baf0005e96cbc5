"""The pace of the simulator for programs that people watch."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from nxtdrive.transports.address import Address


def in_real_time(address: str) -> Address:
    """The same brick; a simulated one whose pace nobody chose lets time pass as the clock on the wall does.

    So does one that is recorded, with ``--trace``.

    Raises:
        AddressError: It is no address.
    """
    from nxtdrive.transports.address import Address

    parsed = Address.parse(address)
    options = dict(parsed.options)
    if parsed.scheme == "sim":
        options.setdefault("pace", "realtime")
    elif parsed.scheme == "record" and "nxt" in options:
        options["nxt"] = str(in_real_time(options["nxt"]))
    return replace(parsed, options=options)
