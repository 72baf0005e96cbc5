"""Whole missions over USB and webcam: the shipped commands, with no simulation in them."""

import pytest

from tests.hil.conftest import HERE, MISSION_S


def test_the_thesis_drives_to_the_sheet(bench):
    bench.achieved(bench.run(bench.mission("thesis"), timeout_s=MISSION_S))


def test_the_robot_drives_to_a_picture(bench):
    bench.rig.reset(str(HERE / "picture.toml"))
    bench.achieved(bench.run(bench.mission(file=HERE / "picture-mission.toml"), timeout_s=MISSION_S))


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_devices_that_are_away_for_a_while_do_not_end_the_mission(bench, profile):
    with bench.during(bench.mission(profile)) as done:
        bench.lose_brick_and_camera()
    bench.achieved(done[0])
