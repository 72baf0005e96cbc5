"""The commands that need a brick, on a real kernel's USB."""

import json

import pytest

from nxtdrive.tools.rig import camera
from tests.hil.conftest import NOBODY


def test_list_names_the_brick(bench):
    done = bench.run("nxtdrive list")
    assert done.code == 0
    assert "usb://001653010203" in done.out


def test_doctor_finds_no_problem(bench):
    done = bench.run("nxtdrive doctor")
    assert done.code == 0, done.out
    assert "No problems" in done.out
    assert "camera 0 delivers frames of 320x240" in done.out


def test_without_a_rule_an_ordinary_user_gets_advice(bench):
    done = bench.run("HOME=/run/tmp nxtdrive info --nxt usb://", user=NOBODY)
    assert done.code == 3
    assert "doctor --fix-udev" in done.err
    examined = bench.run("HOME=/run/tmp nxtdrive doctor", user=NOBODY)
    assert examined.code == 3
    assert "doctor --fix-udev" in examined.out


def test_info_and_the_motor(bench):
    done = bench.run("nxtdrive info --nxt usb:// && nxtdrive motor turn B 90 --nxt usb://")
    assert done.code == 0, done.err
    assert "NXT" in done.out
    bench.at_rest()


def test_files_come_back_as_they_were(bench):
    done = bench.run(
        "head -c 20000 /dev/urandom > sent.bin; nxtdrive files put sent.bin --nxt usb:// && "
        "mkdir -p back && cd back && nxtdrive files get sent.bin --nxt usb:// && cd .. && cmp sent.bin back/sent.bin",
    )
    assert done.code == 0, done.err + done.out


def test_the_camera_gives_pictures(bench):
    done = bench.run("nxtdrive detect try 0 --color red --frames 5")
    assert done.code == 0, done.err + done.out


def test_the_webcam_s_pictures_are_fresh(bench, record_property):
    figures = camera.measure(bench.rig)
    record_property("frames_per_s", figures.frames_per_s)
    record_property("latency_s", figures.latency_s)
    assert figures.frames_per_s > 5
    assert figures.longest_s < 2


def test_the_monitor_shows_sensors_and_the_sensor_command_reads_one(bench):
    shown = bench.run("nxtdrive monitor --nxt usb:// --once --json")
    assert shown.code == 0, shown.err
    assert json.loads(shown.out)
    read = bench.run("nxtdrive sensor read 4 ultrasonic --nxt usb://")
    assert read.code == 0, read.err


def test_a_brick_with_another_id_is_not_taken(bench):
    done = bench.run("nxtdrive info --nxt usb://001653FFFFFF")
    assert done.code == 3
    assert "001653010203" in done.err


def test_a_second_program_gets_the_error_that_the_brick_is_in_use(bench):
    with bench.during("nxtdrive monitor --nxt usb:// --json", interrupt=True):
        bench.until(lambda truth: truth["telegrams"] > 3)
        done = bench.run("nxtdrive info --nxt usb://")
    assert done.code in (3, 4)
    assert "is in use" in done.err


@pytest.mark.parametrize("endpoint", [0x01, 0x82])
def test_a_halted_endpoint_is_cleared(bench, endpoint):
    bench.rig.fault(halt=endpoint)
    done = bench.run("nxtdrive info --nxt usb://")
    assert done.code == 0, done.err
    assert "NXT" in done.out


def test_a_mute_brick_is_reported(bench):
    bench.rig.fault(mute=True)
    done = bench.run("nxtdrive info --nxt usb://")
    bench.rig.fault(mute=False)
    assert done.code == 4, done.err
    assert "answer" in done.err
