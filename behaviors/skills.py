"""What a skill is, what every skill works with, and how skills steer and record what they see."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol, runtime_checkable

from behaviors.events import Event, Fact, Reason
from behaviors.journal import Note, RecordKind
from behaviors.mission import ThesisParameters
from behaviors.obstacle_watch import ObstacleWatch
from behaviors.pause import Pause
from behaviors.ports import Body, Clock, Pose, Sighting, Vision
from behaviors.wiring import WiringCheck

STEER_PER_S = 1.6
"""Turn rate per degree of bearing while approaching, 1/s; settles in about a second without swinging."""
STEER_LIMIT_DEG_S = 60.0
"""Fastest turn while approaching; faster blurs the picture."""
SHARP_DEG = 20.0
"""At this bearing an approach only turns; straight ahead it drives at full cruise."""


class TimeUp(Exception):
    """The mission's time is over; raised where a skill would begin its next bounded piece of work."""


@dataclass(slots=True)
class SkillContext:
    """The context that every skill works with.

    Attributes:
        body: The robot.
        vision: Its camera and detectors.
        clock: Mission time.
        thesis: The parameters of the thesis profile.
        note: Writes a record.
        report: Sends the chart a fact that does not end the skill.
        deadline_s: When the mission's time is over, on its clock; each pause postpones it.
        pause: The operator's.
        pauses: Beginning on the clock and duration of each pause, in seconds.
        wiring: Checks by every look whether the motors are connected as the mission says; None for no check.
        watch: Receives from every skill why its motions end, and reports it to the chart.
    """

    body: Body
    vision: Vision
    clock: Clock
    thesis: ThesisParameters
    note: Note
    report: Callable[[Fact], None]
    deadline_s: float = math.inf
    pause: Pause = field(default_factory=Pause)
    pauses: list[tuple[float, float]] = field(default_factory=list)
    wiring: WiringCheck | None = None
    watch: ObstacleWatch = field(init=False)

    def __post_init__(self) -> None:
        """Begin with nothing in the way."""
        self.watch = ObstacleWatch(self.body, self.report)

    def check_time(self) -> None:
        """Check whether there is time to continue; skills call this before each bounded piece of work.

        Raises:
            TimeUp: The mission's time is over.
            Paused: The operator pauses the mission.
            KeyboardInterrupt: The operator ends it.
        """
        self.pause.check()
        if self.clock.now() >= self.deadline_s:
            raise TimeUp

    def add_pause(self, duration_s: float) -> None:
        """Postpone the mission's deadline by a pause that ends now."""
        self.deadline_s += duration_s
        self.pauses.append((self.clock.now() - duration_s, duration_s))

    def active_s(self, since_s: float) -> float:
        """Return the time since a moment on the clock, without the pauses."""
        return self.clock.now() - since_s - sum(paused_s for begun_s, paused_s in self.pauses if begun_s >= since_s)


@runtime_checkable
class Skill(Protocol):
    """A skill at work.

    A fact that it returns ends it, except CONTINUED; `behaviors.chart.results_in` has the events that end a state. A
    failure is a `behaviors.failures.Failure`. What it reports to the chart meanwhile does not end it: the same skill
    continues, though the chart may be in another state, as when an approach stands to verify its target.
    """

    def call(self) -> Fact:
        """Do a bounded piece of work and report its result."""
        ...


def steering_deg_s(bearing_deg: float, per_s: float = STEER_PER_S, limit_deg_s: float = STEER_LIMIT_DEG_S) -> float:
    """Return the turn rate towards a bearing, deg/s: proportional up to a limit, positive right."""
    return max(-limit_deg_s, min(limit_deg_s, per_s * bearing_deg))


def sighted(
    sighting: Sighting, event: Event = Event.TARGET_SEEN, reason: Reason = Reason.SIGHTED, **measured: object
) -> Fact:
    """Return the fact that a sighting leads to, with further measurements for the journal."""
    return Fact(event, reason, {"sighting": sighting_values(sighting), **measured})


def note_look(context: SkillContext, pose: Pose, range_mm: float | None, sighting: Sighting | None) -> None:
    """Write a record of a look, with its pose and the echo there.

    Raises:
        WrongWiring: The looks so far show that the motors are not connected as the mission says.
    """
    context.note(
        RecordKind.LOOK,
        pose=pose_values(pose),
        range_mm=range_mm,
        sighting=None if sighting is None else sighting_values(sighting),
    )
    if context.wiring is not None:
        context.wiring.check_motors(context.body.dead_wheels())
        context.wiring.look(context.clock.now(), pose, range_mm, sighting)


def note_echo(context: SkillContext, pose: Pose, range_mm: float | None) -> None:
    """Write a record of an echo that was measured between two looks, with the pose."""
    context.note(RecordKind.ECHO, pose=pose_values(pose), range_mm=range_mm)


def pose_values(pose: Pose) -> list[float]:
    """Return a pose as plain values: x_mm, y_mm, heading_deg."""
    return [round(pose.x_mm, 1), round(pose.y_mm, 1), round(pose.heading_deg, 1)]


def sighting_values(sighting: Sighting) -> dict[str, object]:
    """Return a sighting as plain values; with where it is cut off, if it is."""
    cut = {"cut": sighting.cut.names, "bound": sighting.bound} if sighting.cut else {}
    return {
        "bearing_deg": round(sighting.bearing_deg, 2),
        "distance_mm": round(sighting.distance_mm, 1),
        "confidence": round(sighting.confidence, 3),
        "box": list(sighting.box),
        **cut,
    }
