"""The lease of a motor: the motor turns for a short while, and longer only if the lease is renewed."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress

from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.link.link import Link
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S, braked, driven

LEASE_S = 0.6
"""About how long a motor keeps turning after the program or the link has died."""
LEASE_RANGE_S = (0.3, 10.0)
"""A shorter lease would end between two renewals over a slow link, where reading wheels and a sensor takes 0.1 s."""
RENEWALS = 3
"""Renewals during the time of one lease."""
LEASE_DEG = 20.0
"""Shortest lease, so that that of a slow motor does not end between two renewals."""


class Lease:
    """The lease of one motor. A call that changes nothing sends nothing until half the lease is over.

    A new lease of a motor ends the renewals of the previous one.

    Args:
        link: The link to the brick.
        port: The motor's port.
        lease_s: How long the motor keeps turning without another telegram.
        round_trips: That the program may need between two calls of `drive`. If they take longer than the lease, it is
            renewed meanwhile.

    Attributes:
        power: The power last sent, percent.
    """

    def __init__(self, link: Link, port: OutputPort, lease_s: float = LEASE_S, *, round_trips: int = 0) -> None:
        self.power = 0
        self._link = link
        self._port = port
        self._lease_s = lease_s
        self._round_trips = round_trips
        self._begun_s = self._end_s = -math.inf

    def drive(
        self,
        speed_deg_s: float,
        *,
        left_deg: float = math.inf,
        regulated: bool = True,
        renewed: bool = False,
        confirmed: bool = False,
    ) -> bool:
        """Let the motor turn for one more lease, but no farther than `left_deg`.

        Args:
            speed_deg_s: Forward is positive; limited to the motor's full speed.
            left_deg: Longest distance, degrees.
            regulated: Whether the firmware regulates the speed; else it sets the power.
            renewed: Whether to renew the lease until the next call.
            confirmed: Whether to wait for the brick's reply.

        Returns:
            Whether the motor should have been turning in this direction since the previous call.
        """
        link, now = self._link, self._link.now()
        power = max(-100, min(100, round(speed_deg_s / FULL_SPEED_DEG_S * 100)))
        turning = power * self.power > 0 and now <= self._end_s
        if power == self.power and now < self._begun_s + self._lease_s / 2 and not renewed:
            return turning
        limit_deg = min(max(LEASE_DEG, abs(power) / 100 * FULL_SPEED_DEG_S * self._lease_s), left_deg)
        command = driven(self._port, power, round(limit_deg), regulated=regulated)
        link.mark_driven(self._port)
        link.cancel_timer(self._port.name)
        if confirmed:
            link.request(command)
        else:
            link.send(command)
        held_s = self._lease_s
        if renewed or (self._round_trips and power):
            held_s = math.inf if renewed else max(held_s, self._round_trips * link.latency_s)
            if held_s > self._lease_s:
                link.repeat(self._port.name, command, self._lease_s / RENEWALS, now + held_s)
        self.power, self._begun_s, self._end_s = power, now, now + held_s
        return turning

    def brake_at(self, time_s: float) -> None:
        """Stop the motor at `time_s` on the link's clock, even while a request waits for its reply."""
        self.release()
        self._link.send_at(self._port.name, braked(self._port), time_s)

    def brake(self) -> None:
        """Stop the motor now."""
        self.release()
        self._link.send(braked(self._port))

    def release(self) -> None:
        """Stop renewing the lease: another command follows, or the motor stops when the lease ends."""
        self._link.cancel_timer(self._port.name)
        self.power, self._begun_s, self._end_s = 0, -math.inf, -math.inf


def brake_all(leases: Sequence[Lease]) -> None:
    """Stop several motors now, all of them even if one cannot be reached."""
    with ExitStack() as stack:
        for lease in reversed(leases):
            stack.callback(lease.brake)


@contextmanager
def stopping_on_error(stop: Callable[[], None]) -> Iterator[None]:
    """Call `stop` when the block raises: the motors would keep turning until their leases end."""
    try:
        yield
    except BaseException:
        with suppress(LinkError):  # the leases stop them
            stop()
        raise
