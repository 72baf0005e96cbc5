"""A robot, camera and clock with random faults, for missions that must survive anything."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from random import Random

from behaviors.mission import Mission
from behaviors.ports import (
    FloorRay,
    Glimpse,
    MotionResult,
    Point,
    Pose,
    RobotUnreachable,
    SensorListener,
    Sighting,
    StopReason,
)


def two_targets(targets: Sequence[str] = ("a", "b"), **table: object) -> Mission:
    """Return a mission for markers, with further keys of its first table."""
    return Mission.model_validate(
        {
            "mission": {"targets": list(targets), "profile": "adaptive", **table},
            "target": {name: {"detector": "marker", "id": i} for i, name in enumerate(targets)},
        }
    )


class RandomPorts:
    """A robot, camera and clock with random faults; the only certainty is that a frame takes time.

    Args:
        seed: Seeds luck, and how bad it is.
    """

    def __init__(self, seed: int) -> None:
        self._random = Random(seed)
        luck = self._random.random
        self._finds, self._hinders, self._breaks = luck() ** 2, 0.2 * luck(), 0.01 * luck()
        self._moves = self._random.choice((0.0, 0.5, 1.0, 1.0))
        self._silent_until_s = 0.0
        self._now_s = 0.0
        self._pose = Pose()
        self._speeds = (0.0, 0.0)

    @property
    def at_rest(self) -> bool:
        """Whether the motors are off."""
        return self._speeds == (0.0, 0.0)

    @property
    def here(self) -> Point:
        """Where the robot is."""
        return self._pose.x_mm, self._pose.y_mm

    def now(self) -> float:
        return self._now_s

    def sleep(self, duration_s: float) -> None:
        speed_mm_s, turn_deg_s = self._speeds
        x_mm, y_mm = self._pose.ahead(speed_mm_s * duration_s)
        self._pose = Pose(x_mm, y_mm, self._pose.heading_deg + turn_deg_s * duration_s)
        self._now_s += duration_s

    def turn(self, angle_deg: float) -> MotionResult:
        return self._go(0.0, angle_deg)

    def straight(self, distance_mm: float) -> MotionResult:
        return self._go(distance_mm, 0.0)

    def drive(self, speed_mm_s: float, turn_deg_s: float) -> StopReason | None:
        self._answer()
        stop = self._hindrance()
        self._speeds = (0.0, 0.0) if stop else (self._moves * speed_mm_s, turn_deg_s)
        return stop

    def stop(self) -> None:
        self._answer()
        self._speeds = (0.0, 0.0)

    def pose(self) -> Pose:
        self._answer()
        return self._pose

    def range_mm(self) -> float | None:
        self._answer()
        return self._random.choice((None, self._random.uniform(0.0, 2550.0)))

    def touching(self) -> bool:
        return False

    def dead_wheels(self) -> dict[str, bool]:
        return {}

    def keep_alive(self) -> None:
        self._answer()

    def battery_mv(self) -> int:
        self._answer()
        return 8000

    def distrust_sonar(self, why: str) -> None:
        """Its sonar has nothing to do with its safety stop."""

    def trust_sonar(self) -> None:
        """As above."""

    def correct_turns(self, scale: float, angle_deg: float) -> None:
        self._pose = Pose(self._pose.x_mm, self._pose.y_mm, self._pose.heading_deg + (scale - 1.0) * angle_deg)

    def correct_pose(self, turned_deg: float, moved_mm: float) -> None:
        self._pose = self._pose.corrected(turned_deg, moved_mm)

    def can_drive_forward(self) -> bool:
        return True

    def on_sensor_change(self, listener: SensorListener) -> Callable[[], None]:
        """No sensor fails here."""
        return lambda: None

    def look(self, target: str) -> Sighting | None:
        return self.glance([target]).seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glimpse:
        self.sleep(self._random.choice((0.05, 0.3, 0.5)))
        seen = {target: self._sighting(target) for target in targets if self._random.random() < self._finds}
        return Glimpse(self._now_s, seen)

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        ends = (self._random.uniform(-25.0, 25.0) for _ in range(self._random.choice((0, 8))))
        return [FloorRay(self._random.uniform(-30.0, 30.0), 23.0, end_deg) for end_deg in ends]

    def _sighting(self, target: str) -> Sighting:
        bearing_deg, distance_mm = self._random.uniform(-25.0, 25.0), self._random.uniform(250.0, 1500.0)
        return Sighting(target, bearing_deg, distance_mm, 1.0, self._now_s, (100, 80, 40, 56))

    def _go(self, distance_mm: float, angle_deg: float) -> MotionResult:
        self._answer()
        stop = self._hindrance()
        share = self._random.random() if stop else 1.0
        self._pose = Pose(*self._pose.ahead(share * distance_mm), self._pose.heading_deg + share * angle_deg)
        self._speeds = (0.0, 0.0)
        self._now_s += self._random.choice((0.0, 0.3))
        return MotionResult(stop or StopReason.DONE, share * distance_mm, share * angle_deg)

    def _hindrance(self) -> StopReason | None:
        hindered = self._random.random() < self._hinders
        return self._random.choice((StopReason.OBSTACLE, StopReason.CONTACT, StopReason.STALLED)) if hindered else None

    def _answer(self) -> None:
        """The link breaks now and then, for a while; the robot stops by itself."""
        if self._random.random() < self._breaks * 0.1:
            self._silent_until_s = self._now_s + self._random.uniform(0.5, 5.0)
        if self._now_s < self._silent_until_s:
            self._speeds = (0.0, 0.0)
            raise RobotUnreachable("the brick does not answer")
