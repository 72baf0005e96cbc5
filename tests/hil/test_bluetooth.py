"""The brick over Bluetooth: the kernel's HCI, L2CAP and RFCOMM, by bt:// and by /dev/rfcomm0."""

import pytest

from tests.hil.conftest import BRICK, BT, MISSION, MISSION_S

BIND = f"""set -e; python3 - <<'END'
import fcntl, socket, struct
RFCOMMCREATEDEV, CHANNEL = 0x400452C8, 1
address = bytes.fromhex("{BRICK}".replace(":", ""))[::-1]
with socket.socket(31, socket.SOCK_RAW, 3) as control:
    fcntl.ioctl(control, RFCOMMCREATEDEV, struct.pack("=h2xI6s6sB3x", 0, 0, bytes(6), address, CHANNEL))
END
until test -e /dev/rfcomm0; do sleep 0.1; done"""


def test_info_over_the_kernels_bluetooth(radio):
    done = radio.run(f"nxtdrive info --nxt {BT}")
    assert done.code == 0, done.err
    assert BRICK in done.out


def test_a_mission_over_bluetooth(radio):
    radio.achieved(radio.run(radio.mission(nxt=BT), timeout_s=MISSION_S))


def test_a_mission_over_a_serial_port(radio):
    radio.achieved(radio.run(f"{BIND} && {radio.mission(nxt='serial:///dev/rfcomm0')}", timeout_s=MISSION_S))


def test_a_brick_that_hangs_up_is_called_again(radio):
    with radio.during(radio.mission(nxt=BT)) as done:
        radio.moving()
        radio.rig.fault(radio="hang up")
        radio.at_rest()
    radio.achieved(done[0])


@pytest.mark.loses_bluetooth
@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_mission_continues_after_the_brick_was_out_of_range(radio, profile):
    with radio.during(radio.mission(profile, nxt=BT)) as done:
        radio.moving()
        radio.rig.fault(radio="vanish")
        radio.at_rest()
        radio.rig.fault(radio="return")
    radio.achieved(done[0])


@pytest.mark.loses_bluetooth
def test_a_brick_that_stays_out_of_range_ends_the_mission(radio):
    impatient = f"sed 's/^targets/reconnect_timeout_s = 5\\n&/' {MISSION} > impatient.toml"
    with radio.during(f"{impatient} && {radio.mission(nxt=BT, file='impatient.toml')}") as done:
        radio.moving()
        radio.rig.fault(radio="vanish")
        radio.at_rest()
    assert done[0].code == 4, done[0].err + done[0].out
    assert not radio.reached()


@pytest.mark.loses_bluetooth
def test_a_brick_that_is_not_there_is_reported_each_time(radio):
    radio.rig.fault(radio="vanish")
    done = radio.run(f"nxtdrive info --nxt {BT}; nxtdrive info --nxt {BT}")
    assert done.code == 3
    assert done.err.count("does not answer") == 2
