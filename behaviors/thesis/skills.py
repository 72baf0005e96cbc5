"""The skills of the thesis: its services over the ports.

Each is called as the thesis's client called it over TCP: one call, one small integer back, the robot at rest or driving
on in between. `ThesisSearchSkill` has no verb of its own there: the first call of ``arrive`` searches until the target
is in view.

    ======== ============================== =====================================
    verb     skill                          answers
    ======== ============================== =====================================
    arrive   `ThesisSearchSkill`, then      0 continue, 1 arrived, 2 failed
             `ThesisArriveSkill`
    select   the record `exist`             0 never recognised, 1 recognised
    move_to  `MoveTo`                       0 moving, 1 done
    ======== ============================== =====================================

Source: docs/thesis.md, services and readings A2-A5, A10-A12.
"""

from __future__ import annotations

from enum import IntEnum

from behaviors.events import Event, Fact, Reason
from behaviors.failures import Failure
from behaviors.journal import RecordKind
from behaviors.motions import ResumableStraight, ResumableTurn
from behaviors.obstacle_watch import surroundings
from behaviors.ports import MotionResult, Sighting
from behaviors.skills import SHARP_DEG, SkillContext, note_look, pose_values, sighted, steering_deg_s

BLIND_DRIVE_S = 0.5
"""A target unseen for this long stops an approach's motors; one dropped frame does not."""
INSTANT_S = 0.001
"""A shorter rest of a wait is rounding: sleeping this little might let no time pass at all."""
SLICE_S = 0.5
"""A wait sleeps for at most this long at a time, so that it can be interrupted."""


class ArriveReply(IntEnum):
    """The small integers of ``arrive``."""

    CONTINUE = 0
    ARRIVED = 1
    FAILED = 2


REPLIES = {
    Event.TARGET_SEEN: ArriveReply.CONTINUE,
    Event.CONTINUED: ArriveReply.CONTINUE,
    Event.ARRIVED: ArriveReply.ARRIVED,
    Event.SEARCH_FAILED: ArriveReply.FAILED,
    Event.ARRIVE_FAILED: ArriveReply.FAILED,
    Event.MISTAKEN: ArriveReply.FAILED,
}
"""The reply of ``arrive`` to the thesis's client, by fact."""


class ThesisSearchSkill:
    """Stops and looks every few degrees through one full turn to the right.

    Args:
        context: What to work with.
        target: Name of the target.
    """

    def __init__(self, context: SkillContext, target: str) -> None:
        self._context = context
        self._target = target
        self._start_deg: float | None = None
        self._stop = 0

    def call(self) -> Fact:
        """Search until the target is confirmed or the turn is complete; the robot is at rest afterwards.

        Called again after an outage, it continues at the stop where it was.
        """
        thesis, body = self._context.thesis, self._context.body
        if self._start_deg is None:
            self._start_deg = body.pose().heading_deg
        stops = max(1, round(360.0 / thesis.look_every_deg))
        while True:
            self._context.check_time()
            if self._stop:
                # aimed at an absolute heading, so that the errors of single turns do not add up
                body.turn(self._start_deg + self._stop * 360.0 / stops - body.pose().heading_deg)
            if self._stop == stops:
                return Failure(Event.SEARCH_FAILED, Reason.FULL_TURN_WITHOUT_SIGHTING, {"looks": stops})
            sighting = self._look()
            self._stop += 1
            if sighting:
                return sighted(sighting, looks=self._stop)

    def _look(self) -> Sighting | None:
        context = self._context
        context.clock.sleep(context.thesis.settle_s)
        sighting = None
        for _ in range(context.thesis.looks_per_stop):
            sighting = context.vision.look(self._target)
            if sighting:
                break
        note_look(context, context.body.pose(), context.body.range_mm(), sighting)
        return sighting


class ThesisArriveSkill:
    """Drives towards what the camera sees.

    Args:
        context: What to work with.
        target: Name of the target.
    """

    def __init__(self, context: SkillContext, target: str) -> None:
        self._context = context
        self._target = target
        self._begun_s = self._seen_s = context.clock.now()

    def call(self) -> Fact:
        """Drive for one slice.

        Returns:
            CONTINUED with the robot driving on under its lease; ARRIVED or ARRIVE_FAILED with the robot at rest.
        """
        slice_end_s = self._context.clock.now() + self._context.thesis.continue_every_s
        while self._context.clock.now() < slice_end_s:
            self._context.check_time()
            fact = self._step()
            if fact:
                self._context.body.stop()
                self._context.watch.update(None)
                return fact
        return Fact(Event.CONTINUED, Reason.DRIVING_ON)

    def _step(self) -> Fact | None:
        """Look once and steer by it; a fact when the approach is over."""
        context, thesis = self._context, self._context.thesis
        sighting = context.vision.look(self._target)
        now_s = context.clock.now()
        note_look(context, context.body.pose(), context.body.range_mm(), sighting)
        if sighting:
            self._seen_s = now_s
            if sighting.distance_mm <= thesis.arrive_mm:
                return sighted(sighting, Event.ARRIVED, Reason.WITHIN_REACH)
            self._steer(sighting)
        unseen_s = now_s - self._seen_s
        if unseen_s >= thesis.lost_after_s:
            return self._failed(Reason.TARGET_LOST, unseen_s=unseen_s)
        if now_s - self._begun_s >= thesis.approach_limit_s:
            return self._failed(Reason.APPROACH_TIMEOUT, approach_s=now_s - self._begun_s)
        if unseen_s > BLIND_DRIVE_S:
            context.body.stop()
        return None

    def _failed(self, reason: Reason, **measured: float) -> Failure:
        return Failure(Event.ARRIVE_FAILED, reason, {**measured, **surroundings(self._context.body)})

    def _steer(self, sighting: Sighting) -> None:
        bearing_deg = sighting.bearing_deg
        speed_mm_s = self._context.thesis.cruise_mm_s * max(0.0, 1.0 - abs(bearing_deg) / SHARP_DEG)
        self._context.watch.update(self._context.body.drive(speed_mm_s, steering_deg_s(bearing_deg)))


class MoveTo:
    """Turns right by an angle, then advances step by step: eleven calls for ten advances.

    Called again after an outage, it completes the motion that was interrupted.

    Args:
        context: What to work with.
    """

    def __init__(self, context: SkillContext) -> None:
        self._context = context
        self._count = 0
        self._turn: ResumableTurn | None = None
        self._advance: ResumableStraight | None = None

    def call(self, direction_deg: float) -> int:
        """Make one call of the service.

        Args:
            direction_deg: Turn before the first advance, positive right.

        Returns:
            0 after an advance, 1 when all have been made.
        """
        body, thesis = self._context.body, self._context.thesis
        if self._count >= thesis.advances:
            self._count, self._turn = 0, None
            self._context.watch.update(None)
            return 1
        if self._turn is None:
            self._turn = ResumableTurn(body, direction_deg, body.pose())
        if not self._turn.done:
            turned = self._turn.call()
            self._note("turn", turned, turned_deg=turned.turned_deg)
        if self._advance is None:
            self._advance = ResumableStraight(body, thesis.advance_mm, body.pose())
        advanced = self._advance.call()
        self._advance = None
        self._count += 1
        self._context.watch.update(advanced.stop)
        self._note("advance", advanced, distance_mm=advanced.distance_mm)
        return 0

    def _note(self, what: str, result: MotionResult, **came: float) -> None:
        self._context.note(
            RecordKind.STEP, what=what, stop=result.stop, **came, pose=pose_values(self._context.body.pose())
        )


class ThesisMoveSkill:
    """The state move_to: the service, called until it is done.

    Args:
        context: What to work with.
        direction_deg: Turn before the first advance, positive right.
    """

    def __init__(self, context: SkillContext, direction_deg: float) -> None:
        self._context = context
        self._direction_deg = direction_deg
        self._service = MoveTo(context)
        self._calls = 0

    def call(self) -> Fact:
        """Move off; the robot is at rest afterwards."""
        done = 0
        while not done:
            self._context.check_time()
            self._context.note(RecordKind.CALL, verb="move_to", direction_deg=self._direction_deg)
            done = self._service.call(self._direction_deg)
            self._context.note(RecordKind.REPLY, verb="move_to", value=done)
            self._calls += 1
        return Fact(Event.RECOVERY_DONE, Reason.MOVED, {"calls": self._calls})


class ThesisWaitSkill:
    """The state wait: at rest for a fixed time, the brick kept awake.

    The remaining time is kept here and not in the chart, so that a wait that was interrupted continues.

    Args:
        context: What to work with.
        wait_s: How long.
    """

    def __init__(self, context: SkillContext, wait_s: float) -> None:
        self._context = context
        self._wait_s = wait_s
        self._left_s = wait_s

    def call(self) -> Fact:
        """Wait for the rest of the time."""
        context = self._context
        context.body.stop()
        context.body.keep_alive()
        while self._left_s > INSTANT_S:
            context.check_time()
            begun_s = context.clock.now()
            context.clock.sleep(min(SLICE_S, self._left_s))
            self._left_s -= context.clock.now() - begun_s
        return Fact(Event.RECOVERY_DONE, Reason.WAITED, {"waited_s": self._wait_s})
