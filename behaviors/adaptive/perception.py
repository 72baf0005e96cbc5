"""Perception: one frame, one echo and one pose at a time, all of which update the world model."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from behaviors.adaptive.driven_floor import DrivenFloor
from behaviors.adaptive.sonar_trust import SonarTrust
from behaviors.adaptive.turn_scale import TurnScale
from behaviors.adaptive.wheel_slip import WheelSlip
from behaviors.adaptive.world_model import WorldModel
from behaviors.events import Event, Fact, Reason
from behaviors.failures import Blocker
from behaviors.mission import AdaptiveParameters
from behaviors.ports import Glimpse, Pose, Sighting, StopReason
from behaviors.skills import STEER_LIMIT_DEG_S, STEER_PER_S, SkillContext, note_echo, note_look, steering_deg_s
from behaviors.target_queue import TargetOutcome, TargetQueue

BLOCKER_MM = 150.0
"""Something that holds or touches the robot and gives no echo is about this far ahead of the sonar."""
STEP_MM = 150.0
"""The robot drives no farther than this from one look to the next, however slow the link."""
MAX_CORRECTED_SHARE = 0.6
"""Share of a bearing's error that it corrects at most from one look to the next, so as not to swerve."""
LOST_FRAMES = 4.0
"""A target is lost only after this many frames without it."""
LONGEST_STEP_S = 2.0
"""What takes longer is a pause."""
SILENT_SHARE = 0.6
"""Share of its speed at which the robot drives while the sonar seems dead."""
SLOW_LINK_S = 0.5
"""If requesting echo and pose takes longer than this, the link is slow."""
SLOW_LOOK_S = 0.3
"""If looking at one frame takes longer than this, looks are slow."""
LISTEN_S = 0.1
"""Between slow looks the echo is measured this often."""
LATEST_LOOKS = 3
"""This many looks in succession have to take long: a camera may need a second for its first frame, or lose one."""
BURST_FRAMES = 3
"""Number of frames that each look evaluates on a slow link, where a frame takes little time compared with a round
trip."""
TEST_S = 8.0
"""Longest turn to test a doubtful sonar."""
FREE_MM = 700.0
"""With an echo from farther away than this the floor that a frame shows right ahead is free."""
TURN_TESTS = 2
"""After this many turns whose echoes did not show the scale of turns, no more are made for it."""


@dataclass(frozen=True, slots=True)
class Observation:
    """The result of one step of perception.

    Attributes:
        time_s: When.
        sighting: The newest one of the current target, or None.
        range_mm: The sonar's echo, or None.
        frames: For each frame, oldest first, whether it showed the current target.
        unconfirmed: Whether the newest frame showed something that another frame may confirm as the current target.
    """

    time_s: float
    sighting: Sighting | None
    range_mm: float | None
    frames: tuple[bool, ...]
    unconfirmed: bool


def blocker_without_echo(range_mm: float | None = None, *, hides: bool = False) -> Blocker:
    """Return a blocker that the bumper or the wheels noticed; an echo may be of something behind it."""
    return Blocker(BLOCKER_MM if range_mm is None else min(range_mm, BLOCKER_MM), hides=hides)


class Perception:
    """What every skill of the adaptive profile works with.

    Args:
        context: The ports.
        parameters: The mission's numbers.
        world: The world model, which observations update.
        queue: The targets, with the current one.

    Attributes:
        context: As given.
        parameters: As given.
        world: As given.
        sonar: Whether the sonar works.
        turns: The echoes of the current turn on the spot.
    """

    def __init__(
        self, context: SkillContext, parameters: AdaptiveParameters, world: WorldModel, queue: TargetQueue
    ) -> None:
        self.context = context
        self.parameters = parameters
        self.world = world
        self._queue = queue
        self.sonar = SonarTrust()
        self.turns = TurnScale()
        self._turn_tests = 0 if world.knows_turns else TURN_TESTS
        self._looked_s = -math.inf
        self._step_s = self._answer_s = 0.0
        self._looks_s: deque[float] = deque(maxlen=LATEST_LOOKS)
        self._range_mm: float | None = None
        self._start: Pose | None = None
        self._driven = DrivenFloor()
        self._slip = None if world.has_compass else WheelSlip(world.track_mm)

    @property
    def target(self) -> str:
        """The target being pursued."""
        return self._queue.target

    def now(self) -> float:
        """Current time on the mission's clock."""
        return self.context.clock.now()

    @property
    def frames(self) -> int:
        """How many frames are looked at in each step: several on a slow link."""
        return BURST_FRAMES if self._answer_s > SLOW_LINK_S else 1

    @property
    def looks_are_slow(self) -> bool:
        """Whether a look takes long, and not the link: the detector is slow, or frames are rare."""
        return self.frames == 1 and len(self._looks_s) == LATEST_LOOKS and min(self._looks_s) > SLOW_LOOK_S

    def step(self) -> Observation:
        """Look at the next frame or frames, measure the range, and update the world model.

        Raises:
            TimeUp: The mission's time is over.
            Outage: No frame arrives, or the brick does not answer.
        """
        context = self.context
        context.check_time()
        looked_for = [self.target, *self._others()]
        begun_s = self.now()
        glimpses = [context.vision.glance(looked_for) for _ in range(self.frames)]
        asked_s = self.now()
        self._looks_s.append((asked_s - begun_s) / len(glimpses))
        now_s, pose, range_mm = self._measure()
        pose = self._correct_slip(pose, glimpses)
        if now_s - self._looked_s <= LONGEST_STEP_S:
            self._step_s += (now_s - self._looked_s - self._step_s) / 2
        self._answer_s += (now_s - asked_s - self._answer_s) / 2
        self._looked_s = now_s
        self.world.travel_mm_s = self._travel_mm_s
        free_at_s = self._free_at_s(glimpses[-1].time_s, pose)
        rays = context.vision.free_floor(free_at_s) if self.parameters.sees_floor else ()
        self.world.floor.weight = float(len(glimpses))
        first, *further = glimpses
        seen = [self.world.perceive(now_s, pose, range_mm, looked_for, first, sonar_works=not self.sonar.silent)]
        self.world.see_floor(glimpses[-1].time_s, rays, range_mm)
        seen += [self.world.targets.look(looked_for, each, range_mm) for each in further]
        sightings = [each.get(self.target) for each in seen]
        newest = next(filter(None, reversed(sightings)), None)
        note_look(context, pose, range_mm, newest)
        shown = tuple(each is not None for each in sightings)
        return Observation(now_s, newest, range_mm, shown, self.target in glimpses[-1].unconfirmed)

    def listen(self) -> None:
        """Measure the range after a moment, without a look, and update the map.

        Raises:
            TimeUp: The mission's time is over.
            Outage: The brick does not answer.
        """
        self.context.check_time()
        self.context.clock.sleep(LISTEN_S)
        now_s, pose, range_mm = self._measure()
        self.world.perceive(now_s, pose, range_mm, (), Glimpse(now_s, {}), sonar_works=not self.sonar.silent)
        note_echo(self.context, pose, range_mm)

    def _measure(self) -> tuple[float, Pose, float | None]:
        """Return the time, the pose and the echo, unless that is not to be believed."""
        range_mm = self.context.body.range_mm()
        pose, now_s = self.context.body.pose(), self.now()
        self._range_mm = range_mm = self._accepted(now_s, pose, range_mm)
        if self._turn_tests:
            self.turns.add(pose, range_mm)
        if self._slip is not None:
            self._slip.add_pose(now_s, pose)
        return now_s, pose, range_mm

    def _correct_slip(self, pose: Pose, glimpses: Sequence[Glimpse]) -> Pose:
        """Return the pose, corrected if the glimpses show that a wheel slips."""
        if self._slip is None:
            return pose
        slipped = self._slip.slips
        for glimpse in glimpses:
            correction = self._slip.correction(glimpse)
            if correction is not None:
                self.context.body.correct_pose(*correction)
                pose = pose.corrected(*correction)
        slips = self._slip.slips
        if slips is not slipped:
            if self.context.wiring is not None:
                self.context.wiring.forget_poses()
            event = Event.WHEEL_SLIPS if slips else Event.WHEEL_GRIPS
            self.context.report(Fact(event, Reason.FRAMES_TURNED, self._slip.evidence))
        return pose

    def _free_at_s(self, time_s: float, pose: Pose) -> float | None:
        """Return the time of a frame in which the floor right ahead was free, the latest one or an earlier one.

        The echo decides for the latest. Without a sonar the floor is assumed to be free at the start, and known to have
        been free where the robot has driven since.
        """
        self._start = self._start or pose
        driven_s = self._driven.add(time_s, pose)
        if self._range_mm is not None:
            return time_s if self._range_mm > FREE_MM else None
        if not self.sonar.silent:
            return None
        return time_s if pose == self._start else driven_s

    def _accepted(self, now_s: float, pose: Pose, range_mm: float | None) -> float | None:
        """Return an echo unless the sonar is stuck; a stuck sonar must not stop the robot either."""
        was_stuck = self.sonar.stuck
        accepted_mm = self.sonar.accepted(now_s, pose, range_mm)
        if self.sonar.stuck and not was_stuck:
            self.context.body.distrust_sonar(f"It measures {range_mm:.0f} mm wherever the robot turns.")
        elif was_stuck and not self.sonar.stuck:
            self.context.body.trust_sonar()
        if self.sonar.stuck is not was_stuck:
            self.world.floor.forget_obstacles()
        return accepted_mm

    def check_sonar(self) -> None:
        """Turn until it is clear whether a doubtful sonar repeats an echo in all directions or not."""
        end_s = self.now() + TEST_S
        while self.sonar.doubtful and self.now() < end_s:
            self.drive(0.0, self.parameters.scan_deg_s)
            self.step()
        self.context.body.stop()

    @property
    def doubts_turns(self) -> bool:
        """Whether a turn should continue until it shows the scale of turns, which takes frequent echoes."""
        return self._turn_tests > 0 and not self.sonar.silent and self.frames == 1

    def begin_turn(self) -> None:
        """Begin a turn that measures the scale of turns."""
        self.turns.begin()
        self.world.floor.save()

    def learn_turns(self) -> None:
        """Learn the scale of turns from the last turn, and redraw its echoes on the map."""
        self._turn_tests -= 1
        scale = self.turns.estimate()
        if scale is None:
            return
        self._turn_tests = 0
        if scale == 1.0:
            return
        turned_deg = self.turns.turned_deg
        self.context.body.correct_turns(scale, turned_deg)
        if self.context.wiring is not None:
            self.context.wiring.forget_poses()
        if self._slip is not None:
            self._slip.restart()
        self.world.turned(scale, self.turns.beams)
        self.context.report(Fact(Event.TURNS_CORRECTED, Reason.HEARD_TWICE, {"scale": scale, "turned_deg": turned_deg}))

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive on as `Body.drive` does, slower without a sonar and on a slow link.

        Reports when the safety stop holds the robot and when it releases it.
        """
        if speed_mm_s > 0:
            # without a stuck sonar, which is left out of the safety stop, the body itself is slow
            if self.sonar.silent and not self.sonar.stuck:
                speed_mm_s *= SILENT_SHARE
            speed_mm_s = min(speed_mm_s, self._step_limit_mm_s)
        if self._slip is not None:
            speed_mm_s, turn_deg_s = self._slip.compensated(speed_mm_s, turn_deg_s)
        stop = self.context.body.drive(speed_mm_s, turn_deg_s)
        self.sonar.stopped |= stop is StopReason.OBSTACLE
        self.context.watch.update(stop, {"range_mm": self._range_mm})
        return stop

    @property
    def _travel_mm_s(self) -> float:
        """How fast the robot drives along paths while there is no near echo."""
        numbers = self.parameters
        speed_mm_s = SILENT_SHARE * numbers.cruise_mm_s if self.sonar.silent else numbers.travel_mm_s
        return min(speed_mm_s, self._step_limit_mm_s)

    @property
    def _step_limit_mm_s(self) -> float:
        """The speed at which the robot drives as far between two steps as it may."""
        return STEP_MM / max(self._step_s, 0.01)

    @property
    def lost_after_s(self) -> float:
        """After this time without a sighting a target is lost, but not after a single frame on a slow link."""
        return max(self.parameters.lost_after_s, LOST_FRAMES * self._step_s)

    def steering_deg_s(
        self, bearing_deg: float, per_s: float = STEER_PER_S, limit_deg_s: float = STEER_LIMIT_DEG_S
    ) -> float:
        """Return how fast to turn towards a bearing: slower where looks are far apart, as on a slow link."""
        return steering_deg_s(bearing_deg, min(per_s, MAX_CORRECTED_SHARE / max(self._step_s, 0.01)), limit_deg_s)

    def _others(self) -> list[str]:
        """Return the other targets that are not reached yet."""
        if not self.parameters.remembers_others:
            return []
        pending = [progress.target for progress in self._queue.targets if progress.outcome is not TargetOutcome.REACHED]
        return [target for target in dict.fromkeys(pending) if target != self.target]
