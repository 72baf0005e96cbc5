"""A motor that turns until the next command: renewal of its lease, acceleration, stall detection."""

from __future__ import annotations

import contextlib
import math

from behaviors.ports import StopReason
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkError
from nxtdrive.link.link import Link
from nxtdrive.link.scheduler import Cancelled, Steps
from nxtdrive.motion.lease import Lease
from nxtdrive.motion.outputs import sample
from nxtdrive.motion.stall import WATCH_S, StallDetector

RAMP_S = 0.1
"""Time between two speeds of a ramp; the regulator is not faster."""


class VelocityMove:
    """A motor that keeps a speed until the next command.

    Args:
        link: The link to the brick.
        port: The motor's port.
        lease_s: How long it keeps turning without a renewal.
        acceleration_deg_s2: How fast its speed changes; infinity: at once.
        stall_s: A motor that stands for this time although it should turn is braked; infinity: never.

    Attributes:
        speed_deg_s: The last command, forward positive; a duty cycle counts as its share of the full speed.
    """

    def __init__(
        self, link: Link, port: OutputPort, lease_s: float, acceleration_deg_s2: float, stall_s: float
    ) -> None:
        self.speed_deg_s = 0.0
        self._link = link
        self._port = port
        self._lease = Lease(link, port, lease_s)
        self._step_deg_s = acceleration_deg_s2 * RAMP_S
        self._stall_s = stall_s

    def steps(self, speed_deg_s: float, *, regulated: bool, until_s: float = math.inf) -> Steps[StopReason]:
        """Turn at `speed_deg_s` until `until_s`.

        Args:
            speed_deg_s: Forward is positive.
            regulated: Whether the firmware regulates the speed; else it sets the duty cycle.
            until_s: On the link's clock; afterwards the motor keeps turning until its lease ends.

        Returns:
            DONE, or braked: STALLED, CANCELLED.

        Raises:
            LinkError: The brick cannot be reached; the motors were braked if possible, else the lease runs out.
        """
        try:
            return (yield from self._turn(speed_deg_s, regulated, until_s))
        except Cancelled as reason:
            if reason.replaced:
                self._lease.release()
            else:
                with contextlib.suppress(LinkError):
                    self._lease.brake()
            return StopReason.CANCELLED
        except BaseException:
            with contextlib.suppress(LinkError):
                self._lease.brake()
            raise

    def _turn(self, goal_deg_s: float, regulated: bool, until_s: float) -> Steps[StopReason]:
        link = self._link
        self._accelerate(goal_deg_s, regulated, confirmed=True)
        stall = StallDetector(self._stall_s)
        while (now := link.now()) < until_s:
            if self.speed_deg_s != goal_deg_s:
                yield min(until_s, now + RAMP_S)
                self._accelerate(goal_deg_s, regulated)
                continue
            if self._lease.power and math.isfinite(self._stall_s):
                reading = sample(link, self._port)
                stall.update(reading.time_s, reading.angles_deg[0])
                if stall.stalled:
                    self._lease.brake()
                    return StopReason.STALLED
            yield min(until_s, now + min(WATCH_S, self._stall_s / 2))  # a step ends the motion if the link was lost
        return StopReason.DONE

    def _accelerate(self, goal_deg_s: float, regulated: bool, *, confirmed: bool = False) -> None:
        """Change the speed by one step towards the goal, and renew the lease at that speed."""
        change = goal_deg_s - self.speed_deg_s
        self.speed_deg_s += max(-self._step_deg_s, min(self._step_deg_s, change))
        self._lease.drive(self.speed_deg_s, regulated=regulated, renewed=True, confirmed=confirmed)
