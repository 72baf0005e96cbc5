"""Driving by hand for half a minute, in a terminal and through the page's WebSocket."""

import re

from tests.hil.conftest import ROOT

TELEOP = (
    "rm -f keys screen.txt; mkfifo keys; sleep 300 > keys 2>&1 & "
    "TERM=xterm-256color "
    "script -qfec 'stty rows 40 cols 120; nxtdrive teleop --nxt usb:// --camera 0' screen.txt < keys; "
    "code=$?; kill %1; exit $code"
)
WEB = "nxtdrive web --nxt usb:// --camera 0 --port 7080 > web.txt"
DRIVE = f"python3 {ROOT}/examples/web-client/drive.py"


def press(bench, key, seconds):
    """Hold a key down, as the terminal repeats it."""
    bench.run(f"for _ in $(seq {seconds * 10}); do printf '{key}'; sleep 0.1; done > keys")


def test_the_keys_drive_until_they_are_let_go(bench):
    with bench.during(TELEOP) as done:
        bench.rig.wait_for("grep -aq 'T target' screen.txt", "the screen of teleop", 120.0)
        start = bench.rig.truth()["pose"]
        press(bench, "w", 3)
        bench.at_rest()
        ahead = bench.rig.truth()["pose"]
        press(bench, "d", 20)
        bench.at_rest()
        press(bench, "s", 1)
        bench.at_rest()
        bench.run("printf '\\033' > keys")
    assert done[0].code == 0, done[0].out[-2000:]
    assert ahead[0] > start[0] + 100
    assert bench.rig.truth()["contacts"] == 0


def test_a_program_drives_through_the_page(bench):
    """The example that the documentation prints, several times: half a minute."""
    with bench.during(WEB, interrupt=True) as done:
        bench.rig.wait_for("grep -q 7080 web.txt", "the page", 120.0)
        start = bench.rig.truth()["pose"]
        for _ in range(3):
            client = bench.run(DRIVE)
            assert client.code == 0, client.err
            assert re.match(r"I am \w+", client.out)
            bench.at_rest()
    assert done[0].code in (0, 130), done[0].err
    assert bench.rig.truth()["pose"][0] > start[0] + 300
