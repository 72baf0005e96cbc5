"""Driving through the page's WebSocket for half a minute."""

import re

from tests.hil.conftest import ROOT

WEB = "nxtdrive web --nxt usb:// --camera 0 --port 7080 > web.txt"
DRIVE = f"python3 {ROOT}/examples/web-client/drive.py"


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
