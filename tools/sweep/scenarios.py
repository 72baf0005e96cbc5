"""Draw scenarios: a scenario is determined by its class and seed.

The robot's own actions trigger the events ("once lena has been in view for 1.2 s and the robot is more than a metre
away, a person steps in between"), so that every policy faces the same test. Only outages of the link, which have no
cause within the room, are timed.

Source of the classes and their ranges: docs/evaluation.md.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from random import Random
from typing import Any, Final

from behaviors.mission import Mission
from nxtdrive.mission.setup import PICTURES
from sim_backend.link import NO_FAULTS, LinkFaults
from sim_backend.world.world_file import WorldFile

from .room_builder import LOW_BOX_MM, PRINT_FOUND_MM, PRINT_MM, ROBOT_RADIUS_MM, TALL_BOX_MM, RoomBuilder

TIME_LIMIT_S, CRUISE_MM_S = 300.0, 200.0
"""A mission's time limit and the robot's cruising speed, the same for all policies."""
USB_MS, BLUETOOTH_MS = 2.0, (30.0, 65.0)
"""Round-trip times of the two links, the second as a range; see `nxtdrive.transports.sim`."""
COMPASS_PORT: Final = 2
APART_MM = 700.0
"""Smallest distance from a look-alike to another picture: a sighting must belong to one or the other."""
TRIES = 500
"""Largest number of rooms to draw until one has a free start and reachable targets."""


@dataclass(frozen=True, slots=True)
class CameraLoss:
    """An outage of the camera, which is unplugged once a target has been in view for a while.

    Attributes:
        target: Name of the target.
        after_s: Time in view before the outage.
        lasts_s: How long it stays unplugged.
    """

    target: str
    after_s: float
    lasts_s: float


@dataclass(frozen=True, slots=True)
class Sight:
    """Conditions that degrade the view, besides the obstacles in the room.

    Attributes:
        farthest_mm: Range of geometric eyes.
        hit_rate: Share of the frames in which geometric eyes detect a visible target.
        lookalikes: Pictures that geometric eyes sometimes mistake for a target.
        mistake_rate: Share of the frames showing a look-alike in which they do.
        losses: Outages of the camera.
    """

    farthest_mm: float = math.inf
    hit_rate: float = 1.0
    lookalikes: tuple[str, ...] = ()
    mistake_rate: float = 0.0
    losses: tuple[CameraLoss, ...] = ()


@dataclass(frozen=True, slots=True)
class Scenario:
    """One test.

    Attributes:
        kind: Its class.
        seed: Its seed; class and seed determine everything else.
        world: The room and its events.
        mission: Two targets in order.
        faults: Faults of the link.
        latency_ms: Round-trip time of the link.
        sight: Conditions that degrade the view.
    """

    kind: str
    seed: int
    world: WorldFile
    mission: Mission
    faults: LinkFaults = NO_FAULTS
    latency_ms: float = USB_MS
    sight: Sight = field(default_factory=Sight)


@dataclass(frozen=True, slots=True)
class Extras:
    """What a class specifies outside the world file; `robot` is the mission's table of the same name."""

    faults: LinkFaults = NO_FAULTS
    latency_ms: float = USB_MS
    sight: Sight = field(default_factory=Sight)
    robot: Mapping[str, Any] = field(default_factory=dict)


NO_EXTRAS = Extras()


@cache
def draw_scenario(kind: str, seed: int) -> Scenario:
    """Draw the scenario of a class and a seed.

    Raises:
        KeyError: There is no such class.
        RuntimeError: No sound room was found: the class's ranges are wrong.
    """
    random = Random(f"{kind}-{seed}")
    for _ in range(TRIES):
        builder, extras = CLASSES[kind](random)
        if builder.sound():
            title = f"{kind}-{seed}"
            mission = _mission(title, builder, extras.robot)
            return Scenario(kind, seed, builder.world(title), mission, extras.faults, extras.latency_ms, extras.sight)
    raise RuntimeError(f"no sound room for {kind}-{seed} in {TRIES} tries")


def _mission(title: str, builder: RoomBuilder, robot: Mapping[str, Any]) -> Mission:
    targets = [builder.first, builder.second]
    return Mission.model_validate(
        {
            "mission": {"name": title, "targets": targets, "time_limit_s": TIME_LIMIT_S},
            **{profile: {"cruise_mm_s": CRUISE_MM_S} for profile in ("thesis", "adaptive")},
            "target": {
                name: {"detector": "picture", "pictures": [str(PICTURES / f"{name}.png")], "height_mm": PRINT_MM[1]}
                for name in targets
            },
            "robot": robot,
        }
    )


def _room(random: Random, low_mm: float = 2200.0, high_mm: float = 3500.0) -> RoomBuilder:
    """Draw the size of an empty room and the order of the targets."""
    size = (round(random.uniform(low_mm, high_mm)), round(random.uniform(low_mm, high_mm)))
    first, second = random.sample(["lena", "rilakkuma"], 2)
    return RoomBuilder(random, size, first=first, second=second)


def _furnished(random: Random, low_mm: float = 2200.0, high_mm: float = 3500.0) -> RoomBuilder:
    """Draw a room with both targets near its walls and the robot away from them."""
    builder = _room(random, low_mm, high_mm)
    builder.hang_targets()
    builder.put_robot()
    return builder


def _open(random: Random) -> tuple[RoomBuilder, Extras]:
    return _furnished(random), NO_EXTRAS


def _far(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _room(random, 4000.0, 6000.0)
    builder.hang_targets()
    builder.put_robot(far_mm=3300.0)
    return builder, NO_EXTRAS


def _clutter(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random, 2800.0, 3800.0)
    for i in range(random.randint(4, 8)):
        low = random.random() < 0.3
        builder.boxes.append(
            {
                "name": f"box{i}",
                "at_mm": builder.place(200.0),
                "size_mm": (builder.between(200, 700), builder.between(200, 700)),
                "height_mm": builder.between(*(LOW_BOX_MM if low else TALL_BOX_MM)),
                "facing_deg": builder.between(0, 90),
            }
        )
    return builder, NO_EXTRAS


def _block_transient(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random, 2600.0, 3600.0)
    for target in (builder.first, builder.second):
        person = f"visitor of {target}"
        builder.people.append(
            {
                "name": person,
                "enters_from_mm": builder.place_at_wall(350.0)[0],
                "radius_mm": builder.between(160, 280),
            }
        )
        for i in range(random.randint(1, 2)):
            stays_s = builder.between(2, 6) if random.random() < 0.5 else min(60.0, 4 + random.expovariate(1 / 18))
            when = {"sees": target, "for_s": builder.between(0.5, 2.0), "robot_beyond_mm": 1000}
            builder.events.append(
                {
                    "name": f"{person} {i}",
                    "when": {**when, "after_end_of": f"{person} {i - 1}"} if i else when,
                    "person": person,
                    "blocks": target,
                    "blocks_at_mm": builder.between(550, 900),
                    "stays_s": round(stays_s, 1),
                }
            )
    return builder, NO_EXTRAS


def _block_permanent(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _room(random, 2800.0, 3800.0)
    builder.hang_targets(corner_mm=900.0)
    builder.put_robot(far_mm=1700.0)
    for target in (builder.first, builder.second):
        radius_mm = builder.between(160, 320)
        low = random.random() < 0.4
        builder.boxes.append(
            {
                "name": f"box before {target}",
                "at_mm": builder.start_mm,
                "size_mm": (radius_mm * math.sqrt(2), radius_mm * math.sqrt(2)),
                "height_mm": builder.between(*(LOW_BOX_MM if low else TALL_BOX_MM)),
                "present": False,
            }
        )
        builder.events.append(
            {
                "name": f"{target} is blocked",
                "when": {"sees": target, "for_s": builder.between(0.5, 2.0), "robot_beyond_mm": 1200},
                "box": f"box before {target}",
                "blocks": target,
                "blocks_at_mm": radius_mm + builder.between(420, 600),
            }
        )
    return builder, NO_EXTRAS


def _patrol(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random, 2600.0, 3600.0)
    for i in range(random.randint(2, 3)):
        beat = builder.place_at_wall(400.0)[0], builder.place_at_wall(400.0)[0]
        builder.people.append(
            {
                "name": f"guard{i}",
                "enters_from_mm": beat[0],
                "radius_mm": builder.between(160, 250),
                "speed_mm_s": builder.between(120, 400),
            }
        )
        builder.events.append(
            {
                "name": f"guard{i} walks",
                "when": {"at_s": 0, "delay_s": (0, 8)},
                "times": 0,
                "person": f"guard{i}",
                "to_mm": beat[1],
                "stays_s": (0, 8),
            }
        )
    return builder, NO_EXTRAS


def _absent(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    del builder.pictures[builder.first]
    return builder, NO_EXTRAS


def _moved(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random, 2600.0, 3600.0)
    taken = [picture["at_mm"] for picture in builder.pictures.values()]
    for target in (builder.first, builder.second):
        places = [builder.place_at_wall() for _ in range(20)]
        to_mm, facing_deg = max(places, key=lambda place: min(math.dist(place[0], at) for at in taken))
        taken.append(to_mm)
        builder.events.append(
            {
                "name": f"{target} moves",
                "when": {"sees": target, "for_s": builder.between(1, 8), "robot_beyond_mm": 700},
                "picture": target,
                "to_mm": to_mm,
                "facing_deg": facing_deg,
            }
        )
    return builder, NO_EXTRAS


def _dim(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    builder.tables["light"] = {"exposure": round(random.uniform(0.3, 0.5), 2)}
    sight = Sight(farthest_mm=PRINT_FOUND_MM * builder.between(0.45, 0.7), hit_rate=random.uniform(0.4, 0.7))
    return builder, Extras(sight=sight)


def _slip(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    builder.robot["slip"] = {
        "distance_percent": max(-15.0, min(15.0, random.gauss(0.0, 5.0))),
        "turn_percent": max(-24.0, min(24.0, random.gauss(0.0, 8.0))),
        "veer_deg_per_m": max(-20.0, min(20.0, random.gauss(0.0, 6.9))),
        "jitter_percent": random.uniform(2.0, 8.0),
    }
    return builder, NO_EXTRAS


def _compass_distortion(random: Random) -> tuple[RoomBuilder, Extras]:
    builder, _ = _slip(random)
    builder.tables["surroundings"] = {"north_deg": builder.between(0, 360)}
    builder.tables["sensors"] = [{"kind": "compass", "port": COMPASS_PORT}]
    builder.tables["magnets"] = [
        {
            "at_mm": builder.place(0.0),
            "radius_mm": builder.between(400, 1200),
            "deflection_deg": random.choice((-1, 1)) * builder.between(10, 60),
        }
        for _ in range(random.randint(1, 3))
    ]
    return builder, Extras(robot={"compass": COMPASS_PORT})


def _link(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    builder.robot["battery_mv"] = random.randint(5500, 7200)
    outages, now_s = [], random.expovariate(1 / 20)
    while now_s < TIME_LIMIT_S:
        lasts_s = random.uniform(1.0, 5.0)
        outages.append((round(now_s * 1000), round((now_s + lasts_s) * 1000)))
        now_s += lasts_s + random.expovariate(1 / 20)
    return builder, Extras(LinkFaults(silent_ms=tuple(outages)), random.uniform(*BLUETOOTH_MS))


def _distractor(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random, 2600.0, 3600.0)
    names = [f"lookalike{i}" for i in range(random.randint(1, 3))]
    for name in names:
        at, facing = builder.place_at_wall()
        while min(math.dist(at, picture["at_mm"]) for picture in builder.pictures.values()) < APART_MM:
            at, facing = builder.place_at_wall(corner_mm=350.0)
        builder.add_picture(name, at, facing, file=PICTURES / f"{random.choice(['fox', 'landscape'])}.png")
    return builder, Extras(sight=Sight(lookalikes=tuple(names), mistake_rate=random.uniform(0.2, 0.3)))


def _camera_loss(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    losses = [
        CameraLoss(target, builder.between(0.5, 4.0), builder.between(2.0, 10.0))
        for target in (builder.first, builder.second)
    ]
    return builder, Extras(sight=Sight(losses=tuple(losses)))


def _wall_start(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _furnished(random)
    (x, y), _ = builder.place_at_wall(corner_mm=400.0)
    inset = ROBOT_RADIUS_MM + 50.0
    width, depth = builder.size_mm
    x, y = builder.start_mm = min(max(x, inset), width - inset), min(max(y, inset), depth - inset)
    walls = {180: x, 0: width - x, 270: y, 90: depth - y}
    builder.heading_deg = min(walls, key=lambda heading: walls[heading]) + builder.between(-30, 30)
    return builder, NO_EXTRAS


def _narrow_door(random: Random) -> tuple[RoomBuilder, Extras]:
    builder = _room(random, 2600.0, 3600.0)
    width, depth = builder.size_mm = (builder.size_mm[0] + 800.0, builder.size_mm[1])
    x, middle, gap = builder.between(0.42, 0.58) * width, builder.between(600, depth - 600), builder.between(420, 550)
    builder.walls += [
        {"from_mm": (x, 0.0), "to_mm": (x, middle - gap / 2)},
        {"from_mm": (x, middle + gap / 2), "to_mm": (x, depth)},
    ]
    while True:
        builder.pictures.clear()
        builder.hang_targets()
        sides = [picture["at_mm"][0] - x for picture in builder.pictures.values()]
        if all(abs(side) > 400 for side in sides) and any(side > 0 for side in sides):
            break
    while True:
        builder.put_robot(far_mm=1000.0)
        if builder.start_mm[0] < x - 300:
            return builder, NO_EXTRAS


CLASSES: dict[str, Callable[[Random], tuple[RoomBuilder, Extras]]] = {
    "open": _open,
    "far": _far,
    "clutter": _clutter,
    "block_transient": _block_transient,
    "block_permanent": _block_permanent,
    "patrol": _patrol,
    "absent": _absent,
    "moved": _moved,
    "dim": _dim,
    "slip": _slip,
    "compass_distortion": _compass_distortion,
    "link": _link,
    "distractor": _distractor,
    "camera_loss": _camera_loss,
    "wall_start": _wall_start,
    "narrow_door": _narrow_door,
}
"""A function per class that draws a room from a random generator; see docs/evaluation.md."""
