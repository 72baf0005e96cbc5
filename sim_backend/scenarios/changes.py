"""Rooms that change: people and boxes come in between, pictures move."""

from __future__ import annotations

import math
from random import Random

from sim_backend.scenarios.room_builder import LOW_BOX_MM, TALL_BOX_MM, RoomBuilder, RoomGenerator
from sim_backend.scenarios.rooms import furnished, room


def _block_transient(random: Random) -> RoomBuilder:
    builder = furnished(random, 2600.0, 3600.0)
    for target in builder.targets:
        person = f"visitor of {target}"
        builder.add_person(person, builder.place_at_wall(350.0)[0], radius_mm=builder.between(160, 280))
        for i in range(random.randint(1, 2)):
            stays_s = builder.between(2, 6) if random.random() < 0.5 else min(60.0, 4 + random.expovariate(1 / 18))
            when = {"sees": target, "for_s": builder.between(0.5, 2.0), "robot_beyond_mm": 1000}
            builder.add_event(
                f"{person} {i}",
                {**when, "after_end_of": f"{person} {i - 1}"} if i else when,
                person=person,
                blocks=target,
                blocks_at_mm=builder.between(550, 900),
                stays_s=round(stays_s, 1),
            )
    return builder


def _block_permanent(random: Random) -> RoomBuilder:
    builder = room(random, 2800.0, 3800.0)
    builder.hang_targets(corner_mm=900.0)
    builder.put_robot(far_mm=1700.0)
    for target in builder.targets:
        radius_mm = builder.between(160, 320)
        low = random.random() < 0.4
        box, side_mm = f"box before {target}", radius_mm * math.sqrt(2)
        height_mm = builder.between(*(LOW_BOX_MM if low else TALL_BOX_MM))
        builder.add_box(box, builder.start_mm, (side_mm, side_mm), height_mm, present=False)
        when = {"sees": target, "for_s": builder.between(0.5, 2.0), "robot_beyond_mm": 1200}
        blocks_at_mm = radius_mm + builder.between(420, 600)
        builder.add_event(f"{target} is blocked", when, box=box, blocks=target, blocks_at_mm=blocks_at_mm)
    return builder


def _patrol(random: Random) -> RoomBuilder:
    builder = furnished(random, 2600.0, 3600.0)
    for i in range(random.randint(2, 3)):
        beat = builder.place_at_wall(400.0)[0], builder.place_at_wall(400.0)[0]
        builder.add_patrol(f"guard{i}", *beat, pause_s=(0, 8), radius_mm=(160, 250), speed_mm_s=(120, 400))
    return builder


def _moved(random: Random) -> RoomBuilder:
    builder = furnished(random, 2600.0, 3600.0)
    taken = [picture["at_mm"] for picture in builder.pictures.values()]
    for target in builder.targets:
        places = [builder.place_at_wall() for _ in range(20)]
        to_mm, facing_deg = max(places, key=lambda place: min(math.dist(place[0], at) for at in taken))
        taken.append(to_mm)
        when = {"sees": target, "for_s": builder.between(1, 8), "robot_beyond_mm": 700}
        builder.add_event(f"{target} moves", when, picture=target, to_mm=to_mm, facing_deg=facing_deg)
    return builder


CHANGES: dict[str, RoomGenerator] = {
    "block_transient": _block_transient,
    "block_permanent": _block_permanent,
    "patrol": _patrol,
    "moved": _moved,
}
