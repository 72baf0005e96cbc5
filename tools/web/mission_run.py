"""A mission that clients watch: its records go to the run's folder and to the hub."""

from __future__ import annotations

import threading
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.executive import Executive, Report
from behaviors.journal import Kind, Record
from behaviors.mission import Mission
from behaviors.observers import Observers
from behaviors.operator import Question
from behaviors.pause import Pause
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.profile import Profile
from behaviors.profiles.registry import PROFILES, supervised
from behaviors.recoveries import Choice
from behaviors.skills import SkillContext
from behaviors.target_queue import TargetQueue
from nxtdrive.mission import setup
from nxtdrive.mission.body import MissionClock
from nxtdrive.recording.progress_lines import ProgressLines
from nxtdrive.recording.recording import Recording
from nxtdrive.recording.run_folder import JOURNAL, MISSION, VIDEO, new_run_folder, summary
from nxtdrive.recording.wording import evidence_lines, failure_words

from .hub import BELIEF, GRID, Hub
from .pictures import layer
from .true_room import TrueRoom

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Camera

MAP_EVERY_S = 1.0
SURE = 2.0
"""Evidence of the occupancy grid that is shown as certain."""


class WebOperator:
    """Asks the clients which recovery to choose; see `behaviors.operator.Ask`.

    The robot stands still until one of them answers; the time of a simulated robot stands still, too.

    Args:
        hub: Where the question goes.
    """

    def __init__(self, hub: Hub) -> None:
        self._hub = hub
        self._number = 0
        self._answered = threading.Condition()
        self._choice: int | None = None
        self.ended = False

    def __call__(self, question: Question) -> Choice:
        """Ask, and wait for the answer.

        Raises:
            KeyboardInterrupt: The mission was ended instead.
        """
        with self._answered:
            self._number += 1
            self._choice = None
            self._hub.show("question", {"open": True, "number": self._number, **_shown(question)})
            self._answered.wait_for(lambda: self.ended or self._choice is not None)
            self._hub.show("question", {"open": False, "number": self._number})
            if self._choice is None:
                raise KeyboardInterrupt
            return question.candidates[min(self._choice, len(question.candidates) - 1)].choice

    def answer(self, question: int, choice: int) -> None:
        """Take an answer; one to an earlier question is ignored. Any thread."""
        with self._answered:
            if question == self._number:
                self._choice = choice
                self._answered.notify_all()

    def end(self) -> None:
        """End an open question and refuse further ones; any thread."""
        with self._answered:
            self.ended = True
            self._answered.notify_all()


class MissionRun:
    """One mission on the robot of the page.

    Args:
        mission: What to do.
        brick: The robot's.
        camera: The robot's.
        hub: Told every record.
        runs: Where the run's folder goes.
        confirm: Whether clients confirm each recovery.
    """

    def __init__(self, mission: Mission, brick: Brick, camera: Camera, hub: Hub, runs: Path, *, confirm: bool) -> None:
        self.operator = WebOperator(hub)
        self.recording = Recording(new_run_folder(runs, mission.mission.name))
        self._mission = mission
        self._brick = brick
        self._camera = camera
        self._hub = hub
        self._confirm = confirm
        self._ended = threading.Event()
        self._pause = Pause()
        self._profile: Profile | None = None
        self._map_s = -MAP_EVERY_S
        self._true_room = TrueRoom(brick, hub)

    def end(self) -> None:
        """End it as Ctrl-C ends ``nxtdrive run``; any thread."""
        self._ended.set()
        self.operator.end()
        self.resume()

    def pause(self) -> None:
        """Let the robot stand until `resume`; the time of a simulated robot stands still, too. Any thread."""
        self._pause.request()
        self._hub.show("paused", {"paused": True})

    def resume(self) -> None:
        """End the pause; any thread."""
        self._pause.resume()
        self._hub.show("paused", {"paused": False})

    def pursue(self) -> Report:
        """Run the mission; motors are off and the run's folder is complete when it returns or raises.

        Raises:
            ConfigError: A target's picture cannot be used.
        """
        hub, mission, recording = self._hub, self._mission, self.recording
        hub.begin_run()
        hub.tell("run", {"folder": recording.folder.path.name, **mission.model_dump(mode="json")["mission"]})
        observers = Observers(on_failure=lambda name, error: hub.tell("problem", {"text": f"{name}: {error}"}))
        observers.attempt(MISSION, recording.folder.write_mission, mission)
        eyes = setup.camera_eyes(self._camera, mission)
        eyes.on_look(observers.guarded(VIDEO, recording.look))
        observers.add(JOURNAL, recording)
        observers.add("page", self._tell)
        observers.add("progress", ProgressLines(lambda line: hub.tell("line", {"text": line})))
        details: dict[str, object] = {"mission": mission.mission.name, "nxt": self._brick.link.transport.address}
        body, clock = setup.build_body(self._brick, mission), MissionClock(self._brick)
        executive = Executive(mission, body, eyes, clock, observers, self._make_profile, self._pause)
        report, error = None, ""
        self._brick.link.before_request = self._check
        try:
            report = executive.run()
            return report
        except Exception as failure:
            error = str(failure)
            raise
        finally:
            self._brick.link.before_request = None
            self.resume()
            recording.finish(report, error, details, observers)
            hub.tell("ended", {**summary(report, error, details), "folder": recording.folder.path.name})

    def _check(self) -> None:
        if self._ended.is_set():
            self._ended.clear()
            raise KeyboardInterrupt
        self._pause.check()

    def _make_profile(self, context: SkillContext, mission: Mission, targets: TargetQueue) -> Profile:
        make = supervised(mission, self.operator) if self._confirm else PROFILES[mission.mission.profile]
        self._profile = make(context, mission, targets)
        return self._profile

    def _tell(self, record: Record) -> None:
        self._hub.tell("record", {"record": record.values()})
        self._true_room.show()
        if record.kind is Kind.LOOK and record.time_s - self._map_s >= MAP_EVERY_S:
            self._map_s = record.time_s
            self._show_map(record)

    def _show_map(self, record: Record) -> None:
        """Send what the robot knows of the floor, and where it takes the target to be."""
        if not (isinstance(self._profile, AdaptiveProfile) and self._hub.watched):
            return
        world = self._profile.world
        show = partial(self._hub.show_image, number=0, time_s=record.time_s)
        show(GRID, encoded=layer(world.floor.evidence, -SURE, SURE))
        chances = world.beliefs[record.target].by_place()
        show(BELIEF, encoded=layer(chances, 0.0, max(float(chances.max()), 1e-9)))


def _shown(question: Question) -> dict[str, object]:
    """Return a question as plain values."""
    evidence = question.evidence
    candidates = []
    for each in question.candidates:
        option = each.option
        numbers = {} if option is None else {"seconds": round(option.seconds, 1), "chance": round(option.chance, 3)}
        candidates.append({"text": each.choice.words(), "why": each.choice.why, **numbers})
    return {
        "target": evidence.target,
        "failed": failure_words(evidence.reason),
        "known": list(evidence_lines(evidence)),
        "candidates": candidates,
    }
