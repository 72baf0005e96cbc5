"""The brick over Bluetooth: the kernel's HCI, L2CAP and RFCOMM, by bt:// and by /dev/rfcomm0."""

import pytest

from tests.hil.conftest import MISSION

BRICK = "00:16:53:01:02:03"
BT = f"bt://{BRICK}"
BIND = f"""set -e; python3 - <<'END'
import fcntl, socket, struct
RFCOMMCREATEDEV, CHANNEL = 0x400452C8, 1
address = bytes.fromhex("{BRICK}".replace(":", ""))[::-1]
with socket.socket(31, socket.SOCK_RAW, 3) as control:
    fcntl.ioctl(control, RFCOMMCREATEDEV, struct.pack("=h2xI6s6sB3x", 0, 0, bytes(6), address, CHANNEL))
END
until test -e /dev/rfcomm0; do sleep 0.1; done"""


def with_bluetooth(bench):
    """The bench, if it has a Bluetooth adapter."""
    if not bench.rig.bluetooth:
        pytest.skip("no bumble: pip install nxtdrive[hil]")
    return bench


@pytest.fixture
def radio(bench):
    """The bench with a Bluetooth adapter and the brick in its air."""
    return with_bluetooth(bench)


def test_info_over_the_kernels_bluetooth(radio):
    done = radio.run(f"nxtdrive info --nxt {BT}")
    assert done.code == 0, done.err
    assert BRICK in done.out


def test_a_mission_over_bluetooth(radio):
    done = radio.run(radio.mission(nxt=BT), timeout_s=200)
    assert done.code == 0, done.err + done.out
    assert radio.reached()


def test_a_mission_over_a_serial_port(radio):
    done = radio.run(f"{BIND} && {radio.mission(nxt='serial:///dev/rfcomm0')}", timeout_s=200)
    assert done.code == 0, done.err + done.out
    assert radio.reached()


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_mission_goes_on_after_the_brick_was_out_of_range(radio, profile):
    with radio.during(radio.mission(profile, nxt=BT), timeout_s=240) as done:
        radio.moving()
        radio.rig.fault(radio="vanish")
        radio.at_rest()
        radio.rig.fault(radio="return")
    assert done[0].code == 0, done[0].err + done[0].out
    assert radio.reached()


def test_a_brick_that_hangs_up_is_called_again(radio):
    with radio.during(radio.mission(nxt=BT), timeout_s=240) as done:
        radio.moving()
        radio.rig.fault(radio="hang up")
        radio.at_rest()
    assert done[0].code == 0, done[0].err + done[0].out
    assert radio.reached()


def test_a_brick_that_stays_out_of_range_ends_the_mission(radio):
    impatient = f"sed 's/^targets/reconnect_timeout_s = 5\\n&/' {MISSION} > impatient.toml"
    with radio.during(f"{impatient} && {radio.mission(nxt=BT, file='impatient.toml')}", timeout_s=240) as done:
        radio.moving()
        radio.rig.fault(radio="vanish")
        radio.at_rest()
    assert done[0].code == 4, done[0].err + done[0].out
    assert not radio.reached()


def test_a_brick_that_is_not_there_is_reported(own_bench):
    """In a guest of its own: krfcommd of Linux 6.1.192 breaks after a connection that fails."""
    radio = with_bluetooth(own_bench)
    radio.rig.fault(radio="vanish")
    done = radio.run(f"nxtdrive info --nxt {BT}")
    assert done.code == 3
    assert "does not answer" in done.err
