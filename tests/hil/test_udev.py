"""Permission to open the brick: the udev rule, installed as `doctor` does it, under the real udevd."""

import grp

import pytest

from tests.hil.conftest import NOBODY

UDEVD = "/lib/systemd/systemd-udevd"
RULE = "/etc/udev/rules.d/60-nxtdrive.rules"
OURS = "d=$(dirname $(grep -l 0694 /sys/bus/usb/devices/*/idVendor))"
NODE = f"$({OURS}; echo /dev/$(grep DEVNAME $d/uevent | cut -d= -f2))"
INFO = "HOME=/run/tmp nxtdrive info --nxt usb://"
DOCTOR = "HOME=/run/tmp nxtdrive doctor"


@pytest.fixture
def ruled(bench):
    """The bench under udevd with our rule; afterwards without both."""
    if bench.run(f"test -x {UDEVD}").code:
        pytest.skip("no systemd-udevd: apt-get install udev")
    done = bench.run(
        f"mkdir -p /run/udev && {UDEVD} --daemon && nxtdrive doctor --fix-udev --install && "
        "udevadm trigger --action=add --subsystem-match=usb && udevadm settle"
    )
    assert done.code == 0, done.err + done.out
    _await_rule(bench)  # udevd may begin only when `settle` has found no work
    yield bench
    bench.run(f"pkill -9 udevd; rm -rf {RULE} /run/udev")


def _await_rule(bench):
    bench.rig.wait_for(f"stat -c %G {NODE} | grep plugdev", "the rule at work")


def test_the_group_may_open_the_brick_and_others_may_not(ruled):
    plugdev = grp.getgrnam("plugdev").gr_gid
    assert ruled.run(f"stat -c '%a %G' {NODE}").out.strip() == "660 plugdev"
    member = ruled.rig.run(DOCTOR, user=NOBODY, groups=[plugdev, grp.getgrnam("video").gr_gid])
    assert member.code == 0, member.out
    other = ruled.run(INFO, user=NOBODY)  # nor has it a seat: nobody sits before this computer
    assert other.code == 3
    assert "plugdev" in other.err


def test_a_brick_that_is_plugged_in_later_gets_the_rule(ruled):
    ruled.rig.fault(unplug="usb")
    ruled.rig.wait_for("! ls -d /sys/bus/usb/devices/1-1", "that the brick is gone")
    ruled.rig.plug("usb")
    _await_rule(ruled)


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_mission_continues_when_brick_and_camera_come_back_under_udevd(ruled, profile):
    with ruled.during(ruled.mission(profile)) as done:
        ruled.lose_brick_and_camera()
    ruled.achieved(done[0])
