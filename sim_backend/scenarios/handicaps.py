"""Robots with poor light, slipping wheels, a bad link, or a camera that fails or makes mistakes."""

from __future__ import annotations

from random import Random
from typing import Final

from sim_backend.bundled import PICTURES
from sim_backend.link import LinkFaults
from sim_backend.scenarios.conditions import BLUETOOTH_MS, TIME_LIMIT_S, CameraLoss, Conditions, ViewConditions
from sim_backend.scenarios.room_builder import PRINT_FOUND_MM, RoomBuilder, RoomGenerator
from sim_backend.scenarios.rooms import furnished

COMPASS_PORT: Final = 2
PICTURES_APART_MM = 700.0
"""Smallest distance from a look-alike to another picture: a sighting must belong to one or the other."""


def _dim(random: Random) -> RoomBuilder:
    builder = furnished(random)
    builder.tables["light"] = {"exposure": round(random.uniform(0.3, 0.5), 2)}
    view = ViewConditions(farthest_mm=PRINT_FOUND_MM * builder.between(0.45, 0.7), hit_rate=random.uniform(0.4, 0.7))
    builder.conditions = Conditions(view=view)
    return builder


def _slip(random: Random) -> RoomBuilder:
    builder = furnished(random)
    builder.robot["slip"] = {
        "distance_percent": max(-15.0, min(15.0, random.gauss(0.0, 5.0))),
        "turn_percent": max(-24.0, min(24.0, random.gauss(0.0, 8.0))),
        "veer_deg_per_m": max(-20.0, min(20.0, random.gauss(0.0, 6.9))),
        "jitter_percent": random.uniform(2.0, 8.0),
    }
    return builder


def _compass_distortion(random: Random) -> RoomBuilder:
    builder = _slip(random)
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
    builder.conditions = Conditions(robot={"compass": COMPASS_PORT})
    return builder


def _link(random: Random) -> RoomBuilder:
    builder = furnished(random)
    builder.robot["battery_mv"] = random.randint(5500, 7200)
    outages, now_s = [], random.expovariate(1 / 20)
    while now_s < TIME_LIMIT_S:
        lasts_s = random.uniform(1.0, 5.0)
        outages.append((round(now_s * 1000), round((now_s + lasts_s) * 1000)))
        now_s += lasts_s + random.expovariate(1 / 20)
    builder.conditions = Conditions(LinkFaults(silent_ms=tuple(outages)), random.uniform(*BLUETOOTH_MS))
    return builder


def _distractor(random: Random) -> RoomBuilder:
    builder = furnished(random, 2600.0, 3600.0)
    names = [f"lookalike{i}" for i in range(random.randint(1, 3))]
    for name in names:
        at, facing = builder.place_at_wall()
        while not builder.is_apart(at, PICTURES_APART_MM):
            at, facing = builder.place_at_wall(corner_mm=350.0)
        builder.add_picture(name, at, facing, file=PICTURES / f"{random.choice(['fox', 'landscape'])}.png")
    builder.conditions = Conditions(view=ViewConditions(lookalikes=tuple(names), mistake_rate=random.uniform(0.2, 0.3)))
    return builder


def _camera_loss(random: Random) -> RoomBuilder:
    builder = furnished(random)
    losses = [CameraLoss(target, builder.between(0.5, 4.0), builder.between(2.0, 10.0)) for target in builder.targets]
    builder.conditions = Conditions(view=ViewConditions(losses=tuple(losses)))
    return builder


HANDICAPS: dict[str, RoomGenerator] = {
    "dim": _dim,
    "slip": _slip,
    "compass_distortion": _compass_distortion,
    "link": _link,
    "distractor": _distractor,
    "camera_loss": _camera_loss,
}
