"""A link that delivers one reply twice: no wrong data, whatever is read and wherever the second copy arrives."""

import contextlib
from collections import deque
from itertools import pairwise

import numpy as np
import pytest

from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import LinkTimeout, RemoteProtocolError
from firmware_protocol.iomap import DISPLAY
from firmware_protocol.system import IOMapWrite
from nxtdrive.brick import Brick
from nxtdrive.link.transfer import in_step, pieces
from nxtdrive.onboard.display import read_display
from nxtdrive.onboard.files import FileEntry, Files
from nxtdrive.tools.dev.faults.assembler import sample_program
from nxtdrive.transports.sim import SimTransport
from sim_backend.devices import AnalogInput
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

CONTENT = bytes(range(256)) + bytes(58) + bytes(range(86))
LISTED = [FileEntry("a.bin", 400), FileEntry("b.bin", 1), FileEntry("NVConfig.sys", 6)]
POSITIONS = range(24)
BEHIND = (0, 1, 2, 3)
"""How many replies come between a reply and its second copy; the second copy of 0 has arrived with the reply."""


class Stutter(SimTransport):
    """Delivers the reply of this number again, `behind` replies later; may not tell that one waits, or not at first,
    as over USB, where the driver looks for one only now and then."""

    def __init__(self, simulation, *, behind=0, tells=True):
        super().__init__(simulation)
        self.behind, self.tells = behind, tells
        self.doubled, self.lost = range(0), -1
        self.number = self.silent = 0
        self.copies = deque()

    def receive(self, timeout_s):
        if self.copies and self.copies[0][0] <= self.number:
            return self.copies.popleft()[1]
        reply = super().receive(timeout_s)
        if reply is not None and self.number == self.lost:
            self.number += 1
            return self.receive(timeout_s)
        if reply is not None:
            if self.number in self.doubled:
                self.copies.append((self.number + self.behind + 1 if self.behind else self.number, reply))
            self.number += 1
        return reply

    def waiting(self):
        arrived = super().waiting() or bool(self.copies and self.copies[0][0] <= self.number)
        self.silent -= 1
        return arrived and self.tells and self.silent < 0


@pytest.fixture
def stutter():
    """Makes bricks whose link stutters from the call of `start` on."""
    bricks = []

    def make(**options):
        transport = Stutter(Simulation("open"), **options)
        brick = Brick(transport, timeout_s=0.2)
        brick.files.write("a.bin", CONTENT)
        brick.files.write("b.bin", b"b")
        bricks.append(brick)

        def start(*numbers, lost=-1, silent=0):
            transport.doubled = [transport.number + number for number in numbers]
            transport.lost = transport.number + lost if lost >= 0 else -1
            transport.silent = silent
            return brick

        return start

    yield make
    for brick in bricks:
        brick.close()


@pytest.mark.parametrize("tells", [True, False])
@pytest.mark.parametrize("behind", BEHIND)
def test_what_is_read_is_right_whichever_reply_arrives_twice(stutter, behind, tells):
    start = stutter(behind=behind, tells=tells)
    for position in POSITIONS:
        assert start(position).files.read("a.bin") == CONTENT, position
        assert start(position).files.ls() == LISTED, position


@pytest.mark.parametrize("silent", [*range(10), 1000])
@pytest.mark.parametrize("behind", BEHIND)
def test_a_file_is_right_whose_last_piece_is_as_long_as_an_earlier_one(stutter, behind, silent):
    """Only the reply to the last read, left over, shows that the reply to an earlier one was taken for it."""
    content = CONTENT[: 58 + 57 + 58]
    start = stutter(behind=behind)
    brick = start()
    brick.files.write("c.bin", content)
    for position in range(8):
        start(position, silent=silent)
        assert brick.files.read("c.bin", lambda *_: brick.sleep(0.01)) == content, position


@pytest.mark.parametrize("tells", [True, False])
@pytest.mark.parametrize("behind", BEHIND)
def test_what_is_written_is_right_whichever_reply_arrives_twice(stutter, behind, tells):
    start = stutter(behind=behind, tells=tells)
    for position in POSITIONS:
        start(position).files.write("a.bin", CONTENT[::-1], replace=True)
        assert start().files.read("a.bin") == CONTENT[::-1], position


@pytest.mark.parametrize("lost", range(1, 12))
def test_one_reply_twice_and_another_one_lost_do_not_make_up_for_each_other(stutter, lost):
    start = stutter(tells=False)
    for twice in range(lost):
        for read, right in ((Files.ls, LISTED), (lambda files: files.read("a.bin"), CONTENT)):
            brick = start(twice, lost=lost)
            with contextlib.suppress(LinkTimeout):
                assert read(brick.files) == right, (twice, lost)
            brick.link.transport.simulation.unplug()  # closes the handle whose number was lost


@pytest.mark.parametrize("size", [1, 2, 54, 55, 56, 108, 109, 110, 163, 164, 165, 800, 1000])
@pytest.mark.parametrize("limit", [55, 58, 119, 122])
def test_neighbouring_pieces_differ_in_length(size, limit):
    found = list(pieces(size, limit))
    lengths = [length for _, length in found]
    assert [start for start, _ in found] == [sum(lengths[:i]) for i in range(len(lengths))]
    assert sum(lengths) == size
    assert all(0 < length <= limit for length in lengths)
    assert all(first != second for first, second in pairwise(lengths))


@pytest.mark.parametrize("tells", [True, False])
def test_existence_is_right_whichever_reply_arrives_twice(stutter, tells):
    start = stutter(tells=tells)
    for position in range(4):
        brick = start(position)
        assert [brick.files.exists(name) for name in ("x.bin", "a.bin", "y.bin", "b.bin")] == [False, True, False, True]


@pytest.mark.parametrize("tells", [True, False])
@pytest.mark.parametrize("behind", BEHIND)
def test_the_display_is_read_right_whichever_reply_arrives_twice(stutter, behind, tells):
    start = stutter(behind=behind, tells=tells)
    spot = DISPLAY.field("Normal")
    for offset in range(0, 800, 50):
        pixels = bytes(range(offset % 200, offset % 200 + 50))
        start().request(IOMapWrite.put(spot.module_id, spot.offset + offset, pixels))
    before = read_display(start().link)
    for position in range(20):
        assert np.array_equal(read_display(start(position).link), before), position


def test_a_link_that_delivers_every_reply_twice_is_an_error_and_not_wrong_data(stutter):
    brick = stutter(tells=False, behind=1)(*range(1000))
    with pytest.raises(RemoteProtocolError, match="belong to no request"):
        brick.files.read("a.bin")


@pytest.mark.parametrize("disturbed", [0, 1, 2])
def test_a_transfer_of_which_two_attempts_were_disturbed_succeeds(direct, mocker, disturbed):
    errors = [RemoteProtocolError("half a file", b"")] * disturbed
    with Brick(direct) as brick:
        assert in_step(brick.link, mocker.Mock(side_effect=[*errors, b"whole"])) == b"whole"


@pytest.mark.parametrize("behind", BEHIND)
def test_a_polled_value_is_at_most_that_of_the_request_before(stutter, behind):
    """Nothing tells the second copy from the reply to the same request; the next request is in step again."""
    brick = stutter(behind=behind)(5)
    brick.motor("A").run(360)
    counts = []
    for _ in range(30):
        brick.sleep(0.05)
        counts.append(brick.request(GetOutputState(OutputPort.A)).rotation_count)
    truth = brick.request(GetOutputState(OutputPort.A)).rotation_count
    assert counts == sorted(counts)
    assert truth - counts[-1] < 3
    repeated = [i for i in range(1, len(counts)) if counts[i] == counts[i - 1] and i > 5]
    assert len(repeated) <= 1


@pytest.mark.parametrize("way", ["stepped", "threaded"])
@pytest.mark.parametrize("position", range(0, 40, 3))
def test_a_motion_ends_where_it_should_although_a_reply_arrives_twice(lab, position):
    room = lab(faults=LinkFaults(duplicate_replies=range(position, position + 3)))
    room.brick.motor("A").run_angle(speed_deg_s=500, angle_deg=360)
    room.brick.sleep(0.3)
    assert abs(room.output("A").rotation - 360) < 10
    room.brick.files.write("x.bin", CONTENT)
    assert room.brick.files.read("x.bin") == CONTENT


@pytest.mark.parametrize("way", ["stepped", "threaded"])
def test_sensors_are_read_right_although_every_third_reply_arrives_twice(lab):
    room = lab("touch_port = 1\nultrasonic_port = 4", faults=LinkFaults(duplicate_replies=range(0, 1000, 3)))
    sonar, touch = room.brick.ultrasonic(4), room.brick.touch(1)
    distances = []
    for pressed in (0, 1) * 10:
        room.attach(1, AnalogInput(lambda pressed=pressed: 180 if pressed else 1023))
        room.brick.sleep(0.05)
        assert touch.pressed == pressed
        distances.append(sonar.distance_mm)
    assert len(set(distances)) <= 2


@pytest.mark.parametrize("way", ["stepped", "threaded"])
@pytest.mark.parametrize("position", range(12))
def test_programs_start_and_stop_although_a_reply_arrives_twice(lab, position):
    room = lab(faults=LinkFaults(duplicate_replies=range(13 + position, 15 + position)))
    room.brick.files.write("a.rxe", sample_program())
    room.brick.programs.start("a.rxe")
    assert room.simulation.brick.command.active
    assert room.brick.programs.stop()
    assert not room.simulation.brick.command.active
