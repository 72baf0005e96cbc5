"""A USB cable to a simulated brick in the same process, for `sim_backend.doors.usb_backend`."""

from __future__ import annotations

from sim_backend.link import SimLink

FOR_EVER_MS = 3_600_000


class LinkCable:
    """A cable over a `SimLink`; simulation time advances only while a program reads."""

    def __init__(self, link: SimLink) -> None:
        self._link = link

    def write(self, packet: bytes, timeout_s: float | None) -> None:  # noqa: ARG002 - the link takes it at once
        """Send a packet."""
        self._link.send(packet)

    def read(self, timeout_s: float | None) -> bytes | None:
        """The next packet; an unlimited wait ends after an hour of simulation time."""
        return self._link.receive(FOR_EVER_MS if timeout_s is None else round(timeout_s * 1000))

    def close(self) -> None:
        """Unplug."""
        self._link.close()
