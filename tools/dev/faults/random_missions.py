"""Random worlds and missions for the campaign `missions`: any keys of a world file and a mission file together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

import tomlkit

from behaviors.mission import Mission, MissionError, load_mission
from firmware_protocol.errors import ConfigError
from nxtdrive.mission.files import PICTURES
from sim_backend.world.loading import load_world
from sim_backend.world.toml_types import TEXTURES
from sim_backend.world.world_file import WorldFile

from .random_ranges import BELIEVED, INTEGERS, MISSION_NUMBERS, NUMBERS, SWITCHES
from .wire import KINDS, TRANSPORTS, Fault

PRINTS = ("lena", "rilakkuma", "fox", "landscape", "sunset", "logo")
PRINT_MM = (210.0, 297.0)
FAULTY = 0.25
"""Share of the missions with a fault of the link."""
EASY_ROOM_SHARE = 0.4
"""Share of the rooms with little in the way, so that targets are reached."""
TELEGRAMS = 1500
"""Roughly the number of telegrams of a mission."""


@dataclass(frozen=True, slots=True)
class RandomMission:
    """A world, a mission in it, and how the link to the robot fails.

    Attributes:
        world: The room.
        mission: The mission.
        described: Whether the mission describes the robot as it is, so that its claims can be checked.
        transport: The kind of link.
        fault: What happens to the link, if anything.
        latency_ms: Round-trip time of the link.
        camera_lost_ms: Spans of time without frames.
        camera: Whether frames are rendered.
        seed: Of the simulation.
    """

    world: WorldFile
    mission: Mission
    described: bool
    transport: str
    fault: Fault | None
    latency_ms: int
    camera_lost_ms: tuple[tuple[int, int], ...]
    camera: bool
    seed: int


def draw(seed: int, number: int, folder: Path, *, camera: bool) -> RandomMission:
    """Draw a mission that nxtdrive accepts.

    Args:
        seed: Of the campaign.
        number: Of the trial.
        folder: Where to write `world.toml` and `mission.toml`.
        camera: Whether frames are rendered.
    """
    random = Random(f"{seed}/{number}")  # noqa: S311 - repeatable
    while True:
        world, described = _World(random).tables(), random.random() < 0.6
        mission = _mission(random, world, described)
        try:
            (folder / "world.toml").write_text(tomlkit.dumps(world), encoding="utf-8")
            (folder / "mission.toml").write_text(tomlkit.dumps(mission), encoding="utf-8")
            checked_world = load_world(folder / "world.toml")
            checked = load_mission(folder / "mission.toml", [PICTURES])
        except (ConfigError, MissionError):
            continue
        break
    fault = Fault(random.choice(KINDS), random.randrange(TELEGRAMS), draw=seed) if random.random() < FAULTY else None
    lost = [
        (at, at + random.randrange(100, 20_000)) for at in random.choices(range(60_000), k=random.choice((0, 0, 1, 3)))
    ]
    latency = random.choice((2, 2, 2, 45, 150, 300))
    return RandomMission(
        checked_world, checked, described, random.choice(TRANSPORTS), fault, latency, tuple(lost), camera, number
    )


def _numbers(random: Random, ranges: Mapping[str, tuple[float, float]], share: float) -> dict[str, Any]:
    """Return some of the keys with random values, at times one at the end of its range."""
    drawn: dict[str, Any] = {}
    for key, (low, high) in ranges.items():
        if random.random() < share:
            value = random.choice((low, high)) if random.random() < 0.2 else random.uniform(low, high)
            drawn[key] = round(value) if key in INTEGERS else round(value, 3)
    return drawn


class _World:
    """A random room."""

    def __init__(self, random: Random) -> None:
        self.random = random
        self.calm = random.random() < EASY_ROOM_SHARE
        self.share = 0.0 if self.calm else random.choice((0.0, 0.03, 0.1, 0.3))
        self.size = (round(random.uniform(1200, 5000)), round(random.uniform(1200, 5000)))
        self.prints = random.sample(PRINTS, random.randint(1, 4))

    def tables(self) -> dict[str, Any]:
        """Return the tables of a world file."""
        random, world = self.random, dict[str, Any]()
        world["floor"] = {"size_mm": self.size, "wall_texture": random.choice(TEXTURES)}
        world |= {table: _numbers(random, NUMBERS[table], self.share) for table in NUMBERS if "." not in table}
        slip = _numbers(random, NUMBERS["robot.slip"], self.share)
        world["robot"] |= {"start_mm": self.place(), "heading_deg": random.uniform(-180, 180), "slip": slip}
        self._ports(world)
        world["walls"] = [self._wall() for _ in range(0 if self.calm else random.choice((0, 0, 1, 2, 4)))]
        world["boxes"] = [self._box(f"box {i}") for i in range(random.choice((0, 1) if self.calm else (0, 1, 2, 5)))]
        world["pictures"] = [self._picture(name) for name in self.prints]
        world["people"] = [self._person(f"person {i}") for i in range(random.choice((0, 0, 1, 2)))]
        world["carpets"] = [self._carpet() for _ in range(random.choice((0, 0, 1)))]
        world["shades"] = [
            {
                "at_mm": self.place(),
                "radius_mm": random.uniform(100, 3000),
                "exposure": random.choice((0.05, 0.5, 5, 20)),
            }
            for _ in range(random.choice((0, 0, 1)))
        ]
        world["magnets"] = [
            {"at_mm": self.place(), "radius_mm": random.uniform(100, 2000), "deflection_deg": random.uniform(-180, 180)}
            for _ in range(random.choice((0, 0, 1)))
        ]
        world["events"] = [
            self._event(world, i) for i in range(random.choice((0, 1, 3) if self.calm else (0, 0, 1, 2, 4, 8)))
        ]
        return world

    def place(self) -> tuple[float, float]:
        """Return a place in the room."""
        return tuple(round(self.random.uniform(0, length), 1) for length in self.size)  # type: ignore[return-value]

    def _ports(self, world: dict[str, Any]) -> None:
        random = self.random
        if random.random() < self.share:
            left, right = random.sample("ABC", 2)
            world["robot"] |= {"left_port": left, "right_port": right}
        if random.random() < self.share:
            touch, sonar = random.sample(range(1, 5), 2)
            world["robot"] |= {
                "touch_port": touch * random.choice((0, 1)),
                "ultrasonic_port": sonar * random.choice((0, 1)),
            }
        used = {world["robot"].get("touch_port", 1), world["robot"].get("ultrasonic_port", 4)}
        free = [port for port in range(1, 5) if port not in used]
        kinds = (
            {"kind": "compass", "noise_deg": random.uniform(0, 90)},
            {"kind": "touch"},
            {"kind": "sound"},
            {"kind": "color"},
        )
        world["sensors"] = [
            {**random.choice(kinds), "port": port}
            for port in random.sample(free, random.choice((0, 1, min(2, len(free)))))
        ]

    def _wall(self) -> dict[str, Any]:
        random, start = self.random, self.place()
        height, thickness = random.choice((600, 600, 50, 150)), random.uniform(5, 200)
        return {
            "from_mm": start,
            "to_mm": self.place(),
            "absorbs": random.random() < 0.3,
            "height_mm": height,
            "thickness_mm": thickness,
            "texture": random.choice(TEXTURES),
        }

    def _box(self, name: str) -> dict[str, Any]:
        random = self.random
        box = {
            "name": name,
            "at_mm": self.place(),
            "size_mm": [random.uniform(20, 900), random.uniform(20, 900)],
            "height_mm": random.choice((10, 60, 150, 350, 2000)),
            "facing_deg": random.uniform(-180, 180),
            "absorbs": random.random() < 0.2,
            "texture": random.choice((*TEXTURES, *TEXTURES)),
            "present": random.random() < 0.8,
        }
        return box | ({"mass_kg": 10 ** random.uniform(-2, 1)} if random.random() < 0.3 else {})

    def _picture(self, name: str) -> dict[str, Any]:
        random, (x_mm, y_mm) = self.random, self.place()
        inward = math.degrees(math.atan2(self.size[1] / 2 - y_mm, self.size[0] / 2 - x_mm))
        return {
            "name": name,
            "at_mm": (x_mm, y_mm),
            "facing_deg": inward + random.choice((random.uniform(-50, 50), random.uniform(-180, 180))),
            "size_mm": PRINT_MM,
            "centre_height_mm": random.choice((200, 200, 200, 200, 160, 300, 500)),
            "present": random.random() < 0.95,
        }

    def _person(self, name: str) -> dict[str, Any]:
        random = self.random
        return {
            "name": name,
            "enters_from_mm": self.place(),
            "radius_mm": random.uniform(80, 300),
            "height_mm": random.choice((1700, 1200, 150)),
            "speed_mm_s": random.choice((50, 800, 3000)),
            "absorbs": random.random() < 0.3,
        }

    def _carpet(self) -> dict[str, Any]:
        random = self.random
        slip = _numbers(random, NUMBERS["robot.slip"], 0.5)
        size = [random.uniform(100, 3000), random.uniform(100, 3000)]
        return {
            "at_mm": self.place(),
            "size_mm": size,
            "grip": random.uniform(0.1, 1.5),
            "drag_nm": random.uniform(0, 0.1),
            "slip": slip,
        }

    def _event(self, world: dict[str, Any], number: int) -> dict[str, Any]:
        random = self.random
        event: dict[str, Any] = {"name": f"event {number}", "times": random.choice((1, 1, 2, 0))}
        event["when"] = self._when(number)
        people, boxes = ([each["name"] for each in world[kind]] for kind in ("people", "boxes"))
        stays = random.choice((0.5, 5, [1, 20], 60))
        subject = random.choice(("person", "person", "picture", "box", "sensor", "wheel", "robot"))
        if subject == "person" and people:
            where = random.choice(({"blocks": random.choice(self.prints)}, {"to_mm": self.place()}))
            return event | {"person": random.choice(people), "stays_s": stays} | where
        if subject == "box" and boxes:
            change = random.choice(
                ({"to_mm": self.place()}, {"present": False}, {"blocks": random.choice(self.prints)})
            )
            return event | {"box": random.choice(boxes)} | change
        if subject == "sensor":
            ports = [world["robot"].get("touch_port", 1), world["robot"].get("ultrasonic_port", 4)]
            fault = random.choice(("no_echo", "stuck", "error", "unplugged"))
            return (
                event | {"sensor": random.choice(ports) or 2, "fault": fault} | random.choice(({}, {"stays_s": stays}))
            )
        if subject == "wheel":
            slip = random.choice((20, 60, 100))
            return event | {"wheel": random.choice(("left", "right", "both")), "slip_percent": slip, "stays_s": stays}
        if subject == "robot":
            return event | {"robot": True, "to_mm": self.place(), "facing_deg": random.uniform(-180, 180)}
        changes: tuple[dict[str, Any], ...] = ({"to_mm": self.place()}, {"present": False})
        change = random.choice((*changes, {"to_mm": self.place(), "speed_mm_s": 200}))
        return event | {"picture": random.choice(self.prints)} | change

    def _when(self, number: int) -> dict[str, Any]:
        random = self.random
        kind = random.randrange(4)
        if kind == 0 and number:
            return {
                random.choice(("after", "after_end_of")): f"event {number - 1}",
                "delay_s": random.choice((0, 3, [1, 9])),
            }
        if kind == 1:
            return {"sees": random.choice(self.prints), "for_s": random.choice((0, 0.5, [0.5, 3]))}
        if kind == 2:
            return {"of": random.choice(self.prints), "robot_within_mm": random.uniform(300, 2000)}
        return {"at_s": random.uniform(0, 60)}


def _mission(random: Random, world: Mapping[str, Any], described: bool) -> dict[str, Any]:
    names = [each["name"] for each in world["pictures"]]
    targets = random.sample(names, random.randint(1, len(names)))
    profile, share = random.choice(("thesis", "adaptive", "adaptive")), random.choice((0.0, 0.1, 0.5))
    table = {
        "name": "random",
        "targets": targets,
        "profile": profile,
        "rounds": random.choice((1, 1, 2, 5)),
        "time_limit_s": random.choice((5, 60, 120, 120, 240)),
        "reconnect_timeout_s": random.choice((0, 15, 15, 30)),
    }
    own = _numbers(random, MISSION_NUMBERS[profile], share)
    if profile == "adaptive":
        own |= {name: random.random() < 0.5 for name in SWITCHES if random.random() < share}
    target = {"detector": "picture", "height_mm": PRINT_MM[1]}
    tables: dict[str, Any] = {
        "mission": table,
        profile: own,
        "target": {name: {**target, "pictures": [str(PICTURES / f"{name}.png")]} for name in targets},
    }
    robot, camera = _as_it_is(world) if described else ({}, {})
    if not described:
        odd: tuple[dict[str, Any], ...] = ({}, {}, {"left_reversed": True}, {"ultrasonic": 0}, {"touch": 0})
        robot = _numbers(random, BELIEVED["robot"], 0.3) | random.choice(odd)
        camera = _numbers(random, BELIEVED["camera"], 0.3)
    return {**tables, "robot": robot, "camera": camera}


def _as_it_is(world: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the tables of a mission that describes the robot of a world."""
    robot, camera = world["robot"], world["camera"]
    names = {"left_port": "left", "right_port": "right", "touch_port": "touch", "ultrasonic_port": "ultrasonic"}
    known = {own: robot[key] for key, own in names.items() if key in robot}
    known |= {"wheel_diameter_mm": robot.get("wheel_diameter_mm", 56.0), "axle_track_mm": robot.get("track_mm", 112.0)}
    known["radius_mm"] = robot.get("radius_mm", 115.0) + 15
    known["sonar_forward_mm"] = world["ultrasonic"].get("forward_mm", 100.0)
    known["sonar_height_mm"] = world["ultrasonic"].get("height_mm", 90.0)
    compasses = [each["port"] for each in world["sensors"] if each["kind"] == "compass" and each["noise_deg"] < 5]
    known |= {"compass": compasses[0]} if compasses else {}
    keys = ("hfov_deg", "right_mm", "height_mm", "yaw_deg", "tilt_deg", "roll_deg", "latency_s")
    lens = {key: camera[key] for key in keys if key in camera}
    return known, lens | {"forward_mm": camera.get("forward_mm", 60.0)}
