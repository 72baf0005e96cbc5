"""A mission that clients watch: its records go to the hub, and they pause it, end it and answer its questions."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from threading import Lock
from typing import Any

from behaviors.executive import Report
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import Question, question_values
from behaviors.pause import Pause
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import Profile
from behaviors.profiles.registry import find_profile, make_policy, supervised
from behaviors.recoveries import Choice
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.mission.assembly import MissionRun, OpenRobot
from nxtdrive.mission.body import lacking_sensors
from nxtdrive.recording.progress_lines import ProgressLines
from nxtdrive.recording.wording import spaced, state_words

from .decisions import asked, made
from .hub import BELIEF, GRID, Hub
from .pictures import layer
from .question_slot import QuestionSlot
from .robot_shape import robot_shape
from .true_room import TrueRoom

MAP_EVERY_S = 1.0
"""Minimum time between two maps, by the robot's clock."""
CERTAIN_EVIDENCE = 2.0
"""Evidence of the occupancy grid that is shown as certain."""
WAITING = {"select": "waiting for your choice"}
"""States that last only while an operator is asked."""


def doing(record: Record) -> str:
    """Return what the robot is doing, in the words of the terminal: "look elsewhere: lena"."""
    if record.kind is RecordKind.END:
        return f"ended: {spaced(str(record.data['ending']))}"
    if record.state == "finished":  # whatever target was the last one: it need not have been reached
        return record.state
    state = WAITING.get(record.state) or state_words(record.state)
    return f"{state}: {record.target}" if record.target else state


class WebOperator:
    """Asks the clients which recovery to choose; see `behaviors.operator.Ask`.

    The robot stands still until one of them answers; the time of a simulated robot stands still too.

    Args:
        hub: Where the question goes.
        pause: Has the request to end the mission.
    """

    def __init__(self, hub: Hub, pause: Pause) -> None:
        self._hub = hub
        self._question = QuestionSlot[Question, int](pause)

    def __call__(self, question: Question) -> Choice:
        """Ask, and wait for the answer.

        Raises:
            KeyboardInterrupt: The mission was ended instead.
        """
        shown = asked(question.evidence, question.candidates)
        try:
            choice = self._question.ask(
                question, lambda number: self._hub.show("question", {"open": True, "number": number, **shown})
            )
        finally:
            self._hub.show("question", {"open": False, "number": self._question.number})
        return question.candidates[choice].choice

    def answer(self, question: int, choice: int) -> None:
        """Take an answer; one to an earlier question is ignored. Any thread.

        Raises:
            ValueError: There is no such candidate.
        """
        if (waiting := self._question.open) is not None and waiting[0] == question:
            self._take(*waiting, choice)

    def decision(self) -> dict[str, Any]:
        """Return the open decision as a program reads it; any thread."""
        if (waiting := self._question.open) is None:
            return {"open": False}
        number, question = waiting
        return {"open": True, "question": number, **question_values(question)}

    def choose(self, number: int) -> None:
        """Take a candidate of the open decision; any thread.

        Raises:
            ValueError: There is no such candidate, or no open decision.
        """
        if (waiting := self._question.open) is None or not self._take(*waiting, number):
            raise ValueError("No decision is open.")

    def _take(self, number: int, question: Question, choice: int) -> bool:
        """Answer a question, if there is such a candidate; return whether the question was open."""
        if not 0 <= choice < len(question.candidates):
            raise ValueError(f"The candidates are numbered from 0 to {len(question.candidates) - 1}.")
        return self._question.answer(number, choice)

    def wake(self) -> None:
        """Check now whether the mission is to end; any thread."""
        self._question.wake()


class ShownMission:
    """Shows a mission to the clients, who may pause it, end it and answer its questions.

    Args:
        mission: The mission.
        hub: Gets every record.
        confirm: Whether clients confirm each recovery.
        file: The mission's file, for hints; None for the built-in one.

    Attributes:
        over: Whether it has ended, so that another one may be started.
        run: Name of its run folder while it is under way, else empty.
        operator: Answers its questions.
    """

    kind, drives = "mission", True

    def __init__(self, mission: Mission, hub: Hub, *, confirm: bool, file: Path | None = None) -> None:
        self.over, self.run = False, ""
        self._pause, self._lock = Pause(), Lock()
        self.operator = WebOperator(hub, self._pause)
        self._mission = mission
        self._hub = hub
        self._confirm = confirm
        self._file = file
        self._policy = make_policy(mission.mission.profile, mission)
        self._profile: Profile | None = None
        self._map_s = -MAP_EVERY_S
        self._measured: dict[str, Any] = {}
        self._live: Callable[[], Mapping[str, object]] = dict

    @property
    def profile(self) -> str:
        """Name of the mission's profile."""
        return self._mission.mission.profile

    def assemble(
        self, robot: OpenRobot, observers: Observers | None = None, say_hint: Callable[[str], None] = lambda _: None
    ) -> MissionRun:
        """Assemble the mission.

        Args:
            robot: The robot.
            observers: Further observers.
            say_hint: Also called with each hint.

        Raises:
            ConfigError: A target's picture cannot be used.
        """

        def say(hint: str) -> None:
            self._say(f"hint: {hint}")
            say_hint(hint)

        observers = observers or Observers(on_failure=self._say_failure)
        make, pause = self._make_profile, self._pause
        return MissionRun(
            self._mission, robot, observers, file=self._file, say_hint=say, make_profile=make, pause=pause
        )

    def end(self) -> None:
        """End it as Ctrl-C ends ``nxtdrive run``; any thread."""
        self._pause.end()
        self.operator.wake()

    def pause(self) -> None:
        """Pause, the robot at rest, until `resume`; the time of a simulated robot stands still too. Any thread."""
        with self._lock:
            if not self.over:
                self._pause.request()
                self._hub.show("paused", {"paused": self._pause.wanted})

    def resume(self) -> None:
        """End the pause; any thread."""
        with self._lock:
            self._resume()

    def finish(self) -> None:
        """Note that it is over, and with it a pause; any thread."""
        with self._lock:
            self._resume()
            self.over = True

    def _resume(self) -> None:
        if not self.over:  # else clients may already see the pause of the next mission
            self._pause.resume()
            self._hub.show("paused", {"paused": False})

    def pursue(self, run: MissionRun, folder: str, hand_state: Callable[[], Mapping[str, object]] = dict) -> Report:
        """Run the mission, and show it from its beginning to its result.

        Args:
            run: As `assemble` returned it.
            folder: Name of the run folder.
            hand_state: Returns what clients may change meanwhile: the speed limit by hand, and whether it is stopped.
        """
        hub = self._hub
        hub.begin_run()
        self.run = folder
        link = run.robot.brick.link
        self._live = lambda: {**hand_state(), "latency_ms": round(link.latency_s * 1000, 1)}
        self._show_status("beginning a mission")
        settings, shape = self._mission.model_dump(mode="json")["mission"], robot_shape(self._mission)
        hub.show("robot", shape)
        hub.publish("run", {"folder": folder, "robot": shape, **settings})
        run.observers.add("page", partial(self._publish, TrueRoom(run.robot.brick, hub)))
        run.observers.add("progress", ProgressLines(self._say))
        try:
            return run.pursue()
        finally:
            self.run = ""
            self.finish()
            hub.publish("ended", {**run.summary(), "folder": folder})

    def _show_status(self, what: str) -> None:
        lacking = lacking_sensors(self._mission.robot)
        self._hub.show("status", {"doing": what, "lacking": lacking, **self._measured, **self._live()})

    def _say(self, line: str) -> None:
        self._hub.publish("line", {"text": line})

    def _say_failure(self, name: str, error: str) -> None:
        self._hub.publish("problem", {"text": f"{name}: {error}"})

    def _make_profile(self, context: SkillContext, mission: Mission, targets: TargetQueue) -> Profile:
        make = supervised(mission, self.operator) if self._confirm else find_profile(mission.mission.profile)
        self._profile = make(context, mission, targets)
        return self._profile

    def _publish(self, true_room: TrueRoom, record: Record) -> None:
        self._hub.publish("record", {"record": record.values()})
        self._measured |= {key: record.data[key] for key in ("range_mm", "battery_mv") if key in record.data}
        self._show_status(doing(record))
        if record.kind is RecordKind.CHOICE:
            self._hub.publish("decision", made(record, self._policy))
        true_room.show()
        if record.kind is RecordKind.LOOK and record.time_s - self._map_s >= MAP_EVERY_S:
            self._map_s = record.time_s
            self._show_map(record)

    def _show_map(self, record: Record) -> None:
        """Send the robot's map, and its estimate of the target's place."""
        if not (isinstance(self._profile, AdaptiveProfile) and self._hub.watched):
            return
        world = self._profile.world
        show = partial(self._hub.show_image, number=0, time_s=record.time_s)
        show(GRID, encoded=layer(world.floor.log_odds, -CERTAIN_EVIDENCE, CERTAIN_EVIDENCE))
        chances = world.targets.beliefs[record.target].by_place()
        show(BELIEF, encoded=layer(chances, 0.0, max(float(chances.max()), 1e-9)))


def under_way(mission: ShownMission | None) -> ShownMission:
    """Return a robot's mission.

    Raises:
        ValueError: There is none.
    """
    if mission is None:
        raise ValueError("No mission is under way.")
    return mission


def open_decision(mission: ShownMission | None) -> dict[str, Any]:
    """Return the open decision of a robot's mission, if there is one, as a program reads it."""
    return mission.operator.decision() if mission else {"open": False}
