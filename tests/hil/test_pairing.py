"""A brick that accepts only paired computers, and BlueZ's own daemon and command, as docs/connecting.md says."""

import pytest

from tests.hil.conftest import BRICK, BT

DAEMONS = (
    "mkdir -p /run/dbus && dbus-daemon --system --fork && "
    "(/usr/sbin/bluetoothd -n > bluetoothd.log 2>&1 < /dev/null &) && "
    "until timeout -s KILL 5 bluetoothctl list < /dev/null | grep -q 00:11; do sleep 0.2; done"
)


def pair(pin):
    """The shell command that pairs in bluetoothctl; each answer waits for the question."""
    return f"""mkfifo keys; timeout -s KILL 180 bluetoothctl < keys > screen.txt 2>&1 & exec 3> keys
wait_for() {{ for _ in {{1..600}}; do grep -q "$1" screen.txt && return; sleep 0.1; done; cat screen.txt; exit 1; }}
wait_for 'Agent registered'; echo 'scan on' >&3
wait_for 'Device {BRICK}'; echo 'pair {BRICK}' >&3
wait_for 'Enter PIN'; echo {pin} >&3
wait_for 'Pairing successful\\|Failed to pair'; echo quit >&3; exec 3>&-; wait; rm keys; cat screen.txt"""


@pytest.fixture
def demanding(radio):
    """A guest with BlueZ's daemon; the brick asks for its PIN."""
    if radio.run("test -x /usr/sbin/bluetoothd && which dbus-daemon bluetoothctl").code:
        pytest.skip("no bluetoothd: apt-get install bluez dbus")
    radio.rig.fault(pin="1234")
    assert radio.run(DAEMONS).code == 0
    yield radio
    radio.run("pkill bluetoothd; pkill dbus-daemon; rm -rf /var/lib/bluetooth/* /run/dbus keys")


@pytest.mark.loses_bluetooth
def test_after_pairing_the_brick_is_listed_and_connects(demanding):
    stranger = demanding.run(f"nxtdrive info --nxt {BT}")
    assert stranger.code == 3
    assert "does not let this computer in" in stranger.err
    wrong = demanding.run(pair("0000"))
    assert "Failed to pair" in wrong.out
    right = demanding.run(pair("1234"))
    assert "Pairing successful" in right.out
    done = demanding.run(f"nxtdrive list && nxtdrive info --nxt {BT}")
    assert done.code == 0, done.err
    assert "paired LEGO brick NXT" in done.out
