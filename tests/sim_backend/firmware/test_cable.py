"""What happens to handles when the USB cable is pulled; the handles are those that LEGO's firmware gave."""

import pytest

from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, store
from sim_backend.firmware.brick import SimBrick


def text(name):
    return name.encode().ljust(20, b"\0").hex()


def frame(request):
    return f"!bt {len(request) // 2:02x}00{request}"


OPEN, START, FIND = f"0180{text('p.rxe')}", f"0000{text('p.rxe')}", f"0186{text('*.*')}"
RUNS = [START, "!tick 20"]
RADIO_CLOSES = ["!btmode 1", frame("018400"), "!btmode 0"]

CONVERSATIONS = [
    ("the look-up of a second start stays open", [*RUNS, START], (0, 2)),
    ("a handle that a start took over is closed", [OPEN, OPEN, OPEN, START, START, START, "!tick 20"], (0, 1)),
    ("one that a telegram closed before is not", [OPEN, "018400", *RUNS], (1, 2)),
    ("a look-up that failed leaves no mark", [f"0186{text('none')}", *RUNS], (1, 2)),
    ("a search is closed, but not the program in its handle", [FIND, "018400", *RUNS], (1, 2)),
    ("one closed over Bluetooth counts as opened over USB", [OPEN, *RADIO_CLOSES, *RUNS], (0, 1)),
]  # fmt: skip


@pytest.mark.parametrize(("lines", "free"), [pytest.param(*rest, id=name) for name, *rest in CONVERSATIONS])
def test_unplugging_closes_what_was_opened_over_usb(lines, free):
    brick = SimBrick()
    store(brick, "p.rxe", assemble(Variables(), [[0x4025, 0]]))
    bench = Bench(brick)
    for line in [*lines, "!usb 0", "!usb 1"]:
        bench.answer(line)
    assert [bench.telegram(OPEN)[:8] for _ in free] == [f"028000{handle:02x}" for handle in free]


def test_an_attached_device_answers_even_if_the_last_one_did_not():
    bench = Bench(SimBrick())
    for line in ("!i2c 3 ack 0", "!i2c 3 attach 02"):
        bench.control(line)
    bench.telegram("0005030b00")
    bench.control("!tick 20")
    bench.telegram("000f0302010242")
    bench.control("!tick 30")
    assert bench.telegram("000e03") == "020e0001"
