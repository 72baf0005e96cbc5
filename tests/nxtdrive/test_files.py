"""The file system; requests that trigger firmware bugs never reach the brick."""

import itertools
import threading

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware_protocol.direct import PlaySoundFile, PlayTone, StartProgram, StopSoundPlayback
from firmware_protocol.errors import (
    BrickBusy,
    BrickError,
    LinkLost,
    LinkTimeout,
    LocalProtocolError,
    RemoteProtocolError,
)
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, FrameReader, frame
from firmware_protocol.status import Status
from firmware_protocol.system import Close, Delete, FindFirst, OpenRead, OpenWrite, OpenWriteData, Read, Write
from nxtdrive.brick import Brick
from nxtdrive.onboard.files import FileEntry, _free_sectors, _sectors
from nxtdrive.transports.sim import SimTransport
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.files.file_handle import Use
from sim_backend.firmware.files.sector_table import free_bytes
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation
from tests.nxtdrive.conftest import DirectTransport

SETTINGS_FILE = "NVConfig.sys"
HANDLES = 16


@pytest.fixture
def files(lab):
    """The files of a fresh brick."""
    return lab().brick.files


class Watched(SimTransport):
    """Notes what is sent."""

    def __init__(self, *args, **options):
        super().__init__(*args, **options)
        self.sent = []

    def send(self, telegram):
        self.sent.append(telegram)
        super().send(telegram)

    def requests(self, command):
        """What was sent of a command."""
        head = bytes((command.kind, command.opcode))
        return [command.decode(telegram) for telegram in self.sent if telegram[:2] == head]


@pytest.fixture
def watched():
    """A brick, and the transport to it that notes what is sent."""
    transport = Watched(Simulation("open"))
    with Brick(transport) as brick:
        yield brick, transport


class Damaging(SimTransport):
    """Changes the replies to one command."""

    _opcode, _damages = None, iter(())

    def damage(self, command, damages):
        """Change the next replies to that command, one by each of these functions."""
        self._opcode, self._damages = command.opcode, iter(damages)

    def receive(self, timeout_s):
        reply = super().receive(timeout_s)
        if reply is not None and reply[1] == self._opcode:
            reply = next(self._damages, lambda whole: whole)(reply)
        return reply


@pytest.fixture
def damaged():
    """The files of a brick with one of 200 bytes, and the transport to it that changes replies."""
    transport = Damaging(Simulation("open"))
    with Brick(transport) as brick:
        brick.files.write("data.bin", bytes(range(200)))
        yield brick.files, transport


def shorter_piece(reply):
    """A Read reply of which the last byte was lost."""
    return reply[:-1]


def other_name(reply):
    """A FindFirst reply of another file."""
    return reply.replace(b"data.bin", b"date.bin")


def of_size(size):
    """Makes a FindFirst or OpenRead reply one of a file of that size."""
    return lambda reply: reply[:-4] + size.to_bytes(4, "little")


@pytest.mark.parametrize(
    ("command", "damage", "work"),
    [
        (Read, shorter_piece, lambda files: files.read("data.bin")),
        (FindFirst, other_name, lambda files: files.exists("data.bin")),
        (FindFirst, of_size(199), lambda files: files.read("data.bin")),
        (FindFirst, of_size(199), lambda files: files.write("data.bin", bytes(50), replace=True)),
    ],
)
def test_what_does_not_belong_together_is_an_error_and_not_data(damaged, command, damage, work):
    files, transport = damaged
    transport.damage(command, itertools.repeat(damage))
    with pytest.raises(RemoteProtocolError):
        work(files)


def test_a_refusal_other_than_that_there_is_no_file_is_not_an_empty_list(watched):
    brick, _ = watched
    brick.files.write("data.bin", b"x")
    for _ in range(HANDLES):
        brick.request(OpenRead("data.bin"))
    for work in (brick.files.ls, lambda: brick.files.exists("data.bin")):
        with pytest.raises(BrickError) as caught:
            work()
        assert caught.value.status is Status.NO_MORE_HANDLES


def test_a_file_for_which_there_is_no_room_is_not_taken_for_one_that_is_being_written(files):
    with pytest.raises(BrickError) as caught:
        files.write("big.bin", bytes(files.free_bytes + 1))
    assert caught.value.status is Status.NO_SPACE


class Radio(DirectTransport):
    """A radio link to a fresh brick."""

    max_telegram = BLUETOOTH_TELEGRAM_LIMIT

    def __init__(self):
        super().__init__()
        self._stream = FrameReader()

    def send(self, telegram):
        self.sent.append(telegram)
        self._stream.feed(self.brick.receive_bluetooth(frame(telegram)))
        self.brick.tick()

    def receive(self, timeout_s):
        return self._stream.next()

    def waiting(self):
        return self._stream.incomplete > 0


@given(st.binary(min_size=1, max_size=2000))
@settings(max_examples=20, deadline=None)
def test_what_was_written_is_read_back(content):
    with Brick(SimTransport(Simulation("open"))) as brick:
        brick.files.write("data.bin", content)
        assert brick.files.read("data.bin") == content
        assert brick.files.ls("DATA.*") == [FileEntry("data.bin", len(content))]


def test_patterns_are_those_of_a_shell(files):
    for name in ("alpha.txt", "alp.txt", "beta.rxe", "none"):
        files.write(name, b"x")

    def names(pattern):
        return [entry.name for entry in files.ls(pattern)]

    assert names("*") == ["alp.txt", "alpha.txt", "beta.rxe", "none", SETTINGS_FILE]
    assert names("al*") == ["alp.txt", "alpha.txt"]
    assert names("*.rxe") == ["beta.rxe"]
    assert names("NON?") == ["none"]
    assert names("x*") == []


def test_progress_is_reported_piece_by_piece(files):
    received = []
    files.write("data.bin", bytes(150), lambda done, total: received.append((done, total)))
    assert received == [(61, 150), (122, 150), (150, 150)]
    received.clear()
    files.read("data.bin", lambda done, total: received.append((done, total)))
    assert received == [(58, 150), (115, 150), (150, 150)]


def test_a_file_is_replaced_only_if_that_is_wished(files):
    files.write("data.bin", b"old")
    with pytest.raises(BrickError) as caught:
        files.write("data.bin", b"new")
    assert caught.value.status is Status.FILE_EXISTS
    assert files.read("data.bin") == b"old"
    files.write("data.bin", b"new", replace=True)
    files.write("other.bin", b"new", replace=True)
    assert files.read("data.bin") == b"new"


@given(sectors=st.integers(1, 700))
def test_free_sectors_are_counted_as_by_the_brick(sectors):
    assert _free_sectors(free_bytes(sectors)) == sectors


@given(size=st.integers(1, 120_000))
@example(size=473)  # the rounded header takes a sector more
def test_sectors_are_counted_as_by_the_brick(size):
    brick = SimBrick()
    before = brick.loader.flash.free
    status, handle, _ = brick.loader.create("data.bin", size)
    assert status == Status.OK
    brick.loader.write(handle, bytes(size))
    brick.loader.close(handle)
    brick.loader.flash.count()
    assert _free_sectors(before) - _free_sectors(brick.loader.flash.free) == _sectors(size)


def test_a_file_is_not_lost_to_one_for_which_there_is_no_room(files):
    files.write("other.bin", bytes(1000))
    files.write("data.bin", bytes(300))
    files.write("last.bin", bytes(files.free_bytes))
    for size in (475, 10_000):  # one sector more, and many
        with pytest.raises(BrickError) as caught:
            files.write("data.bin", bytes(size), replace=True)
        assert caught.value.status is Status.NO_SPACE
        assert files.read("data.bin") == bytes(300)
    files.write("data.bin", bytes(474 - 2), replace=True)
    assert files.free_bytes == 0


def test_what_an_aborted_download_took_is_room_for_a_replacement(watched):
    brick, _ = watched
    brick.files.write("data.bin", b"old")
    size = brick.files.free_bytes
    aborted = brick.request(OpenWrite("aborted.bin", size))
    brick.request(Close(aborted.handle))
    brick.files.write("data.bin", bytes(size), replace=True)
    assert brick.files.read("data.bin") == bytes(size)


def test_deleting_makes_room(files):
    files.write("data.bin", bytes(5000))
    before = files.free_bytes
    files.delete("data.bin")
    assert files.free_bytes > before + 5000
    with pytest.raises(BrickError, match="file not found"):
        files.delete("data.bin")


@pytest.mark.parametrize("name", ["a", "a" * 15 + ".txt"])
def test_names_have_one_to_nineteen_characters(files, name):
    files.write(name, b"x")
    assert files.read(name) == b"x"


def test_a_file_that_is_not_there(files):
    assert not files.exists("data.bin")
    with pytest.raises(BrickError, match="file not found"):
        files.read("data.bin")


@pytest.mark.parametrize(
    "name", ["", "a" * 20, "a*.txt", "*.*", "wh?t", "tab\t.txt", "a/b", "ü.txt", "nul\0.txt", 5, None]
)
@pytest.mark.parametrize("operation", ["read", "delete", "exists", "write"])
def test_bad_names_never_leave_the_computer(direct, name, operation):
    with Brick(direct) as brick, pytest.raises(LocalProtocolError, match="name"):
        getattr(brick.files, operation)(name, *([b"x"] if operation == "write" else []))
    assert direct.sent == []


def test_an_empty_file_is_never_written(direct):
    with Brick(direct) as brick, pytest.raises(LocalProtocolError, match="empty"):
        brick.files.write("data.bin", b"")
    assert direct.sent == []


@pytest.mark.parametrize("pattern", [5, None, b"*.rxe"])
def test_a_pattern_is_text(direct, pattern):
    with Brick(direct) as brick, pytest.raises(LocalProtocolError, match="pattern"):
        brick.files.ls(pattern)
    assert direct.sent == []


@pytest.mark.parametrize("data", ["text", 5, None, [1, 2]])
def test_only_bytes_replace_a_file(watched, data):
    brick, transport = watched
    brick.files.write("data.bin", b"old")
    transport.sent.clear()
    with pytest.raises(LocalProtocolError, match="data must be bytes"):
        brick.files.write("data.bin", data, replace=True)
    assert transport.sent == []


def test_a_view_of_numbers_is_written_byte_by_byte(files):
    files.write("data.bin", memoryview(bytes(range(8))).cast("I"))
    assert files.read("data.bin") == bytes(range(8))


def test_an_empty_file_is_never_opened(watched):
    """Opening one closes handle 0, whosever it is."""
    brick, transport = watched
    handle = brick.request(OpenWrite("empty.txt", 0)).handle
    brick.request(Close(handle))
    assert brick.files.read("empty.txt") == b""
    assert transport.requests(OpenRead) == []


@pytest.mark.parametrize("size", [1, 57, 58, 59, 116, 117, 1000])
def test_over_usb_no_read_requests_more_than_58_bytes_nor_beyond_the_end(watched, size):
    brick, transport = watched
    brick.files.write("data.bin", bytes(size))
    brick.files.read("data.bin")
    asked = [read.size for read in transport.requests(Read)]
    assert max(asked) <= 58
    assert sum(asked) == size
    assert max(len(write.data) for write in transport.requests(Write)) <= 61


def test_over_bluetooth_pieces_fill_the_bricks_buffer_and_no_more():
    """Longer ones are streamed, and some lengths the firmware gets wrong."""
    radio, content = Radio(), bytes(range(256)) * 4
    with Brick(radio) as brick:
        brick.files.write("data.bin", content)
        assert brick.files.read("data.bin") == content
    written = [Write.decode(telegram) for telegram in radio.sent if telegram[:2] == b"\x01\x83"]
    asked = [Read.decode(telegram).size for telegram in radio.sent if telegram[:2] == b"\x01\x82"]
    assert max(len(write.data) for write in written) == 125
    assert max(asked) == 122
    assert sum(asked) == len(content), "never beyond the end"


@pytest.fixture
def falls_silent(lab):
    """Makes a brick that is silent for five seconds from its time 2 s on, and calls `work` with its files then."""

    def make(work):
        room = lab(faults=LinkFaults(silent_ms=((2000, 7000),)))
        brick = room.brick
        brick.files.write("known.txt", b"a" * 500)
        brick.sleep(1.99 - brick.now())
        with pytest.raises(LinkTimeout):
            work(brick.files)
        brick.sleep(8 - brick.now())
        return room

    return make


@pytest.mark.parametrize(
    "work",
    [
        lambda files: files.read("known.txt"),
        lambda files: files.write("new.txt", b"b" * 500),
    ],
)
def test_a_handle_that_a_silent_brick_could_not_be_asked_to_close_is_closed_when_it_answers_again(falls_silent, work):
    room = falls_silent(work)
    files = room.brick.files
    files.write("new.txt", b"c" * 500)
    assert files.read("new.txt") == b"c" * 500
    assert all(handle.use is Use.FREE for handle in room.simulation.brick.loader.handles)


def test_a_name_that_only_a_transfer_that_was_cut_off_has_is_not_reported_as_a_file(falls_silent):
    room = falls_silent(lambda files: files.write("new.txt", b"b" * 500))
    with Brick(SimTransport(room.simulation)) as again, pytest.raises(BrickBusy, match="is being written"):
        again.files.write("new.txt", b"c" * 500)


def test_every_handle_is_closed_whatever_happens(files):
    files.write("data.bin", bytes(200))

    def stumble(done, total):
        raise RuntimeError("stumbled")

    for _ in range(2 * HANDLES):
        files.ls()
        files.read("data.bin")
        with pytest.raises(RuntimeError):
            files.read("data.bin", stumble)
        with pytest.raises(RuntimeError):
            files.write("half.bin", bytes(200), stumble)
        with pytest.raises(BrickError):
            files.write("data.bin", b"x")
    assert not files.exists("half.bin")


def test_an_interrupt_is_not_replaced_by_a_damaged_reply_when_the_handle_is_closed(damaged):
    files, transport = damaged
    transport.damage(Close, [lambda reply: reply[:2]])

    def interrupt(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        files.read("data.bin", interrupt)


def test_nothing_is_deleted_while_a_download_is_open(watched):
    """Its sectors would be given to the next file."""
    brick, transport = watched
    brick.files.write("old.bin", b"x")

    def interfere(done, total):
        brick.files.delete("old.bin")

    with pytest.raises(LocalProtocolError, match="file operation"):
        brick.files.write("new.bin", bytes(200), interfere)
    assert transport.requests(Delete) == []


@pytest.mark.parametrize(
    ("interfere", "command"),
    [
        (lambda brick: brick.speaker.tone(440, 100), PlayTone),
        (lambda brick: brick.speaker.play("beep.rso"), PlaySoundFile),
        (lambda brick: brick.speaker.stop(), StopSoundPlayback),
        (lambda brick: brick.programs.start("demo.rxe"), StartProgram),
    ],
    ids=["tone", "sound file", "stop", "program"],
)
def test_nothing_that_closes_handle_0_is_sent_while_a_file_is_open(watched, interfere, command):
    """The first sound, a stop of it, and a started program or sound file close handle 0, whatever it belongs to."""
    brick, transport = watched
    brick.files.write("old.bin", bytes(200))
    with pytest.raises(LocalProtocolError, match="file operation"):
        brick.files.read("old.bin", lambda _done, _total: interfere(brick))
    assert transport.requests(command) == []


def test_a_tone_waits_for_a_file_that_another_thread_reads(watched):
    brick, transport = watched
    brick.files.write("old.bin", bytes(range(200)))
    sounds = threading.Thread(target=lambda: brick.speaker.tone(440, 100))

    def interfere(done, _total):
        if not sounds.ident:
            sounds.start()
        assert transport.requests(PlayTone) == []

    assert brick.files.read("old.bin", interfere) == bytes(range(200))
    sounds.join()
    assert len(transport.requests(PlayTone)) == 1


def test_nothing_is_ever_appended(watched):
    """Appending writes to the wrong page of flash at some sizes; whole files are written instead."""
    brick, transport = watched
    brick.files.write("log.txt", b"one", replace=True)
    brick.files.write("log.txt", brick.files.read("log.txt") + b"two", replace=True)
    assert brick.files.read("log.txt") == b"onetwo"
    assert transport.requests(OpenWriteData) == []


def test_a_link_lost_in_the_middle_is_reported_and_leaves_no_part_of_the_file(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((20, 1000),)))
    with pytest.raises(LinkLost):
        room.brick.files.write("data.bin", bytes(5000))
    room.simulation.advance(2000)
    room.brick.link.reconnect()
    assert not room.brick.files.exists("data.bin")
    room.brick.files.write("data.bin", bytes(5000))


@pytest.mark.parametrize("command", [OpenRead, FindFirst])
@pytest.mark.parametrize("size", [0, 1, 199, 201, 2**18 + 1, 2**32 - 1])
def test_a_size_that_arrives_wrong_once_is_asked_for_again(damaged, command, size):
    files, transport = damaged
    transport.damage(command, [of_size(size)])
    assert files.read("data.bin") == bytes(range(200))


@pytest.mark.parametrize("size", [201, 2**18 + 1, 2**32 - 1])
def test_a_size_that_the_list_of_files_does_not_have_is_refused(damaged, size):
    files, transport = damaged
    transport.damage(OpenRead, itertools.repeat(of_size(size)))
    with pytest.raises(RemoteProtocolError, match=f"200 bytes in the list of files and {size} when opened"):
        files.read("data.bin")
    transport.damage(OpenRead, [])
    assert files.read("data.bin") == bytes(range(200)), "every handle is closed"


def test_a_size_beyond_the_flash_is_refused_although_both_agree(watched):
    brick, _ = watched
    brick.files.write("data.bin", b"x")
    file = brick.link.transport._simulation.brick.loader.flash.files[0]
    file.resize(2**18 + 1, file.address)
    file.set_data_size(2**18 + 1)
    with pytest.raises(RemoteProtocolError, match="262145"):
        brick.files.read("data.bin")


def test_a_data_file_that_is_not_full_is_read(watched):
    brick, _ = watched
    handle = brick.request(OpenWriteData("log.txt", 500)).handle
    brick.request(Write(handle, b"some data"))
    brick.request(Close(handle))
    assert brick.files.read("log.txt") == b"some data"
