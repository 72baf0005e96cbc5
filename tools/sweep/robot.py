"""The robot of a sweep: the driver's rover and eyes on a simulation, and what a scenario does to them.

A policy gets a `Robot` and nothing else; the simulation behind it stays out of its sight.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from random import Random
from typing import TypeVar

from behaviors.journal import Observer
from behaviors.mission import Mission
from behaviors.ports import Blind, Body, Clock, Eyes, Glimpse, MotionResult, Pose, Sighting, StopReason
from nxtdrive.brick import Brick
from nxtdrive.mission import setup
from nxtdrive.vision.eyes import GeometricEyes
from sim_backend.camera.geometric import Box
from sim_backend.simulation import Simulation

from .scenarios import CameraLoss, Scenario, Sight

GEOMETRIC, CAMERA = "geometric", "camera"
EYES = (GEOMETRIC, CAMERA)
"""Eyes that skip drawing and detecting, and eyes that do both."""

OUTAGE_S = 20.0
"""A link that is silent for longer is lost for good."""
RETRY_S = 0.5
"""A silent link is asked again so often."""
REST_DEG, REST_MM = 3.0, 20.0
"""A motion that an outage cut this short is as good as done."""
LOOK_MS = 100
"""How often the triggers of the camera's losses are looked at."""

T = TypeVar("T")
Seen = tuple[float, float, Box]
"""Bearing in degrees, distance in millimetres, and where in the frame."""


@dataclass(frozen=True, slots=True)
class Robot:
    """What a policy works with.

    Attributes:
        mission: What to do.
        body: The robot.
        eyes: Its camera.
        clock: Mission time.
        observers: Hear every record of the journal.
    """

    mission: Mission
    body: Body
    eyes: Eyes
    clock: Clock
    observers: Sequence[Observer]


def build_robot(
    scenario: Scenario, simulation: Simulation, brick: Brick, eyes: str, observers: Sequence[Observer]
) -> Robot:
    """The robot of a scenario.

    Args:
        scenario: What is done to it.
        simulation: Where it drives.
        brick: Its brick, open.
        eyes: ``geometric`` or ``camera``.
        observers: Hear every record of the journal.
    """
    body = SteadyBody(setup.build_rover(brick, scenario.mission), brick)
    sees: Eyes
    if eyes == GEOMETRIC:
        sees = GeometricEyes(SpoiltSensor(simulation, scenario.sight, scenario.seed), brick)
    else:
        sees = setup.camera_eyes(setup.open_mission_camera("sim", brick), scenario.mission)
    for loss in scenario.sight.losses:
        _lose_camera(simulation, loss)
    return Robot(scenario.mission, body, sees, brick, observers)


class SteadyBody:
    """A body that outlasts outages of the link; implements `behaviors.ports.Body`.

    The leases stop the robot while the link is silent. When it answers again, a motion goes on for what odometry says
    is left of it, and a question is asked again. Sweeps compare minds, so no mission may hang on who retries.

    Args:
        body: The rover.
        clock: Mission time.
    """

    def __init__(self, body: Body, clock: Clock) -> None:
        self._body = body
        self._clock = clock

    def turn(self, angle_deg: float) -> MotionResult:
        """Turn on the spot."""
        goal_deg = self.pose().heading_deg + angle_deg
        return self._move(
            lambda: self._body.turn(goal_deg - self.pose().heading_deg),
            lambda: abs(goal_deg - self.pose().heading_deg) <= REST_DEG,
        )

    def straight(self, distance_mm: float) -> MotionResult:
        """Drive along the heading."""
        begin = self.pose()

        def left_mm() -> float:
            now = self.pose()
            # the way along the heading that the motion began with
            ahead = Pose(0.0, 0.0, begin.heading_deg).ahead(1.0)
            return distance_mm - ((now.x_mm - begin.x_mm) * ahead[0] + (now.y_mm - begin.y_mm) * ahead[1])

        return self._move(lambda: self._body.straight(left_mm()), lambda: abs(left_mm()) <= REST_MM)

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        """Drive on until the next call."""
        return self._ask(lambda: self._body.drive(speed_mm_s, turn_deg_s))

    def stop(self) -> None:
        """Motors off."""
        self._ask(self._body.stop)

    def pose(self) -> Pose:
        """Where the robot is by odometry."""
        return self._ask(self._body.pose)

    def range_mm(self) -> float | None:
        """Distance ahead."""
        return self._ask(self._body.range_mm)

    def touching(self) -> bool:
        """Whether the bumper is pressed."""
        return self._ask(self._body.touching)

    def keep_alive(self) -> None:
        """Keep the brick awake."""
        self._ask(self._body.keep_alive)

    def battery_mv(self) -> int:
        """Battery voltage."""
        return self._ask(self._body.battery_mv)

    def _move(self, go: Callable[[], MotionResult], there: Callable[[], bool]) -> MotionResult:
        """Move, and after an outage go on until it is `there`."""
        begin = self.pose()
        while True:
            try:
                return go()
            except TimeoutError:
                self.stop()
                if there():
                    end = self.pose()
                    driven_mm = ((end.x_mm - begin.x_mm) ** 2 + (end.y_mm - begin.y_mm) ** 2) ** 0.5
                    return MotionResult(StopReason.DONE, driven_mm, end.heading_deg - begin.heading_deg)

    def _ask(self, question: Callable[[], T]) -> T:
        """Ask until the brick answers.

        Raises:
            TimeoutError: The link is lost for good.
        """
        deadline_s = self._clock.now() + OUTAGE_S
        while True:
            try:
                return question()
            except TimeoutError:
                if self._clock.now() >= deadline_s:
                    raise
                self._clock.sleep(RETRY_S)


class SteadyEyes:
    """Eyes that see nothing while the camera is unplugged, for minds that know no blindness; a `behaviors.ports.Eyes`.

    Args:
        eyes: Eyes that tell when they are blind.
        clock: Tells when nothing was seen.
    """

    def __init__(self, eyes: Eyes, clock: Clock) -> None:
        self._eyes = eyes
        self._clock = clock

    def look(self, target: str) -> Sighting | None:
        """Look; None also when no frame comes in time."""
        return self.glance([target]).seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glimpse:
        """Look for several; nothing also when no frame comes in time."""
        try:
            return self._eyes.glance(targets)
        except Blind:
            return Glimpse(self._clock.now(), {})


class SpoiltSensor:
    """Geometry's answer to a look, spoilt by dusk and look-alikes; see `nxtdrive.vision.eyes.GeometricSensor`.

    Args:
        simulation: Its webcam is asked.
        sight: What spoils the view.
        seed: Seeds luck.
    """

    def __init__(self, simulation: Simulation, sight: Sight, seed: int) -> None:
        self.fps = simulation.webcam.fps
        self._webcam = simulation.webcam
        self._sight = sight
        self._random = Random(f"{seed}/sight")

    @property
    def unplugged(self) -> bool:
        """Whether the camera gives no picture now."""
        return self._webcam.unplugged

    def observe(self, name: str) -> Seen | None:
        """What is found of a target, or of something taken for it, in the freshest frame."""
        sight = self._sight
        seen = self._webcam.observe(name)
        if seen is not None and seen[1] <= sight.farthest_mm and self._random.random() < sight.hit_rate:
            return seen
        # one draw a frame: pictures of one texture answer for each other, and several would be mistaken more often
        if sight.lookalikes and self._random.random() < sight.mistake_rate:
            found = (self._webcam.observe(lookalike) for lookalike in sight.lookalikes)
            return next((taken for taken in found if taken is not None), None)
        return None


def _lose_camera(simulation: Simulation, loss: CameraLoss) -> None:
    """Unplug the camera once the target has been in view long enough."""
    seen_ms = 0

    def look() -> None:
        nonlocal seen_ms
        now_ms = simulation.now_ms
        seen_ms += LOOK_MS * simulation.truth.in_view(loss.target)
        if seen_ms >= loss.after_s * 1000:
            webcam = simulation.webcam
            webcam.unplugged_ms = (*webcam.unplugged_ms, (now_ms, now_ms + round(loss.lasts_s * 1000)))
        else:
            simulation.at(now_ms + LOOK_MS, look)

    simulation.at(simulation.now_ms, look)
