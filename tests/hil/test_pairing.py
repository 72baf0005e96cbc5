"""A brick that accepts only paired computers, and BlueZ's own daemon and command, as docs/connecting.md says."""

import pytest

BRICK = "00:16:53:01:02:03"
BT = f"bt://{BRICK}"

DAEMONS = (
    "mkdir -p /run/dbus && dbus-daemon --system --fork && "
    "(/usr/sbin/bluetoothd -n > bluetoothd.log 2>&1 < /dev/null &) && "
    "until timeout -s KILL 5 bluetoothctl list < /dev/null | grep -q 00:11; do sleep 0.2; done"
)


def pair(pin):
    """The shell command that pairs in bluetoothctl; each answer waits for the question."""
    return f"""mkfifo keys; timeout -s KILL 60 bluetoothctl < keys > screen.txt 2>&1 & exec 3> keys
heard() {{ for _ in {{1..200}}; do grep -q "$1" screen.txt && return; sleep 0.1; done; cat screen.txt; exit 1; }}
heard 'Agent registered'; echo 'scan on' >&3
heard 'Device {BRICK}'; echo 'pair {BRICK}' >&3
heard 'Enter PIN'; echo {pin} >&3
heard 'Pairing successful\\|Failed to pair'; echo quit >&3; exec 3>&-; wait; rm keys; cat screen.txt"""


@pytest.fixture
def demanding(own_bench):
    """A guest with BlueZ's daemon; the brick asks for its PIN."""
    if not own_bench.rig.bluetooth:
        pytest.skip("no bumble: pip install nxtdrive[hil]")
    if own_bench.run("test -x /usr/sbin/bluetoothd && which dbus-daemon bluetoothctl").code:
        pytest.skip("no bluetoothd: apt-get install bluez dbus")
    own_bench.rig.fault(pin="1234")
    assert own_bench.run(DAEMONS, timeout_s=40).code == 0
    return own_bench


def test_after_pairing_the_brick_is_listed_and_connects(demanding):
    wrong = demanding.run(pair("0000"), timeout_s=60)
    assert "Failed to pair" in wrong.out
    right = demanding.run(pair("1234"), timeout_s=60)
    assert "Pairing successful" in right.out
    done = demanding.run(f"nxtdrive list && nxtdrive info --nxt {BT}")
    assert done.code == 0, done.err
    assert "paired LEGO brick NXT" in done.out
