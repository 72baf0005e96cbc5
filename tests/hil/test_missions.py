"""Whole missions over USB and webcam: the shipped commands, with no simulation in them."""

import json

import pytest

from tests.hil.conftest import MISSION_S


def journal(bench):
    lines = bench.run("cat runs/*/journal.jsonl").out.splitlines()
    return [json.loads(line) for line in lines]


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_the_robot_drives_to_the_sheet(bench, profile):
    done = bench.run(bench.mission(profile), timeout_s=MISSION_S)
    assert done.code == 0, done.err + done.out
    assert "achieved" in done.out
    assert bench.reached()
    assert journal(bench)[-1]["ending"] == "achieved"


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
    [done] = done
    assert done.code == 0, done.err + done.out
    assert bench.reached()
