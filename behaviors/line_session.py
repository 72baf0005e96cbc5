"""A session with a client that makes the decisions: verbs in, the thesis's services called, small integers out.

Here the client is the agent: it decides which target to pursue, when to wait and when to give up. The session keeps
the state of the thesis's ``nxt`` node: whether the target was recognised (``exist``), how far a ``move_to`` has come
(``count``), and the approach in progress.

Source: docs/thesis.md, services, readings A2-A8 and A19.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from typing import Any, cast

from behaviors.events import Event, Fact, Reason
from behaviors.executive import Ending, Executive, Report
from behaviors.journal import Observer, Record, RecordKind
from behaviors.line_protocol import MOTIONS, BadLine, ErrorReply, Request, Status, Verb, Why, failure_reply
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.obstacle_watch import ObstacleWatch
from behaviors.operator import Ask, question_values
from behaviors.pause import Pause
from behaviors.ports import Outage, Ports, RobotUnreachable
from behaviors.profiles.registry import raised_by_profile, supervised
from behaviors.skills import SkillContext
from behaviors.stepped_mission import SteppedMission
from behaviors.thesis.skills import REPLIES, MoveTo, ThesisArriveSkill, ThesisSearchSkill

DONE = 1
"""Answer of a verb without a result."""
CHOOSE_AGAIN, ALL_REACHED, ENDED = 0, 1, 2
"""Answers of ``choose``."""
WHY_ENDED = {
    Ending.ACHIEVED: Why.ACHIEVED,
    Ending.GIVEN_UP: Why.GIVEN_UP,
    Ending.TIME_UP: Why.TIME_UP,
    Ending.LINK_LOST: Why.LINK_LOST,
}
"""Answers of ``why`` after the end of a mission."""
KEEPS_MISSION = frozenset({Verb.EVIDENCE, Verb.CHOOSE, Verb.STATUS, Verb.WHY, Verb.SELECT})
"""Verbs that do not end a mission between two decisions."""
WITH_REASON = MOTIONS | {Verb.STOP, Verb.WHY}
"""Verbs whose replies are journaled with a reason even if they do not fail."""

log = logging.getLogger(__name__)


class _BadArgument(Exception):
    """The mission does not describe the target."""


class Preempted(KeyboardInterrupt):
    """Raised by a port to interrupt a command; the session then stops the robot, and a mission ends as by Ctrl-C."""


class Session:
    """One client's session.

    A skill in progress ends when a port raises `Preempted`; the command then counts as failed. With ``choose`` the
    client leaves all but the decisions to the mission's profile.

    Args:
        mission: Its targets can be named, the first one is the current one; its parameters and its profile apply.
        ports: The robot, its camera, and time.
        connect: Makes sure that the brick answers; raises `RobotUnreachable` when it does not.
        faults: Errors other than an `Outage` that `body` and `vision` raise on a fault. Any other error is a defect of
            the program: it is answered as a fault as well, and logged with its traceback.
        observers: Receive a record of each call, reply and look; one that fails is left out.

    Attributes:
        error: Why the last command failed, in words; empty when it did not.
    """

    def __init__(
        self,
        mission: Mission,
        ports: Ports,
        *,
        connect: Callable[[], None],
        faults: tuple[type[Exception], ...] = (),
        observers: Sequence[Observer] = (),
    ) -> None:
        self.error = ""
        self._targets = mission.mission.targets
        self._target = self._targets[0]
        self._ports, self._body, self._clock = ports, ports.body, ports.clock
        self._connect = connect
        self._faults: tuple[type[Exception], ...] = (Outage, *faults)
        self._observers = Observers(observers)
        self._start_s = self._clock.now()
        self._mission = mission
        self._stepped: SteppedMission | None = None
        self._context = SkillContext(*ports, mission.thesis, self._note, self._report)
        self._state = "idle"
        self._exist = self._sighted = self._held = False
        self._approach: ThesisArriveSkill | None = None
        self._move: MoveTo | None = None
        self._why = Why.NOTHING_YET
        self._verbs: Mapping[Verb, Callable[[Request], int | str]] = {
            Verb.CONNECT: self._do_connect,
            Verb.ARRIVE: self._do_arrive,
            Verb.SELECT: self._do_select,
            Verb.MOVE_TO: self._do_move_to,
            Verb.BYE: self._do_bye,
            Verb.STOP: self._do_stop,
            Verb.TARGET: self._do_target,
            Verb.STATUS: self._do_status,
            Verb.WHY: self._do_why,
            Verb.EVIDENCE: self._do_evidence,
            Verb.CHOOSE: self._do_choose,
        }

    def answer(self, request: Request | BadLine) -> int | str:
        """Execute a request.

        Returns:
            The answer, a line of JSON to ``evidence`` and else a number; see `behaviors.line_protocol`. After an error,
            `error` has the details.

        Raises:
            BaseException: Only those other than `Exception`, such as KeyboardInterrupt; the motors are off.
        """
        if isinstance(request, BadLine):
            if request.error is ErrorReply.BAD_ARGUMENT:
                self._why = Why.BAD_ARGUMENT
            why = request.error.name.lower()
            self._note(RecordKind.REPLY, verb=request.text, argument="", value=request.reply, why=why, error="")
            return request.reply
        asked = {"verb": request.verb, "argument": request.argument}
        self._note(RecordKind.CALL, **asked)
        self.error = ""
        if request.verb not in KEEPS_MISSION:
            self._end_mission()
        value = self._execute(request)
        with_reason = request.verb in WITH_REASON or self.error or value == ErrorReply.BAD_ARGUMENT
        why = self._why.name.lower() if with_reason else ""  # else it is that of an earlier request
        self._note(RecordKind.REPLY, **asked, value=value, why=why, error=self.error)
        return value

    def end(self) -> None:
        """End the session: motors off, nothing in progress."""
        self._end_mission()
        self._forget()
        try:
            self._body.stop()
        except self._faults:
            pass  # was reported when it occurred, and on a dead link the lease stops the motors
        except Exception:
            log.exception("the motors could not be stopped; their lease stops them")

    def _execute(self, request: Request) -> int | str:
        try:
            value = self._verbs[request.verb](request)
            return value if isinstance(value, str) else int(value)
        except _BadArgument:
            self._why = Why.BAD_ARGUMENT
            return failure_reply(request.verb, ErrorReply.BAD_ARGUMENT)
        except Preempted:
            return self._break_off(request, ErrorReply.FAULT, Why.OPERATOR_STOP)
        except RobotUnreachable as error:
            return self._break_off(request, ErrorReply.LINK_DOWN, Why.LINK_LOST, str(error))
        except self._faults as error:
            return self._break_off(request, ErrorReply.FAULT, Why.FAULT, str(error))
        except Exception as error:
            if from_profile := raised_by_profile(error, self._mission.mission.profile):
                return self._break_off(request, ErrorReply.FAULT, Why.FAULT, str(from_profile))
            log.exception("internal error in %s", request.verb)
            return self._break_off(request, ErrorReply.FAULT, Why.FAULT, f"internal error: {error!r}")
        except BaseException:
            self.end()
            raise

    def _break_off(self, request: Request, reply: ErrorReply, why: Why, error: str = "") -> int:
        self.error, self._why = error, why
        self.end()
        return failure_reply(request.verb, reply)

    def _forget(self) -> None:
        self._state = "idle"
        self._approach = self._move = None
        self._sighted = self._held = False
        self._context.watch = ObstacleWatch(self._body, self._report)

    # --- verbs ---

    def _do_connect(self, _: Request) -> int:
        self._forget()
        self._connect()
        self._body.stop()
        return DONE

    def _do_bye(self, _: Request) -> int:
        self._forget()
        self._body.stop()
        return DONE

    def _do_stop(self, request: Request) -> int:
        self._why = Why.OPERATOR_STOP
        return self._do_bye(request)

    def _do_target(self, request: Request) -> int:
        self._end_move()
        self._choose(request.name)
        return DONE

    def _do_arrive(self, request: Request) -> int:
        """Search on the first call; once the target is in view, drive for a while on each further call."""
        self._end_move()
        if request.name:
            self._choose(request.name)
        if not self._sighted:
            fact = self._search()
        else:
            self._state = "arrive"
            self._approach = self._approach or ThesisArriveSkill(self._context, self._target)
            fact = self._approach.call()
        why = Why.__members__.get(fact.reason.name, Why.OTHER)
        self._why = Why.OBSTACLE_AHEAD if self._held else why
        if fact.event not in (Event.TARGET_SEEN, Event.CONTINUED):
            self._forget()
        return REPLIES[fact.event]

    def _search(self) -> Fact:
        self._state = "search"
        self._exist = False
        fact = ThesisSearchSkill(self._context, self._target).call()
        self._sighted = self._exist = fact.event is Event.TARGET_SEEN
        return fact

    def _do_select(self, _: Request) -> int:
        self._end_move()
        return int(self._exist)

    def _do_move_to(self, request: Request) -> int:
        """Turn or advance; an advance that the safety stop cut short counts as one of the ten."""
        if self._sighted:
            self._halt()
        self._state = "move_to"
        self._move = self._move or MoveTo(self._context)
        done = self._move.call(request.direction_deg)
        self._why = Why.OBSTACLE_AHEAD if self._held else Why.MOVED
        if done:
            self._forget()
        return done

    def _do_status(self, _: Request) -> int:
        self._body.battery_mv()
        if self._held:
            return Status.HELD
        return Status.UNDER_WAY if self._sighted or self._move or self._decision_open else Status.IDLE

    def _do_why(self, _: Request) -> int:
        return self._why

    def _do_evidence(self, _: Request) -> str:
        """Answer with the open decision, and how the last mission ended."""
        stepped = self._stepped
        question, report = (stepped.question, stepped.report) if stepped else (None, None)
        values: dict[str, Any] = {"open": question is not None}
        if question:
            values |= question_values(question)
        if report:
            outcomes = {each.target: each.outcome.value for each in report.targets}
            values |= {"ending": report.ending.value, "targets": outcomes, "seconds": round(report.duration_s, 3)}
        elif stepped and stepped.broke:
            values["ending"] = Ending.BROKEN.value
        return json.dumps(values)

    def _do_choose(self, request: Request) -> int:
        """Take a decision, or begin a mission; the robot then does what its profile does, to the next decision."""
        stepped = self._stepped
        question = stepped.question if stepped else None
        if request.number >= (len(question.candidates) if question else 1):
            raise _BadArgument
        if stepped is None or question is None:
            self._halt()
            self._stepped = stepped = SteppedMission(self._run_mission)
        if stepped.step(request.number):
            self._why = Why.DECISION_OPEN
            return CHOOSE_AGAIN
        report = cast("Report", stepped.report)
        if report.ending is Ending.INTERRUPTED:
            raise Preempted
        self.error, self._why = report.error, WHY_ENDED.get(report.ending, Why.FAULT)
        return ALL_REACHED if report.achieved else ENDED

    def _run_mission(self, ask: Ask, pause: Pause) -> Report:
        mission, make_profile = self._mission, supervised(self._mission, ask)
        return Executive(mission, self._ports, self._observers, make_profile, pause).run()

    @property
    def _decision_open(self) -> bool:
        """Whether a mission waits for a decision."""
        return self._stepped is not None and self._stepped.question is not None

    def _end_mission(self) -> None:
        if self._stepped is not None:
            self._stepped.end()

    # --- shared by the verbs ---

    def _choose(self, target: str) -> None:
        """Make a target the current one."""
        if target not in self._targets:
            raise _BadArgument
        if target != self._target:
            self._halt()
            self._target, self._exist = target, False

    def _end_move(self) -> None:
        """Let the next move_to begin afresh; the robot is at rest, and what held it there is not in its way."""
        if self._move:
            self._move = None
            self._context.watch.update(None)

    def _halt(self) -> None:
        """Stop the skill in progress."""
        if self._sighted or self._move:
            self._body.stop()
        self._forget()

    def _report(self, fact: Fact) -> None:
        """Update with a report of the safety stop."""
        if fact.event in (Event.OBSTACLE, Event.OBSTACLE_GONE):
            self._held = fact.reason is Reason.OBSTACLE_AHEAD

    def _note(self, kind: RecordKind, **data: object) -> None:
        now_s = self._clock.now() - self._start_s
        self._observers(Record.of(now_s, kind, self._state, self._target, data))
