"""Run a mission: call the skill of the current state and report the resulting fact to the chart.

The motors are off when a mission ends, however it ends. Two decisions at the same moment are refused, so that no rule
can spin without time passing.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from behaviors.chart import MISSION_STATES, MissionChart, results_in
from behaviors.events import FAILURES, Event, Fact, Reason
from behaviors.evidence import Evidence, checked_evidence
from behaviors.failures import Failure
from behaviors.journal import JOURNAL_FORMAT, Observer, Record, RecordKind
from behaviors.mission import Mission
from behaviors.observers import Observers, error_text
from behaviors.outages import OutageSupervisor, part_of
from behaviors.pause import Pause
from behaviors.ports import Outage, Ports
from behaviors.profiles.profile import MakeProfile
from behaviors.profiles.registry import exit_as_error, find_profile
from behaviors.recoveries import Choice, checked_choice
from behaviors.return_types import WrongReturn, checked, place
from behaviors.skills import Skill, SkillContext, TimeUp
from behaviors.target_queue import TargetProgress, TargetQueue
from behaviors.thesis.skills import REPLIES
from behaviors.wiring import WiringCheck, WrongWiring


class Ending(StrEnum):
    """How a mission ended."""

    ACHIEVED = "achieved"
    GIVEN_UP = "given_up"
    INTERRUPTED = "interrupted"
    TIME_UP = "time_up"
    LINK_LOST = "link_lost"
    CAMERA_LOST = "camera_lost"
    SENSOR_LOST = "sensor_lost"
    WRONG_WIRING = "wrong_wiring"
    BROKEN = "broken"


@dataclass(frozen=True, slots=True)
class Report:
    """The result of a mission.

    Attributes:
        ending: How it ended.
        targets: The outcome of each target.
        path: The states entered, in order.
        duration_s: How long it took, in mission time.
        error: What made it impossible to continue, in words, or an empty string.
        observer_failures: Names of observers that failed and were left out, each with its error in words.
        refused: Whether a brick that answers and refuses has ended it.
        hints: What to check or change, one sentence or two each; added by the program that assembled the mission.
        arrivals: What was estimated and measured at each target that was reached; likewise.
    """

    ending: Ending
    targets: Sequence[TargetProgress]
    path: Sequence[str]
    duration_s: float
    error: str = ""
    observer_failures: Mapping[str, str] = field(default_factory=dict)
    refused: bool = False
    hints: Sequence[str] = ()
    arrivals: Sequence[Mapping[str, object]] = ()

    @property
    def achieved(self) -> bool:
        """Whether every target was reached."""
        return self.ending is Ending.ACHIEVED


class Livelock(RuntimeError):
    """Raised for two decisions without time passing in between: a policy or a skill does nothing."""


class Executive:
    """One mission on one robot.

    Args:
        mission: What to do.
        ports: The robot, whose motors are off when `run` returns or raises, its camera, and mission time.
        observers: Called with every record, in order. One that fails is reported once and left out.
        make_profile: Makes the profile; None for the one that the mission names.
        pause: With it an operator pauses the mission for any time.
    """

    def __init__(
        self,
        mission: Mission,
        ports: Ports,
        observers: Iterable[Observer] | Observers = (),
        make_profile: MakeProfile | None = None,
        pause: Pause | None = None,
    ) -> None:
        self._mission = mission
        self._body, self._clock = ports.body, ports.clock
        self._observers = observers if isinstance(observers, Observers) else Observers(observers)
        self._pause = pause = pause or Pause()
        self._start_s = self._clock.now()
        deadline_s = self._start_s + mission.mission.time_limit_s
        wiring = WiringCheck(mission.robot, mission.camera)
        self._context = SkillContext(*ports, mission.thesis, self.note, self._report, deadline_s, pause, wiring=wiring)
        self._outages = OutageSupervisor(self._context, mission.mission.reconnect_timeout_s)
        self._queue = TargetQueue(mission.mission.targets, mission.mission.rounds)
        with exit_as_error():
            make_profile = make_profile or find_profile(mission.mission.profile)
            self._profile = make_profile(self._context, mission, self._queue)
        self._chart = MissionChart(self._queue, self._decide, [self])
        self._skill: Skill | None = None
        self._skill_state = ""
        self._failure = Failure(Event.START, Reason.MISSION_STARTED)
        self._seen_since_search = False
        self._researches = 0
        self._decided_s = -math.inf
        self._path: list[str] = []
        self._error = ""
        self._refused = False

    def run(self) -> Report:
        """Pursue the targets until each is reached or given up.

        Returns:
            The result. A mission that fails, an outage that lasts and Ctrl-C are reported, not raised.

        Raises:
            Livelock: Two decisions at the same moment.
            Exception: Any other error of a skill; the motors are off.
        """
        ending = Ending.BROKEN
        try:
            with exit_as_error(), self._outages.recording_sensors():
                ending = self._pursue()
        except Exception as error:
            self._error = error_text(error)
            raise
        finally:
            self._stop_motors()
            self.note(RecordKind.END, ending=ending, targets=self._queue.outcomes, error=self._error)
            self._body.trust_sonar()  # the next mission checks it afresh
        failures = dict(self._observers.failures)
        return Report(ending, self._queue.targets, self._path, self.now(), self._error, failures, refused=self._refused)

    def now(self) -> float:
        """Return the mission time in seconds."""
        return self._clock.now() - self._start_s

    def note(self, kind: RecordKind, **data: object) -> None:
        """Pass a record with the current time, state and target on to the observers."""
        self._observers(Record.of(self.now(), kind, self._chart.mission_state, self._queue.target, data))

    def after_transition(self, event: str | None, source: Any, target: Any, fact: Fact | None = None) -> None:  # noqa: ANN401 - the chart library's states
        """Journal a transition; called by the chart."""
        entered = "search" if target.id == "active" else target.id
        if entered in MISSION_STATES and source is not target:
            self._path.append(entered)
        if entered in ("reached", "left", "gave_up"):
            self._researches = 0
        if entered in ("reached", "gave_up"):
            self._queue.current.time_s = self.now()
        reason = {} if fact is None else {"reason": fact.reason, "evidence": fact.measured}
        self.note(RecordKind.TRANSITION, source=source.id, to=entered, event=event, **reason)

    def _pursue(self) -> Ending:
        table = self._mission.mission
        try:
            self.note(RecordKind.START, format=JOURNAL_FORMAT, mission=table.name, targets=list(table.targets))
            self._report(Fact(Event.START, Reason.MISSION_STARTED))
            while not self._chart.is_terminated:
                self._context.check_time()
                try:
                    with self._pause.interrupting():
                        fact = self._serve()
                except Outage as outage:
                    self._outages.wait_out(outage)
                    if self._chart.mission_state in ("arrive", "verify"):
                        self._skill = None  # by the clocks of the old one the target would have been lost long ago
                else:
                    if fact.event is not Event.CONTINUED:
                        self._skill = None
                    self._report(fact)
        except KeyboardInterrupt:
            self._stop_motors()
            self._report(Fact(Event.TRIP, Reason.OPERATOR_STOP))
            return Ending.INTERRUPTED
        except TimeUp:
            self._stop_motors()
            self._report(Fact(Event.ABORT, Reason.TIME_UP))
            return Ending.TIME_UP
        except WrongWiring as error:
            self._stop_motors()
            self._error = str(error)
            self._report(Fact(Event.TRIP, Reason.WRONG_WIRING, {"error": str(error)}))
            return Ending.WRONG_WIRING
        except Outage as outage:
            self._error, name = error_text(outage), f"{part_of(outage)}_lost"
            self._refused = outage.refused
            self._report(Fact(Event.ABORT, Reason(name)))
            return Ending(name)
        return Ending.ACHIEVED if self._queue.achieved else Ending.GIVEN_UP

    def _report(self, fact: Fact) -> None:
        """Keep what the next choice will need, then report the fact to the chart."""
        if fact.event is Event.TARGET_SEEN:
            self._seen_since_search = True
            if self._chart.mission_state != "search":
                self._researches += 1
        elif fact.event is Event.RECOVERY_DONE:
            self._researches += 1
        elif isinstance(fact, Failure):
            self._failure = fact
        self._chart.report(fact)

    def _serve(self) -> Fact:
        """Call the skill of the current state once."""
        if self._skill is None:
            self._skill = self._new_skill()
        if self._skill_state not in ("search", "arrive", "verify"):
            return self._call(self._skill)
        self.note(RecordKind.CALL, verb="arrive", battery_mv=self._body.battery_mv())
        fact = self._call(self._skill)
        self.note(RecordKind.REPLY, verb="arrive", value=REPLIES[fact.event])
        return fact

    def _call(self, skill: Skill) -> Fact:
        """Call a skill once; a result that the chart would ignore would repeat the call for ever.

        Raises:
            WrongReturn: Its event does not end the current state, it is a failure without a record, or it continues
                although no time has passed.
        """
        begun_s = self._clock.now()
        fact = checked(skill.call, Fact)
        state = self._chart.mission_state
        results = results_in(state)
        if fact.event is Event.CONTINUED:
            if self._clock.now() > begun_s:
                return fact
            wrong = "without letting time pass"
        elif fact.event not in results:
            wrong = f"in the state {state!r}, which ends with {' or '.join(results)}, or continued"
        elif fact.event in FAILURES and not isinstance(fact, Failure):
            wrong = "as a Fact, not as a Failure"
        else:
            return fact
        raise WrongReturn(f"{place(skill.call)} returned {fact.event} {wrong}")

    def _new_skill(self) -> Skill:
        state = self._skill_state = self._chart.mission_state
        if state == "search":
            self._seen_since_search = False
            self._queue.current.attempts += 1
        try:
            return checked(self._profile.skill, Skill, state, self._chart.choice)  # type: ignore[type-abstract]
        except KeyError as error:
            if error.args != (state,):
                raise
            raise WrongReturn(f"{place(self._profile.skill)} has no skill for {state!r}") from error

    def _decide(self) -> Choice:
        """Ask the policy; called by the chart on entry of `select`."""
        if self._clock.now() <= self._decided_s:
            raise Livelock(f"two decisions at {self.now():.3f} s; every skill must let time pass")
        self._decided_s = self._clock.now()
        self.note(RecordKind.CALL, verb="select")
        self.note(RecordKind.REPLY, verb="select", value=int(self._seen_since_search))
        self._profile.learn(self._failure)
        basis = Evidence(self._queue.target, self._failure.reason, self._seen_since_search, self._researches)
        evidence = checked_evidence(self._profile.evidence, basis)
        choice = checked_choice(self._profile.select, evidence, self._queue.names)
        self.note(RecordKind.CHOICE, **choice.record(), evidence=evidence.known())
        return choice

    def _stop_motors(self) -> None:
        # on a dead link the lease stops them; the failure has been reported already
        with suppress(Outage):
            self._body.stop()
