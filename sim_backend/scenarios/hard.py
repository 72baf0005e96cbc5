"""The hard suite: flats, people, light and robots as they ordinarily are.

The docstring of each class says what it requires of a profile. In scenarios of odd seeds, except those of `before`, the
robot differs from its description: camera, wheels and track deviate from the numbers in the mission's file.
"""

from __future__ import annotations

import math
from random import Random

from sim_backend.bundled import PICTURES
from sim_backend.scenarios.conditions import Conditions, ViewConditions
from sim_backend.scenarios.effects import EFFECTS, SONAR_PORT
from sim_backend.scenarios.flats import Flat, furnish, generate_flat
from sim_backend.scenarios.handicaps import PICTURES_APART_MM
from sim_backend.scenarios.homes import generate_home
from sim_backend.scenarios.layouts import generate_layout
from sim_backend.scenarios.realities import REALITIES
from sim_backend.scenarios.room_builder import PRINT_FOUND_MM, ROBOT, RoomBuilder, RoomGenerator, point_from
from sim_backend.scenarios.rooms import ROOMS, furnished

THREE = ("lena", "rilakkuma", "fox")
SIX = (*THREE, "landscape", "logo", "sunset")
RIDES = 50
"""Number of paths to try for a target's vehicle; if none is clear of the others, it stands still."""
MISMEASURED = {"hfov_deg": 4.0, "diameter_percent": 3.0, "track_percent": 4.0, "yaw_deg": 3.0}
"""Standard deviations of a robot's numbers from those of its mission. A guess: a ruler's errors, and those of the data
sheets of webcams."""


WALKER = {"radius_mm": (160.0, 220.0), "speed_mm_s": (200.0, 600.0)}
"""Ranges of the size and the speed of a person who walks about."""


def perturb_robot(builder: RoomBuilder) -> None:
    """Let the robot differ from the mission's description; values that the class has set stay."""
    random = builder.random
    camera = builder.tables.setdefault("camera", {})
    camera.setdefault("hfov_deg", round(60.0 + _spread(random, MISMEASURED["hfov_deg"]), 1))
    camera.setdefault("yaw_deg", round(_spread(random, MISMEASURED["yaw_deg"]), 1))
    for key, sd in (("wheel_diameter_mm", "diameter_percent"), ("track_mm", "track_percent")):
        builder.robot.setdefault(key, round(getattr(ROBOT, key) * (1.0 + _spread(random, MISMEASURED[sd]) / 100.0), 2))


def _spread(random: Random, sd: float) -> float:
    """Draw from a normal distribution without its tails beyond two standard deviations."""
    return max(-2.0 * sd, min(2.0 * sd, random.gauss(0.0, sd)))


def _flat(random: Random) -> RoomBuilder:
    """Find three targets in four rooms on a corridor within four minutes: explore rooms and doors, not places."""
    builder = furnish(generate_flat(random, 4, THREE))
    builder.conditions = Conditions(time_limit_s=240.0)
    return builder


def _everyday(random: Random) -> RoomBuilder:
    """Do the same in a furnished flat with a late, crooked camera, a wrong track, and a person in the corridor."""
    flat = generate_flat(random, 4, THREE)
    builder = furnish(flat, pieces=(1, 3))
    builder.tables["camera"] = {
        "latency_s": round(random.uniform(0.1, 0.3), 2),
        "yaw_deg": round(_spread(random, 4.0), 1),
    }
    builder.robot["track_mm"] = round(ROBOT.track_mm * (1.0 + _spread(random, 4.0) / 100.0), 2)
    _walker(builder, flat)
    return builder


def _walker(builder: RoomBuilder, flat: Flat) -> None:
    """Add a person who walks up and down the corridor."""
    (x0, y0), (x1, y1) = flat.corridor.low_mm, flat.corridor.high_mm
    y = builder.between(y0 + 250.0, y1 - 250.0)
    builder.add_patrol("neighbour", (x0 + 300.0, y), (x1 - 300.0, y), pause_s=(5, 20), **WALKER)


def _many_lookalikes(random: Random) -> RoomBuilder:
    """Tell the target from four look-alikes, each taken for it in 10 to 60 % of the frames: check before arriving."""
    builder = furnished(random, 3200.0, 4200.0)
    files = {"lookalike0": "fox", "lookalike1": "landscape", "lookalike2": "logo", "lookalike3": "sunset"}
    names = tuple(files)
    for name, file in files.items():  # those of one picture would be mistaken for each other, too
        while True:
            at, facing = builder.place_at_wall(corner_mm=350.0)
            if builder.is_apart(at, PICTURES_APART_MM):
                break
        builder.add_picture(name, at, facing, file=PICTURES / f"{file}.png")
    rates = tuple(round(random.uniform(0.1, 0.6), 2) for _ in names)
    builder.conditions = Conditions(view=ViewConditions(lookalikes=names, mistake_rates=rates))
    return builder


def _hurry(random: Random) -> RoomBuilder:
    """Reach three targets in a minute: remember what was seen on the way, and take the nearest."""
    builder = furnished(random, 2600.0, 3400.0, targets=THREE)
    builder.conditions = Conditions(time_limit_s=60.0)
    return builder


def _dusk(random: Random) -> RoomBuilder:
    """See at dusk, with five frames a second, each exposed for a tenth of a second, and half the range: turn slowly."""
    builder = furnished(random)
    builder.tables["camera"] = {"fps": 5, "shutter_s": 0.1}
    builder.tables["light"] = {"exposure": 0.35}
    builder.conditions = Conditions(view=ViewConditions(farthest_mm=PRINT_FOUND_MM / 2))
    return builder


def _doorway(random: Random) -> RoomBuilder:
    """Wait: a person stands in the only door for 5 to 45 s, and there is no way round."""
    while True:
        builder = ROOMS["narrow_door"](random)
        wall, other = builder.walls
        x, low, high = wall["from_mm"][0], wall["to_mm"][1], other["from_mm"][1]
        half, middle = builder.between(350, 400), (low + high) / 2
        wall["to_mm"], other["from_mm"] = (x, round(middle - half, 1)), (x, round(middle + half, 1))
        beyond = all(picture["at_mm"][0] > x for picture in builder.pictures.values())
        if beyond and math.dist(builder.start_mm, (x, middle)) > 900.0:
            break
    person = "who stands in the door"
    aside = (round(x + 500.0, 1), round(middle, 1))
    builder.add_person(person, aside, radius_mm=builder.between(200, 260))
    when = {"of": person, "robot_within_mm": builder.between(1100, 1500)}
    door = round(x, 1), round(middle, 1)
    builder.add_event("the door is taken", when, person=person, to_mm=door, stays_s=builder.between(5, 45))
    return builder


def _moving(random: Random) -> RoomBuilder:
    """Arrive at a target that rides to and fro on a slow vehicle."""
    builder = furnished(random, 2800.0, 3800.0)
    taken = [picture["at_mm"] for picture in builder.pictures.values()]
    for target in builder.targets:
        start, facing_deg = builder.pictures[target]["at_mm"], builder.pictures[target]["facing_deg"]
        for _ in range(RIDES):
            reach = builder.between(300, 800) * random.choice((-1, 1))
            end = point_from(start, facing_deg + 90.0, reach)
            others = (at for at in taken if at != start)
            inside = all(150.0 <= at <= side - 150.0 for at, side in zip(end, builder.size_mm, strict=True))
            if inside and all(math.dist(end, other) >= PICTURES_APART_MM for other in others):
                break
        else:
            continue
        taken.append(end)
        ride = {"times": 0, "picture": target, "speed_mm_s": builder.between(20, 60)}
        away = f"{target} rides away"
        builder.add_event(away, {"at_s": 0, "delay_s": (10, 20)}, **ride, to_mm=end)
        builder.add_event(f"{target} rides back", {"after_end_of": away, "delay_s": (2, 8)}, **ride, to_mm=start)
    return builder


def _crowd(random: Random) -> RoomBuilder:
    """Get past four to six people who walk about."""
    builder = furnished(random, 3000.0, 4000.0)
    for i in range(random.randint(4, 6)):
        ends = builder.place_at_wall(400.0)[0], builder.place_at_wall(400.0)[0]
        builder.add_patrol(f"visitor{i}", *ends, pause_s=(1, 8), **WALKER)
    return builder


def _big(random: Random) -> RoomBuilder:
    """Find six targets in eight to twelve rooms within ten minutes: plan a tour."""
    builder = furnish(generate_flat(random, random.choice((8, 10, 12)), SIX), pieces=(0, 1))
    builder.conditions = Conditions(time_limit_s=600.0)
    return builder


def _among_boxes(random: Random, effect: str) -> RoomBuilder:
    """Generate a cluttered room with an effect of reality."""
    builder = ROOMS["clutter"](random)
    EFFECTS[effect](builder)
    return builder


def _kidnap(random: Random) -> RoomBuilder:
    """Notice that it was carried elsewhere, and begin again."""
    return _among_boxes(random, "kidnapped")


def _wheel_slip(random: Random) -> RoomBuilder:
    """Keep the map correct while a wheel slips for minutes."""
    return _among_boxes(random, "wheel_slips")


def _battery(random: Random) -> RoomBuilder:
    """Get there with a battery that sags under load and runs down."""
    return _among_boxes(random, "weak_battery")


def _sonar_silent(random: Random) -> RoomBuilder:
    """Go on among objects that absorb ultrasound, with a sonar that gives no echo from some moment on."""
    builder = _among_boxes(random, "soft_things")
    when = {"at_s": builder.between(0, 40)}
    builder.add_event("the sonar falls silent", when, sensor=SONAR_PORT, fault="no_echo")
    return builder


def _before(random: Random) -> RoomBuilder:
    """Reach a print with clutter 0.26 to 0.48 m in front of it: approach from another side."""
    return REALITIES["before"](random)


def _home(random: Random) -> RoomBuilder:
    """Find prints of three sizes in a furnished home: mind legs, soft furniture, doors ajar, toys and a flatmate."""
    return generate_home(random, THREE)


HARD: dict[str, RoomGenerator] = {
    "flat": _flat,
    "everyday": _everyday,
    "many_lookalikes": _many_lookalikes,
    "before": _before,
    "hurry": _hurry,
    "dusk": _dusk,
    "doorway": _doorway,
    "moving": _moving,
    "kidnap": _kidnap,
    "wheel_slip": _wheel_slip,
    "battery": _battery,
    "sonar_silent": _sonar_silent,
    "crowd": _crowd,
    "big": _big,
    "layouts": generate_layout,
    "home": _home,
}
"""A function per class of the hard suite; see docs/evaluation.md."""
