"""A camera that is mounted at an angle, and a mission that describes it."""

import math

import pytest

from behaviors.adaptive.world_model import WorldModel
from behaviors.mission import Mission
from nxtdrive.brick import open_brick
from nxtdrive.mission.body import build_body
from nxtdrive.mission.files import PICTURES
from nxtdrive.mission.vision import geometric_vision

WORLD = """
[floor]
size_mm = [4000, 3000]
[robot]
start_mm = [800, 1500]
slip = {{ jitter_percent = 0 }}
[camera]
{camera}
[[pictures]]
name = "lena"
at_mm = [2400, 1500]
facing_deg = 180
"""
ASKEW = {
    "hfov_deg": 66.0,
    "forward_mm": 80.0,
    "right_mm": -25.0,
    "yaw_deg": 8.0,
    "tilt_deg": 6.0,
    "roll_deg": -12.0,
    "latency_s": 0.25,
}
TRUE_PLACE = (1600.0, 0.0)


def _place(tmp_path, camera, believed):
    """Return where a mission believes the picture after turning past it."""
    keys = "\n".join(f"{key} = {value}" for key, value in camera.items())
    (tmp_path / "world.toml").write_text(WORLD.format(camera=keys))
    mission = Mission.model_validate(
        {
            "mission": {"targets": ["lena"]},
            "target": {"lena": {"detector": "picture", "pictures": [str(PICTURES / "lena.png")]}},
            "camera": believed,
        }
    )
    with open_brick(f"sim://{tmp_path}/world.toml") as brick:
        body, vision = build_body(brick, mission), geometric_vision(brick, mission)
        world, until_s = WorldModel(mission), brick.now() + 1.5
        body.turn(-20.0)
        while brick.now() < until_s or body.pose().heading_deg < 5.0:
            body.drive(0.0, 30.0)
            seen = vision.glance(["lena"])
            world.perceive(brick.now(), body.pose(), None, ["lena"], seen)
            if body.pose().heading_deg > 10.0:
                break
        return world.targets.known["lena"].place


def test_a_known_mounting_and_latency_place_the_target(tmp_path):
    assert _place(tmp_path, ASKEW, ASKEW) == pytest.approx(TRUE_PLACE, abs=60)


@pytest.mark.parametrize("unknown", ["hfov_deg", "yaw_deg", "latency_s"])
def test_what_is_not_known_misplaces_it(tmp_path, unknown):
    believed = {key: value for key, value in ASKEW.items() if key != unknown}
    assert math.dist(_place(tmp_path, ASKEW, believed), TRUE_PLACE) > 100
