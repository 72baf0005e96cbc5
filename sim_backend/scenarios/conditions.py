"""The conditions of a scenario besides its room: the link, the view, and the mission's data of the robot."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sim_backend.link import NO_FAULTS, LinkFaults
from sim_backend.world.sensing import VIEW_RANGE_MM

TIME_LIMIT_S = 300.0
"""A mission's usual time limit; a class may have another one, the same for all profiles."""
USB_MS, BLUETOOTH_MS = 2.0, (30.0, 65.0)
"""Round-trip times of the two links, the second as a range; see `nxtdrive.transports.sim`."""


@dataclass(frozen=True, slots=True)
class CameraLoss:
    """An outage of the camera, which is unplugged once a target has been in view for a while.

    Attributes:
        target: Name of the target.
        after_s: Time in view before the outage.
        lasts_s: How long it stays unplugged.
    """

    target: str
    after_s: float
    lasts_s: float


@dataclass(frozen=True, slots=True)
class ViewConditions:
    """Conditions that degrade the view, besides the obstacles in the room.

    Attributes:
        farthest_mm: Range of geometric vision.
        hit_rate: Share of the frames in which geometric vision detects a visible target.
        lookalikes: Pictures that geometric vision sometimes mistakes for a target.
        mistake_rate: Share of the frames showing a look-alike in which it does.
        mistake_rates: The same for each look-alike on its own, in place of `mistake_rate`.
        losses: Outages of the camera.
    """

    farthest_mm: float = math.inf
    hit_rate: float = 1.0
    lookalikes: tuple[str, ...] = ()
    mistake_rate: float = 0.0
    mistake_rates: tuple[float, ...] = ()
    losses: tuple[CameraLoss, ...] = ()

    @property
    def range_mm(self) -> float:
        """Largest distance at which a print can be recognised."""
        return min(VIEW_RANGE_MM, self.farthest_mm)


@dataclass(frozen=True, slots=True)
class Conditions:
    """The conditions of a scenario outside its world file.

    Attributes:
        faults: Faults of the link.
        latency_ms: Round-trip time of the link.
        view: Conditions that degrade the view.
        robot: The mission's table of the same name.
        time_limit_s: The mission's time limit.
    """

    faults: LinkFaults = NO_FAULTS
    latency_ms: float = USB_MS
    view: ViewConditions = field(default_factory=ViewConditions)
    robot: Mapping[str, Any] = field(default_factory=dict)
    time_limit_s: float = TIME_LIMIT_S
