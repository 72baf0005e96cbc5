"""Check by sightings and echoes whether the motors are connected and mounted as the mission says.

A robot whose motor cables are exchanged, or whose motors are mounted the other way round, turns away from what it
steers towards, and no recovery helps. There are eight ways to connect and mount two motors. Each predicts where a
target that stood still is seen next, and from how far an echo comes, by the turns of both wheels; so each pair of
sightings or echoes is evidence about them. Since a wheel may slip, each wiring is weighed for both wheels that roll and
for either that slips; and since frames may be older than the mission says, for several ages. A wheel that slips now
does so for a while, and frames stay as old as they are: otherwise each pair that only a slip or an age explains would
count against the described wiring again.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial
from itertools import product
from statistics import NormalDist
from typing import NamedTuple

from behaviors.angles import wrapped_deg
from behaviors.mission.robot import CameraTable, RobotTable
from behaviors.ports import Pose, Sighting
from behaviors.pose_history import PoseHistory

DESCRIBED_CHANCE = 0.98
"""Chance that a robot is connected and mounted as its mission says, before anything was seen; a guess."""
WRONG_CHANCE = 1e-4
"""The mission is wrong once the chance that it is right is this low."""
RIGHT_CHANCE = 1e-6
"""It is right, and the check is over, once the chance that it is wrong is this low."""
TURNED_DEG = 4.0
"""Two sightings are compared once the robot has turned this far between them, or driven `APPROACHED_SHARE`."""
APPROACHED_SHARE = 0.2
"""Share of the distance to the target that the robot drives between two sightings that are compared."""
ROLLED_MM = 80.0
"""Two echoes are compared once a wheel turned this far between them."""
WITHIN_S = 6.0
"""Both are compared within this time: later something may have moved."""
BEARING_SD_DEG = 2.0
"""Standard deviation of the bearing of a robot that does not turn."""
TURN_SD_SHARE = 0.25
"""Share of a turn that is added to it, since field of view and track may be wrong."""
DISTANCE_SD_SHARE = 0.1
"""Standard deviation of a distance by size, as a share."""
ECHO_SD_MM = 30.0
"""Standard deviation of the difference of two echoes."""
STRAIGHT_DEG = 5.0
"""After a turn of more than this the next echo may be of anything."""
ANY_MM = 1000.0
"""Span of the ranges of such an echo."""
LATE_CHANCE = 0.3
"""Chance that a frame or an echo is older than its time, or that the robot did not move."""
STRAY_CHANCE = 0.1
"""Chance of anything else: the target moved, or the other sighting was of a look-alike."""
WALKS_CHANCE = 0.1
"""Chance that the range keeps changing at its latest rate because someone is walking in front of the robot. To the
sonar alone, a person who walks away looks the same as a robot that drives backwards."""
OLDER_CHANCE = 0.1
"""Chance, for each age in `AGES` but 0, that frames are older than the mission says by it."""
SLIP_CHANCE = 0.2
"""Chance that a wheel slips."""
SLIP_CHANGE_CHANCE = 0.01
"""Chance that a wheel begins or ceases to slip from one pair of sightings or echoes to the next: there are about two
pairs per second, and a slip lasts for a minute or so."""
_ECHOES, _ANYTHING = NormalDist(0.0, ECHO_SD_MM), 1.0 / ANY_MM
"""Distribution of the difference of two echoes of one thing, and density of that of two different things."""

Slip = tuple[float, float]
"""Shares of the left and the right motor's motion that arrive on the floor."""

SLIPS: dict[Slip, float] = {(1, 1): 1.0 - SLIP_CHANCE} | dict.fromkeys(
    ((0.5, 1), (1, 0.5), (0, 1), (1, 0)), SLIP_CHANCE / 4
)
"""How the wheels may slip, and how probable that usually is."""

AGES: dict[float, float] = {0.0: 1.0 - 3 * OLDER_CHANCE} | dict.fromkeys((0.15, 0.3, 0.45), OLDER_CHANCE)
"""How much older than they say frames may be, in seconds, and how probable that is."""

Displacement = tuple[float, float]
"""How far a robot drove, in mm, and turned, in degrees and positive right, by its odometry."""


class WrongWiring(Exception):
    """The motors are not connected and mounted as the mission says; the message says what to change."""


class Wiring(NamedTuple):
    """One way to connect and mount the motors, compared with the mission's.

    Attributes:
        left: How far its left wheel's motor drives it, as a share: 1 forwards, -1 backwards, less if the wheel slips.
        right: The same for the right wheel.
        exchanged: Whether that motor drives the right wheel instead, and the other one the left.
    """

    left: float = 1
    right: float = 1
    exchanged: bool = False

    def true_displacement(self, forward_mm: float, turned_deg: float, track_mm: float) -> tuple[float, float]:
        """Return how far the robot really drove and turned, positive right, where its odometry has these values."""
        arc_mm = math.radians(turned_deg) * track_mm / 2
        wheels = self.left * (forward_mm + arc_mm), self.right * (forward_mm - arc_mm)
        left_mm, right_mm = reversed(wheels) if self.exchanged else wheels
        return (left_mm + right_mm) / 2, math.degrees((left_mm - right_mm) / track_mm)

    def slipping(self, slip: Slip) -> Wiring:
        """Return it with wheels that slip like this."""
        return self._replace(left=self.left * slip[0], right=self.right * slip[1])

    def described(self, robot: RobotTable) -> RobotTable:
        """Return the right description of a robot whose motors are connected and mounted like this."""
        left = (robot.left, robot.left_reversed is not (self.left < 0))
        right = (robot.right, robot.right_reversed is not (self.right < 0))
        if self.exchanged:
            left, right = right, left
        return robot.model_copy(
            update={"left": left[0], "left_reversed": left[1], "right": right[0], "right_reversed": right[1]}
        )


AS_DESCRIBED = Wiring()
WIRINGS = [Wiring(*each) for each in product((1, -1), (1, -1), (False, True))]


class _Echo(NamedTuple):
    """The range of an echo, when it was heard, and where by odometry."""

    time_s: float
    range_mm: float
    pose: Pose


class _Change(NamedTuple):
    """From one echo to a later one: how much farther away it is, and would be if its range changed on as before."""

    farther_mm: float
    walked_mm: float
    weight: float


class WiringCheck:
    """Compares sightings and echoes with how the wheels turn, until it is clear whether they fit.

    Args:
        robot: The description to check.
        camera: Where the lens is.
    """

    def __init__(self, robot: RobotTable, camera: CameraTable) -> None:
        self._robot, self._camera = robot, camera
        self._poses = PoseHistory()
        self._seen: tuple[Sighting, dict[float, Pose]] | None = None
        self._echoes: list[_Echo] = []
        wrong = (1.0 - DESCRIBED_CHANCE) / (len(WIRINGS) - 1)
        self._chances = {
            wiring: {
                (slip, age_s): slips * aged * (DESCRIBED_CHANCE if wiring == AS_DESCRIBED else wrong)
                for (slip, slips), (age_s, aged) in product(SLIPS.items(), AGES.items())
            }
            for wiring in WIRINGS
        }
        self._over = False

    def check_motors(self, dead_wheels: Mapping[str, bool]) -> None:
        """Check that the wheels turn.

        Args:
            dead_wheels: Those of ``left`` and ``right`` that do not turn, and whether each has turned before.

        Raises:
            WrongWiring: There are any.
        """
        if not dead_wheels:
            return
        ports = [str(getattr(self._robot, side)) for side in dead_wheels]
        if len(ports) > 1:
            what = f"The motors of both wheels, on ports {ports[0]} and {ports[1]}, have"
        else:
            what = f"The {next(iter(dead_wheels))} wheel's motor, on port {ports[0]}, has"
        if any(dead_wheels.values()):
            raise WrongWiring(
                f"{what} stopped turning. Has the motor's cable come off, at either end? "
                "Is the wheel blocked? Plug the cable in or free the wheel, then start the mission again."
            )
        raise WrongWiring(
            f"{what} not turned at all so far. Is the motor's cable plugged in there, at both ends? Does the wheel "
            "turn freely? If the motor is on another port, write that into [robot] as left or right."
        )

    def look(self, time_s: float, pose: Pose, range_mm: float | None, sighting: Sighting | None) -> None:
        """Learn from a look.

        Args:
            time_s: Now, on the clock of the sighting.
            pose: Of the robot now, by odometry.
            range_mm: The sonar's echo now, or None.
            sighting: The current target, or None.

        Raises:
            WrongWiring: The robot moves in another way than its wheels' turns say.
        """
        if self._over:
            return
        self._poses.add(time_s, pose)
        if range_mm is not None:
            self._add_echo(time_s, range_mm, pose)
        if sighting is not None and self._in_view(sighting):
            self._see(sighting, {age_s: self._poses.at(sighting.time_s - age_s) for age_s in AGES})

    def forget_poses(self) -> None:
        """Compare nothing with earlier sightings and echoes; call this when odometry's pose was corrected."""
        self._poses.clear()
        self._seen = None
        self._echoes.clear()

    def _add_echo(self, time_s: float, range_mm: float, pose: Pose) -> None:
        """Compare an echo with the last one, and with all of the last seconds.

        A robot that drives in circles receives the same echoes again and again; they may fit a wrong wiring's short
        ways, but not its long ones. Since these overlap, all of them together count as much as the short one.
        """
        self._echoes = [echo for echo in self._echoes if time_s - echo.time_s <= WITHIN_S]
        if self._echoes:
            last = self._echoes[-1]
            forward_mm, turned_deg = _displacement(last.pose, pose)
            if abs(forward_mm) + math.radians(abs(turned_deg)) * self._robot.axle_track_mm / 2 < ROLLED_MM:
                return
            weights = dict.fromkeys(self._echoes, 1.0 / len(self._echoes))
            weights[last] += 1.0
            mm_per_s = _change_mm_per_s(self._echoes)
            changes = [
                _Change(range_mm - before.range_mm, mm_per_s * (time_s - before.time_s), weight)
                for before, weight in weights.items()
            ]
            displacements = tuple(_displacement(before.pose, pose) for before in weights)
            self._learn(dict.fromkeys(AGES, displacements), partial(_echo_likelihood, changes))
        self._echoes.append(_Echo(time_s, range_mm, pose))

    def _see(self, seen: Sighting, poses: dict[float, Pose]) -> None:
        last, then = self._seen or (seen, poses)
        displacements = {age_s: _displacement(then[age_s], pose) for age_s, pose in poses.items()}
        moved = any(
            abs(turned_deg) >= TURNED_DEG or abs(forward_mm) >= APPROACHED_SHARE * last.distance_mm
            for forward_mm, turned_deg in displacements.values()
        )
        unlike = last.target != seen.target or seen.time_s - last.time_s > WITHIN_S
        if self._seen is None or unlike or moved:
            self._seen = seen, poses
        if moved and not unlike:
            alone = {age_s: (displacement,) for age_s, displacement in displacements.items()}
            self._learn(alone, lambda true: self._sighting_likelihood(last, seen, *true[0]))

    def _in_view(self, sighting: Sighting) -> bool:
        """Return whether the middle of the target is in the frame, so that its bearing is accurate."""
        return not sighting.cut and abs(sighting.bearing_deg - self._camera.yaw_deg) < self._camera.hfov_deg / 2

    def _learn(
        self,
        displacements: Mapping[float, tuple[Displacement, ...]],
        likelihood: Callable[[list[Displacement]], float],
    ) -> None:
        """Update the chances of all wirings.

        Args:
            displacements: How far the robot drove and turned until a sighting or echo since each of those that it is
                compared with, for each of `AGES`.
            likelihood: Of the sighting or echo, if the robot really drove and turned so far.
        """
        track_mm, different = self._robot.axle_track_mm, set(displacements.values())
        for wiring, chances in self._chances.items():
            of_age = {age_s: sum(chances[slip, age_s] for slip in SLIPS) for age_s in AGES}
            for slip, usual in SLIPS.items():
                moving = wiring.slipping(slip).true_displacement
                likelihoods = {each: likelihood([moving(*one, track_mm) for one in each]) for each in different}
                for age_s, each in displacements.items():
                    now = (1.0 - SLIP_CHANGE_CHANCE) * chances[slip, age_s] + SLIP_CHANGE_CHANCE * usual * of_age[age_s]
                    chances[slip, age_s] = now * likelihoods[each]
        total = sum(map(self._chance, WIRINGS))
        self._chances = {
            wiring: {how: chance / total for how, chance in chances.items()}
            for wiring, chances in self._chances.items()
        }
        self._over = sum(self._chance(wiring) for wiring in WIRINGS if wiring != AS_DESCRIBED) <= RIGHT_CHANCE
        if self._chance(AS_DESCRIBED) <= WRONG_CHANCE:
            raise WrongWiring(self._advice())

    def _chance(self, wiring: Wiring) -> float:
        return sum(self._chances[wiring].values())

    def _sighting_likelihood(self, last: Sighting, seen: Sighting, forward_mm: float, turned_deg: float) -> float:
        """Return how probable a sighting is after another one, if the robot really moved like this in between."""
        start = Pose()
        place = self._camera.lens_at(start).ahead(last.distance_mm, last.bearing_deg)
        x_mm, y_mm = start.ahead(forward_mm, turned_deg / 2)
        bearing_deg, distance_mm = self._camera.lens_at(Pose(x_mm, y_mm, turned_deg)).polar_to(place)
        spread_deg = BEARING_SD_DEG + TURN_SD_SHARE * abs(turned_deg)

        def density(bearing_deg: float, distance_mm: float) -> float:
            nearer = math.log(seen.distance_mm / max(distance_mm, 1.0))
            off_deg = wrapped_deg(seen.bearing_deg - bearing_deg)
            return NormalDist(0.0, spread_deg).pdf(off_deg) * NormalDist(0.0, DISTANCE_SD_SHARE).pdf(nearer)

        moved, late = density(bearing_deg, distance_mm), density(last.bearing_deg, last.distance_mm)
        anywhere = 1.0 / (self._camera.hfov_deg * 2.0)  # over the frame, and over a distance of e times more or less
        return (1.0 - LATE_CHANCE - STRAY_CHANCE) * moved + LATE_CHANCE * late + STRAY_CHANCE * anywhere

    def _advice(self) -> str:
        """Return what else would explain the sightings and echoes, and what to do."""
        likely = sorted(WIRINGS, key=self._chance, reverse=True)
        others = [each for each in likely if self._chance(each) >= self._chance(likely[0]) / 10]
        keys = " or ".join(_changes(self._robot, each.described(self._robot)) for each in others)
        mirrored = Wiring(exchanged=True) in others
        camera = " A camera whose picture is mirrored or upside down gives the same impression." if mirrored else ""
        return (
            f"The robot does not move as [robot] says: its sightings and echoes while it moved fit {keys}.{camera} "
            "Correct the mission or its robot file; `nxtdrive calibrate motors` finds out what is right."
        )


def _change_mm_per_s(echoes: list[_Echo]) -> float:
    """Return how fast the range of the last echoes changed; infinity if there is only one."""
    if len(echoes) < 2:
        return math.inf
    before, last = echoes[-2:]
    return (last.range_mm - before.range_mm) / (last.time_s - before.time_s)


def _echo_likelihood(changes: list[_Change], displacements: list[Displacement]) -> float:
    """Return how probable an echo is after others, if the robot really moved like this since each of them.

    Args:
        changes: From each of the others to it.
        displacements: Since each of them.
    """
    likelihood = 1.0
    for (farther_mm, walked_mm, weight), (forward_mm, turned_deg) in zip(changes, displacements, strict=True):
        moved = _ANYTHING if abs(turned_deg) > STRAIGHT_DEG else _ECHOES.pdf(farther_mm + forward_mm)
        mixed = (1.0 - LATE_CHANCE - WALKS_CHANCE - STRAY_CHANCE) * moved + STRAY_CHANCE * _ANYTHING
        mixed += LATE_CHANCE * _ECHOES.pdf(farther_mm) + WALKS_CHANCE * _ECHOES.pdf(farther_mm - walked_mm)
        likelihood *= mixed**weight
    return likelihood


def _displacement(last: Pose, pose: Pose) -> Displacement:
    """Return the displacement between two poses."""
    turned_deg = pose.heading_deg - last.heading_deg
    between = replace(last, heading_deg=last.heading_deg + turned_deg / 2)
    bearing_deg, distance_mm = between.polar_to(pose.point)
    return distance_mm * math.cos(math.radians(bearing_deg)), turned_deg


def _changes(was: RobotTable, now: RobotTable) -> str:
    """Return the keys of [robot] that differ, as a mission file has them."""
    pairs = {name: value for name, value in now.model_dump().items() if value != getattr(was, name)}
    return ", ".join(f"{name} = {json.dumps(value)}" for name, value in pairs.items())  # as TOML writes text and bool
