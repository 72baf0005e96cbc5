"""Speeds for motors, each with its lease."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from firmware_protocol.enums import OutputPort
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S, braked, driven

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

LEASE_S = 0.6
"""A motor that nobody stops goes on for about this time after the program or the link has died."""
LEASE_RANGE_S = (0.3, 10.0)
"""A shorter lease would run out between two renewals over a slow link; a look at wheels and a sensor takes 0.1 s."""
LEASE_DEG = 20.0
"""Shortest lease: a slow motor's few degrees must not run out between two renewals."""


def lease_deg(speed_deg_s: float, lease_s: float) -> int:
    """How far a motor may turn at `speed_deg_s` without a renewal, degrees."""
    return round(max(LEASE_DEG, abs(speed_deg_s) * lease_s))


class Throttle:
    """Sets motors' speeds; what has not changed is not sent again before half the lease is over.

    Whoever holds the throttle has the motor: what `Motor.run` and `Motor.dc` have begun is not renewed any more.
    """

    def __init__(self, brick: Brick, lease_s: float = LEASE_S) -> None:
        self._brick = brick
        self._lease_s = lease_s
        self._given: dict[OutputPort, tuple[int, float]] = {}

    def run(self, port: OutputPort, speed_deg_s: float) -> bool:
        """Let a motor turn at a regulated speed for one more lease.

        Returns:
            Whether it should have been turning in this direction since the call before.
        """
        power = max(-100, min(100, round(speed_deg_s / FULL_SPEED_DEG_S * 100)))
        now = self._brick.now()
        given, since = self._given.get(port, (None, 0.0))
        turning = given is not None and power * given > 0 and now <= since + self._lease_s
        if power == given and now < since + self._lease_s / 2:
            return turning
        self._brick.moves(port)
        self._brick.forget(port.name)
        limit_deg = lease_deg(power / 100 * FULL_SPEED_DEG_S, self._lease_s)
        self._brick.send(driven(port, power, limit_deg, regulated=True))
        self._given[port] = (power, now)
        return turning

    def brake_at(self, ports: Iterable[OutputPort], time_s: float) -> None:
        """Stop motors at that time on the link's clock, whatever else is being asked then."""
        self._given.clear()
        for port in ports:
            self._brick.send_at(port.name, braked(port), time_s)

    def brake(self, ports: Iterable[OutputPort]) -> None:
        """Stop motors now."""
        self._given.clear()
        for port in ports:
            self._brick.forget(port.name)
            self._brick.send(braked(port))
