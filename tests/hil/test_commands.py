"""The commands that need a brick, on a real kernel's USB."""

import pytest

NOBODY = 65534


def test_list_names_the_brick(bench):
    done = bench.run("nxtdrive list")
    assert done.code == 0
    assert "usb://001653010203" in done.out


def test_doctor_finds_no_problem(bench):
    done = bench.run("nxtdrive doctor")
    assert done.code == 0, done.out
    assert "No problems" in done.out
    assert "camera 0 gives pictures of 320x240" in done.out


def test_without_a_rule_an_ordinary_user_is_told_of_it(bench):
    done = bench.run("HOME=/run/tmp nxtdrive info --nxt usb://", user=NOBODY)
    assert done.code == 3
    assert "doctor --fix-udev" in done.err


def test_info_and_the_motor(bench):
    done = bench.run("nxtdrive info --nxt usb:// && nxtdrive motor turn B 90 --nxt usb://")
    assert done.code == 0, done.err
    assert "NXT" in done.out
    bench.at_rest()


def test_files_come_back_as_they_were(bench):
    done = bench.run(
        "head -c 20000 /dev/urandom > sent.bin; nxtdrive files put sent.bin --nxt usb:// && "
        "mkdir -p back && cd back && nxtdrive files get sent.bin --nxt usb:// && cd .. && cmp sent.bin back/sent.bin",
        timeout_s=120,
    )
    assert done.code == 0, done.err + done.out


def test_the_camera_gives_pictures(bench):
    done = bench.run("nxtdrive detect try 0 --color red --frames 5", timeout_s=60)
    assert done.code == 0, done.err + done.out


def test_a_second_program_is_told_that_the_brick_is_in_use(bench):
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


def test_a_mute_brick_is_reported(bench):
    bench.rig.fault(mute=True)
    done = bench.run("nxtdrive info --nxt usb://")
    bench.rig.fault(mute=False)
    assert done.code == 4, done.err
    assert "answer" in done.err
