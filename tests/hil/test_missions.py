"""Whole missions over USB and webcam: the shipped commands, with no simulation in them."""

import pytest

from tests.hil.conftest import HERE, MISSION_S


def test_the_thesis_drives_to_the_sheet(bench):
    bench.achieved(bench.run(bench.mission("thesis"), timeout_s=MISSION_S))


def test_the_robot_drives_to_a_picture(bench):
    bench.rig.reset(str(HERE / "picture.toml"))
    bench.achieved(bench.run(bench.mission(file=HERE / "picture-mission.toml"), timeout_s=MISSION_S))


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
@pytest.mark.parametrize("device", ["usb", "camera"])
def test_a_device_that_is_away_for_a_while_does_not_end_the_mission(bench, device, profile):
    with bench.during(bench.mission(profile)) as done:
        bench.moving()
        bench.rig.fault(unplug=device)
        if device == "camera":
            bench.at_rest(6.0)
        else:
            bench.at_rest()
        bench.rig.plug(device)
    bench.achieved(done[0])
