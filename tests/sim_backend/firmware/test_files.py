"""The simulated brick's file system, beyond the recorded conversations."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol import direct, system
from firmware_protocol.iomap import SOUND, SoundState
from firmware_protocol.status import Status
from firmware_protocol.telegram import REPLY_HEADER
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.files.loader import HANDLES
from sim_backend.firmware.files.names import matcher
from sim_backend.firmware.files.sector_table import free_bytes, sectors_for
from sim_backend.firmware.sound import SoundFlag

PIECE = 58


def ask(brick, command):
    reply = brick.receive(command.encode())
    brick.tick()
    return Status(reply[REPLY_HEADER - 1]), type(command).decode_reply(reply)


def download(brick, name, content):
    status, opened = ask(brick, system.OpenWrite(name, len(content)))
    assert status == Status.OK
    for start in range(0, len(content), PIECE):
        ask(brick, system.Write(opened.handle, content[start : start + PIECE]))
    return ask(brick, system.Close(opened.handle))[0]


def upload(brick, name):
    status, opened = ask(brick, system.OpenRead(name))
    assert status == Status.OK
    content = b""
    while len(content) < opened.size:
        content += ask(brick, system.Read(opened.handle, min(PIECE, opened.size - len(content))))[1].data
    ask(brick, system.Close(opened.handle))
    return content


@pytest.mark.slow
@settings(deadline=None, max_examples=30)
@given(st.dictionaries(st.sampled_from(["a.txt", "b.rxe", "c.rso", "d"]), st.binary(min_size=1, max_size=900)))
def test_files_come_back_as_they_were_also_after_a_power_cycle(files):
    brick = SimBrick()
    for name, content in files.items():
        assert download(brick, name, content) == Status.OK
    for rebooted in (brick, SimBrick(flash=brick.loader.flash)):
        assert {name: upload(rebooted, name) for name in files} == files


@settings(deadline=None, max_examples=30)
@given(st.lists(st.integers(0, 30_000), max_size=12))
def test_memory_is_given_back(sizes):
    brick = SimBrick()
    before = brick.loader.flash.free
    names = [f"{number}.bin" for number, _ in enumerate(sizes)]
    made = [name for name, size in zip(names, sizes, strict=True) if brick.loader.create(name, size).status == 0]
    for handle in range(HANDLES):
        brick.loader.close(handle)
    for name in made:
        brick.loader.delete(name)
    assert brick.loader.flash.free == before


@pytest.mark.parametrize(
    ("size", "sectors"),
    [(1, 1), (220, 1), (221, 2), (474, 2), (475, 3), (728, 3), (8094, 32), (8095, 33), (28_414, 112), (28_415, 113)],
)
def test_each_sector_but_the_first_costs_two_bytes_of_the_header(size, sectors):
    assert sectors_for(size) == sectors


@pytest.mark.parametrize(
    ("sectors", "free"),
    [(0, 0), (1, 220), (2, 472), (3, 728), (112, 28_416), (113, 28_668), (368, 93_440), (477, 121_124)],
)
def test_free_flash_is_reported_as_for_one_file(sectors, free):
    assert free_bytes(sectors) == free


def test_unplugging_drops_what_was_incomplete():
    brick = SimBrick()
    _, opened = ask(brick, system.OpenWrite("half.txt", 100))
    ask(brick, system.Write(opened.handle, b"x" * 50))
    brick.unplug_usb()
    assert ask(brick, system.FindFirst("half.txt"))[0] == Status.FILE_NOT_FOUND


@pytest.mark.parametrize(
    ("pattern", "name", "matches"),
    [
        ("*.*", "anything", True),
        ("alpha.*", "Alpha.txt", True),
        ("al.*", "alpha.txt", False),
        ("*.txt", "x.txty", True),
        ("*.txtfoo", "a.txt", True),
        ("a*.txt", "alpha.txt", False),
        ("*", "a", False),
        ("a.*b", "a.b", False),
        ("a*.b", "a*.bc", True),
        ("ALPHA.TXT", "alpha.txt", True),
        ("", "", True),
    ],
)
def test_patterns(pattern, name, matches):
    assert matcher(pattern)(name) is matches


@pytest.mark.parametrize(("sizes", "deleted", "used"), [
    ([474, 1], 1, 3), ([474, 474, 474, 1], 3, 9), ([474, 474, 474], 0, 6), ([1, 474, 1], 0, 4), ([728, 1], 1, 3),
])  # fmt: skip
def test_a_sector_that_a_rounded_header_takes_is_counted_from_a_deletion_on(sizes, deleted, used):
    brick = SimBrick()
    fresh = next(count for count in range(600) if free_bytes(count) == brick.loader.free_flash)
    for number, size in enumerate(sizes):
        download(brick, f"{number}.bin", bytes(size))
    assert fresh - sum(map(sectors_for, sizes)) == next(
        n for n in range(600) if free_bytes(n) == brick.loader.free_flash
    )
    ask(brick, system.Delete(f"{deleted}.bin"))
    assert brick.loader.free_flash == free_bytes(fresh - used)


@pytest.mark.parametrize(
    ("opened", "last"), [(["81", "81"], "0000"), (["8b", "8b"], "8301"), (["81", "8b", "8b"], "8302")]
)
def test_data_files_that_are_written_count_twice(opened, last):
    bench = Bench(SimBrick())
    bench.control("!mkfiles 124")
    replies = [
        bench.telegram(f"01{opcode}{number:02x}{'00' * 19}01000000") for number, opcode in enumerate(opened, 0x61)
    ]
    assert replies[-1] == f"02{opened[-1]}{last.replace('0000', '0001')}"


@pytest.mark.parametrize("size", [28_414, 28_415, 60_000, 60_932, 60_933])
def test_a_file_whose_header_takes_several_sectors_comes_back(size):
    brick = SimBrick()
    content = bytes(number * 7 & 0xFF for number in range(size))
    for name in ("first.bin", "gap.bin", "last.bin"):
        download(brick, name, bytes(300))
    ask(brick, system.Delete("gap.bin"))
    download(brick, "big.bin", content)
    assert upload(brick, "big.bin") == content


def test_files_that_share_sectors_show_what_was_written_last():
    brick = SimBrick()
    _, first = ask(brick, system.OpenWrite("first.t", 300))
    _, aborted = ask(brick, system.OpenWrite("aborted.t", 1))
    ask(brick, system.Close(aborted.handle))  # the sectors of both are free now
    download(brick, "second.t", b"2" * 600)
    for size in (58, 58, 58, 58, 58, 10):
        ask(brick, system.Write(first.handle, b"1" * size))
    ask(brick, system.Close(first.handle))
    assert upload(brick, "first.t") == b"1" * 300
    assert ask(brick, system.OpenRead("second.t"))[0] == Status.FILE_NOT_FOUND


@pytest.mark.parametrize("content", [b"x" * 20, b"xxx"])
def test_a_stop_in_the_pass_of_a_file_without_sound_closes_its_handle_at_once(content):
    """So the next stop does not close whatever has its number by then."""
    brick = SimBrick()
    download(brick, "a.rso", content)
    download(brick, "a.txt", b"a")
    ask(brick, SOUND.field("SoundFilename").write("a.rso"))
    start_and_stop = bytes([SoundFlag.UPDATE, SoundState.STOP])
    ask(brick, system.IOMapWrite(SOUND.module_id, SOUND.field("Flags").offset, len(start_and_stop), start_and_stop))
    handle = ask(brick, system.OpenRead("a.txt"))[1].handle
    ask(brick, direct.StopSoundPlayback())
    assert ask(brick, system.Read(handle, 1))[0] == Status.OK
