"""Speeds for motors, each with its lease."""

from __future__ import annotations

import math
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
RENEWALS = 3
"""How often a lease is renewed before it would end."""
LEASE_DEG = 20.0
"""Shortest lease: a slow motor's few degrees must not run out between two renewals."""


def lease_deg(speed_deg_s: float, lease_s: float) -> int:
    """How far a motor may turn at `speed_deg_s` without a renewal, degrees."""
    return round(max(LEASE_DEG, abs(speed_deg_s) * lease_s))


class LeasedSpeed:
    """Sets motors' speeds; a call with what has not changed sends nothing before half the lease is over.

    Whoever holds the throttle has the motor: what `Motor.run` and `Motor.dc` have begun is not renewed any more.

    Args:
        brick: Where the motors are.
        lease_s: How long a motor goes on when nothing is sent any more.
        trips: So many round trips the program may take from one call of `run` to the next. On a link on which they last
            longer than the lease, it is renewed for so long.
    """

    def __init__(self, brick: Brick, lease_s: float = LEASE_S, *, trips: int = 0) -> None:
        self._brick = brick
        self._lease_s = lease_s
        self._trips = trips
        self._given: dict[OutputPort, tuple[int, float, float]] = {}

    def run(self, port: OutputPort, speed_deg_s: float, left_deg: float = math.inf) -> bool:
        """Let a motor turn at a regulated speed for one more lease, but no farther than `left_deg`.

        Returns:
            Whether it should have been turning in this direction since the call before.
        """
        power = max(-100, min(100, round(speed_deg_s / FULL_SPEED_DEG_S * 100)))
        now = self._brick.now()
        given, since, end = self._given.get(port, (None, 0.0, 0.0))
        turning = given is not None and power * given > 0 and now <= end
        if power == given and now < since + self._lease_s / 2:
            return turning
        self._brick.moves(port)
        self._brick.forget(port.name)
        limit_deg = round(min(lease_deg(power / 100 * FULL_SPEED_DEG_S, self._lease_s), left_deg))
        command = driven(port, power, limit_deg, regulated=True)
        self._brick.send(command)
        away_s = self._trips * self._brick.latency_s if self._trips and power else 0.0
        if away_s > self._lease_s:
            self._brick.repeat(port.name, command, self._lease_s / RENEWALS, now + away_s)
        self._given[port] = (power, now, now + max(away_s, self._lease_s))
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
