"""A motor that turns until it is told otherwise: its lease, its acceleration, and what happens when it is held."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from behaviors.ports import StopReason
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.motion.brake_predictor import WATCH_S, Standstill
from nxtdrive.motion.leased_speed import RENEWALS, lease_deg
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S, braked, driven, sample
from nxtdrive.motion.scheduler import Cancelled, Steps

if TYPE_CHECKING:
    from nxtdrive.brick import Brick

RAMP_S = 0.1
"""Time between two speeds while speeding up or slowing down; the regulator acts no more often."""


class VelocityMove:
    """One motor, at one speed after the other.

    Args:
        brick: Where the motor is.
        port: And at which port.
        lease_s: About how long it goes on when nobody renews it.
        acceleration_deg_s2: How fast its speed changes; infinity: at once.
        stall_s: A motor that stands so long, though it should turn, is braked; infinity: never.

    Attributes:
        speed_deg_s: What it was told last, forward being positive; a duty cycle counts as the speed it is a part of.
    """

    def __init__(
        self, brick: Brick, port: OutputPort, lease_s: float, acceleration_deg_s2: float, stall_s: float
    ) -> None:
        self.speed_deg_s = 0.0
        self._brick = brick
        self._port = port
        self._lease_s = lease_s
        self._step_deg_s = acceleration_deg_s2 * RAMP_S
        self._stall_s = stall_s
        self._power = 0

    def steps(self, speed_deg_s: float, *, regulated: bool, until_s: float = math.inf) -> Steps[StopReason]:
        """Turn at `speed_deg_s` until then.

        Args:
            speed_deg_s: Forward is positive.
            regulated: Whether the firmware keeps the speed; else it keeps the duty cycle.
            until_s: On the link's clock; the motor goes on turning for its lease.

        Returns:
            DONE, or braked: STALLED, CANCELLED.
        """
        try:
            return (yield from self._turn(speed_deg_s, regulated, until_s))
        except Cancelled as reason:
            if not reason.replaced:
                with contextlib.suppress(LinkError):
                    self._brake()
            return StopReason.CANCELLED

    def _turn(self, goal_deg_s: float, regulated: bool, until_s: float) -> Steps[StopReason]:
        brick = self._brick
        self._accelerate(goal_deg_s, regulated, brick.request)
        standstill = Standstill(self._stall_s)
        standstill.begin(brick.now())
        while (now := brick.now()) < until_s:
            if self.speed_deg_s != goal_deg_s:
                yield min(until_s, now + RAMP_S)
                self._accelerate(goal_deg_s, regulated, brick.send)
                standstill.begin(brick.now())
            elif self._power == 0 or math.isinf(self._stall_s):
                yield until_s
            else:
                reading = sample(brick, self._port)
                standstill.note(reading.time_s, reading.angles_deg[0])
                if standstill.stalled:
                    self._brake()
                    return StopReason.STALLED
                yield min(until_s, now + min(WATCH_S, self._stall_s / 2))
        return StopReason.DONE

    def _accelerate(self, goal_deg_s: float, regulated: bool, tell: Callable[..., object]) -> None:
        """Come one step nearer to the goal, and renew the lease of that from now on."""
        change = goal_deg_s - self.speed_deg_s
        self.speed_deg_s += max(-self._step_deg_s, min(self._step_deg_s, change))
        self._power = round(self.speed_deg_s / FULL_SPEED_DEG_S * 100)
        limit_deg = lease_deg(self.speed_deg_s, self._lease_s)
        command = driven(self._port, self._power, limit_deg, regulated=regulated)
        self._brick.moves(self._port)
        tell(command)
        self._brick.repeat(self._port.name, command, self._lease_s / RENEWALS)

    def _brake(self) -> None:
        self.speed_deg_s, self._power = 0.0, 0
        self._brick.forget(self._port.name)
        self._brick.send(braked(self._port))
