"""The base class of the baselines: targets in order, journal, time limit, outages, and motors off at the end.

A profile runs on `behaviors.executive.Executive`. A baseline does not choose among recoveries, so it is a small
executive of its own: it uses the same ports and skills and writes the same journal.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from contextlib import suppress

from behaviors.events import Event, Fact, Reason
from behaviors.executive import Ending, Report
from behaviors.journal import JOURNAL_FORMAT, Record, RecordKind
from behaviors.motions import ResumableStraight, ResumableTurn
from behaviors.observers import Observers
from behaviors.outages import OutageSupervisor, part_of
from behaviors.ports import MotionResult, Outage, Sighting, StopReason
from behaviors.skills import SkillContext, TimeUp
from behaviors.target_queue import TargetOutcome, TargetQueue
from behaviors.thesis.skills import ThesisArriveSkill, ThesisSearchSkill
from nxtdrive.simulated.robot import ScenarioRobot


class Baseline(ABC):
    """One mission, driven by a simple rule.

    Args:
        robot: The robot.
    """

    def __init__(self, robot: ScenarioRobot) -> None:
        self.body, self.vision, self.clock = robot.ports
        self.mission, self._observers = robot.mission, Observers(robot.observers)
        self._start_s = self.clock.now()
        self.deadline_s = self._start_s + self.mission.mission.time_limit_s
        self.context = SkillContext(*robot.ports, self.mission.thesis, self.note, self._note_outage, self.deadline_s)
        self._outages = OutageSupervisor(self.context, self.mission.mission.reconnect_timeout_s)
        self.queue = TargetQueue(self.mission.mission.targets)
        self._state = self._resumed = "idle"
        self._path: list[str] = []

    @abstractmethod
    def pursue(self, target: str) -> bool:
        """Pursue one target and leave the robot at rest; return True if it was reached, False to give it up."""

    def preferred(self) -> str:
        """Return the target to continue with; by default the next one in order."""
        return ""

    def run(self) -> Report:
        """Pursue the targets in order and return the report, as `behaviors.executive.Executive.run` does."""
        ending, error = Ending.BROKEN, ""
        table = self.mission.mission
        self.note(RecordKind.START, format=JOURNAL_FORMAT, mission=table.name, targets=list(table.targets))
        try:
            with self._outages.recording_sensors():
                ending = self._pursue_all()
        except TimeUp:
            ending = Ending.TIME_UP
        except Outage as outage:
            ending, error = Ending(f"{part_of(outage)}_lost"), str(outage)
        finally:
            with suppress(Outage):
                self.body.stop()
            outcomes = {progress.target: progress.outcome.value for progress in self.queue.targets}
            self.note(RecordKind.END, ending=ending, targets=outcomes, error=error)
        return Report(ending, self.queue.targets, self._path, self.now(), error, dict(self._observers.failures))

    def now(self) -> float:
        """Return the mission time in seconds."""
        return self.clock.now() - self._start_s

    def note(self, kind: RecordKind, **data: object) -> None:
        """Pass a record with the current time, state and target on to the observers."""
        self._observers(Record.of(self.now(), kind, self._state, self.queue.target, data))

    def enter(self, state: str, event: Event | None = None, reason: Reason | None = None) -> None:
        """Enter another state, named as in the mission's chart."""
        source, self._state = self._state, state
        self._path.append(state)
        why = {} if reason is None else {"reason": reason}
        self.note(RecordKind.TRANSITION, source=source, to=state, event=event, **why)

    def choose(self, choice: str, why: str, reason: Reason, *, seen_since_search: bool, **numbers: float) -> None:
        """Journal a failure and the choice that it leads to, in the order of a profile's journal.

        Args:
            choice: Name of the recovery.
            why: One clause.
            reason: The failure's name.
            seen_since_search: Whether the target was seen, so that the approach failed and not the search.
            numbers: The choice's numbers, as in `behaviors.recoveries.Choice`.
        """
        evidence = {"reason": reason, "seen_since_search": seen_since_search}
        self.note(RecordKind.CHOICE, choice=choice, why=why, **numbers, evidence=evidence)
        self.enter("select", Event.ARRIVE_FAILED if seen_since_search else Event.SEARCH_FAILED, reason)

    def search(self, target: str) -> Reason:
        """Search as the thesis does; return SIGHTED or the reason for the failure."""
        self.enter("search")
        self.queue.current.attempts += 1
        return self._outages.run(ThesisSearchSkill(self.context, target).call).reason

    def arrive(self, target: str) -> Reason:
        """Approach as the thesis does, again after an outage; return WITHIN_REACH or the reason for the failure."""
        self.enter("arrive", Event.TARGET_SEEN, Reason.SIGHTED)
        return self._outages.run(lambda: self._approach(target))

    def turn(self, angle_deg: float) -> MotionResult:
        """Turn on the spot, positive to the right; an interrupted turn is completed after the outage."""
        return self._outages.run(ResumableTurn(self.body, angle_deg, self._outages.run(self.body.pose)).call)

    def straight(self, distance_mm: float) -> MotionResult:
        """Drive along the heading, backwards if negative; an interrupted drive is completed after the outage."""
        return self._outages.run(ResumableStraight(self.body, distance_mm, self._outages.run(self.body.pose)).call)

    def drive(self, speed_mm_s: float, turn_deg_s: float = 0.0) -> StopReason | None:
        """Keep driving or turning until the next call, for at most one lease."""
        return self._outages.run(lambda: self.body.drive(speed_mm_s, turn_deg_s))

    def stop(self) -> None:
        """Switch the motors off."""
        self._outages.run(self.body.stop)

    def look(self, target: str) -> Sighting | None:
        """Look for a target in the next frame."""
        return self._outages.run(lambda: self.vision.look(target))

    def rest(self, duration_s: float) -> None:
        """Wait; the time of an outage counts."""
        end_s = self.clock.now() + duration_s
        self._outages.run(lambda: self.clock.sleep(max(0.0, end_s - self.clock.now())))

    def _approach(self, target: str) -> Reason:
        skill = ThesisArriveSkill(self.context, target)
        while True:
            self.context.check_time()
            fact = skill.call()
            if fact.event is not Event.CONTINUED:
                return fact.reason

    def _note_outage(self, fact: Fact) -> None:
        """Journal that the mission is suspended or resumed."""
        if fact.event in (Event.LINK_LOST, Event.CAMERA_LOST, Event.SENSOR_LOST):
            self._resumed = self._state
            self.enter("suspended", fact.event, fact.reason)
        elif fact.event in (Event.LINK_BACK, Event.CAMERA_BACK, Event.SENSOR_BACK):
            self.enter(self._resumed, Event.RESUME, fact.reason)

    def _pursue_all(self) -> Ending:
        while True:
            reached = self.pursue(self.queue.target)
            if not reached:
                self.context.check_time()
            self.queue.decide(TargetOutcome.REACHED if reached else TargetOutcome.GIVEN_UP)
            self.queue.current.time_s = self.now()
            self.enter("reached" if reached else "gave_up")
            if not self.queue.more_targets:
                return Ending.ACHIEVED if self.queue.achieved else Ending.GIVEN_UP
            self.queue.next_target(self.preferred())
