"""A motor that turns until it is told otherwise: its lease, its acceleration, and what happens when it is held."""

from __future__ import annotations

import contextlib
import math

from behaviors.ports import StopReason
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.link.protocol import MotorLink
from nxtdrive.link.scheduler import Cancelled, Steps
from nxtdrive.motion.lease import Lease
from nxtdrive.motion.outputs import sample
from nxtdrive.motion.stall import WATCH_S, StallDetector

RAMP_S = 0.1
"""Time between two speeds while speeding up or slowing down; the regulator acts no more often."""


class VelocityMove:
    """One motor, at one speed after the other.

    Args:
        link: The way to the motor.
        port: Where it is plugged in.
        lease_s: How long it goes on when nothing renews it.
        acceleration_deg_s2: How fast its speed changes; infinity: at once.
        stall_s: A motor that stands for this time, though it should turn, is braked; infinity: never.

    Attributes:
        speed_deg_s: What it was told last, forward being positive; a duty cycle counts as the speed it is a part of.
    """

    def __init__(
        self, link: MotorLink, port: OutputPort, lease_s: float, acceleration_deg_s2: float, stall_s: float
    ) -> None:
        self.speed_deg_s = 0.0
        self._link = link
        self._port = port
        self._lease = Lease(link, port, lease_s)
        self._step_deg_s = acceleration_deg_s2 * RAMP_S
        self._stall_s = stall_s

    def steps(self, speed_deg_s: float, *, regulated: bool, until_s: float = math.inf) -> Steps[StopReason]:
        """Turn at `speed_deg_s` until then.

        Args:
            speed_deg_s: Forward is positive.
            regulated: Whether the firmware keeps the speed; else it keeps the duty cycle.
            until_s: On the link's clock; the motor goes on turning for its lease.

        Returns:
            DONE, or braked: STALLED, CANCELLED.

        Raises:
            LinkError: The brick cannot be reached; it was told to brake if possible, else the lease runs out.
        """
        try:
            return (yield from self._turn(speed_deg_s, regulated, until_s))
        except Cancelled as reason:
            if reason.replaced:
                self._lease.release()
            else:
                with contextlib.suppress(LinkError):
                    self._brake()
            return StopReason.CANCELLED
        except BaseException:
            with contextlib.suppress(LinkError):
                self._brake()
            raise

    def _turn(self, goal_deg_s: float, regulated: bool, until_s: float) -> Steps[StopReason]:
        link = self._link
        self._accelerate(goal_deg_s, regulated, confirmed=True)
        stall = StallDetector(self._stall_s)
        stall.begin(link.now())
        while (now := link.now()) < until_s:
            if self.speed_deg_s != goal_deg_s:
                yield min(until_s, now + RAMP_S)
                self._accelerate(goal_deg_s, regulated)
                stall.begin(link.now())
            elif self._lease.power == 0 or math.isinf(self._stall_s):
                yield until_s
            else:
                reading = sample(link, self._port)
                stall.note(reading.time_s, reading.angles_deg[0])
                if stall.stalled:
                    self._brake()
                    return StopReason.STALLED
                yield min(until_s, now + min(WATCH_S, self._stall_s / 2))
        return StopReason.DONE

    def _accelerate(self, goal_deg_s: float, regulated: bool, *, confirmed: bool = False) -> None:
        """Come one step nearer to the goal, and renew the lease of that from now on."""
        change = goal_deg_s - self.speed_deg_s
        self.speed_deg_s += max(-self._step_deg_s, min(self._step_deg_s, change))
        self._lease.drive(self.speed_deg_s, regulated=regulated, renewed=True, confirmed=confirmed)

    def _brake(self) -> None:
        self.speed_deg_s = 0.0
        self._lease.brake()
