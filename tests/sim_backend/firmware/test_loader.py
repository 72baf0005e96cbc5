"""Rules of the loader module: handles, look-ups, deletion, free flash. The replies are those of LEGO's firmware."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.status import Status
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

LONG = b"y" * 20
"""A name that is too long; the driver refuses to encode it."""


def ask(brick, command):
    """Send a command, or the bytes of a telegram; returns status and payload."""
    reply = brick.receive(command if isinstance(command, bytes) else command.encode())
    brick.tick()
    return reply[2], reply[3:]


def status_of(brick, command):
    return Status(ask(brick, command)[0])


def store(brick, *names, content=b"x"):
    for name in names:
        _, rest = ask(brick, system.OpenWrite(name, len(content)))
        ask(brick, system.Write(rest[0], content))
        assert status_of(brick, system.Close(rest[0])) == Status.OK


def handle_of(brick, command):
    status, rest = ask(brick, command)
    assert status == Status.OK
    return rest[0]


def next_name(brick, handle):
    status, rest = ask(brick, system.FindNext(handle))
    return "" if status else rest[1:21].rstrip(b"\0").decode()


def free_flash(brick):
    return system.DeviceInfo.unpack(brick.receive(system.GetDeviceInfo().encode())).free_flash


@pytest.fixture(params=FIRMWARES)
def brick(request):
    return SimBrick(firmware=request.param)


def test_a_listing_skips_nothing_when_files_appear_or_disappear(brick):
    store(brick, "a", "b", "c", "d")
    handle = handle_of(brick, system.FindFirst("*.*"))
    assert next_name(brick, handle) == "c"
    store(brick, "e")
    assert status_of(brick, system.Delete("d")) == Status.OK
    assert [next_name(brick, handle) for _ in range(4)] == ["b", "a", "NVConfig.sys", ""]


@pytest.mark.parametrize(("firmware", "following"), [("1.29", "a"), ("1.05", "b")])
def test_a_listing_whose_last_file_is_deleted(firmware, following):
    brick = SimBrick(firmware=firmware)
    store(brick, "a", "b", "c", "d")
    handle = handle_of(brick, system.FindFirst("*.*"))
    assert next_name(brick, handle) == "c"
    assert status_of(brick, system.Delete("c")) == Status.OK
    assert next_name(brick, handle) == following


def test_a_closed_listing_goes_on_but_does_not_follow_changes(brick):
    store(brick, "q.1", "x.1")
    spare, handle = (handle_of(brick, system.FindFirst("*.*")) for _ in range(2))
    assert next_name(brick, handle) == "q.1"
    for each in (spare, handle):
        ask(brick, system.Close(each))
    store(brick, "q.2", "q.3")
    assert next_name(brick, handle) == "x.1"


def test_every_look_up_can_be_continued(brick):
    store(brick, "a.x", "b.x")
    handle = handle_of(brick, system.OpenRead("*.*"))
    assert next_name(brick, handle) == "a.x"
    assert next_name(brick, handle) == "NVConfig.sys"
    assert status_of(brick, system.OpenRead("none")) == Status.FILE_NOT_FOUND
    assert next_name(brick, handle + 1) == ""


@pytest.mark.parametrize("opcode", [0x80, 0x86, 0x8C])
@pytest.mark.parametrize(("name", "status"), [(b"none", Status.FILE_NOT_FOUND), (LONG, Status.ILLEGAL_FILE_NAME)])
def test_a_refusal_names_the_handle_of_the_look_up(brick, opcode, name, status):
    handle_of(brick, system.FindFirst("*.*"))
    got, rest = ask(brick, bytes([1, opcode]) + name.ljust(20, b"\0"))
    assert (got, rest[0]) == (status, 1)


@pytest.mark.parametrize("opcode", [0x80, 0x81, 0x85, 0x86, 0x8C])
def test_a_missing_handle_is_reported_before_an_illegal_name(brick, opcode):
    for _ in range(16):
        handle_of(brick, system.FindFirst("*.*"))
    assert ask(brick, bytes([1, opcode]) + LONG + bytes(4))[0] == Status.NO_MORE_HANDLES


@pytest.mark.parametrize(("firmware", "status"), [("1.29", Status.FILE_IS_BUSY), ("1.05", Status.OK)])
def test_firmware_1_29_takes_a_file_for_one_that_is_being_downloaded(firmware, status):
    brick = SimBrick(firmware=firmware)
    ask(brick, system.OpenWrite("download", 5))
    store(brick, "a", "b")
    assert status_of(brick, system.Delete("b")) == Status.OK
    assert status_of(brick, system.Delete("a")) == status


@pytest.mark.parametrize(("firmware", "status"), [("1.29", Status.FILE_IS_BUSY), ("1.05", Status.OK)])
def test_a_data_file_that_is_open_for_writing_can_be_deleted_in_firmware_1_05(firmware, status):
    brick = SimBrick(firmware=firmware)
    ask(brick, system.OpenWriteData("log.txt", 50))
    assert status_of(brick, system.Delete("log.txt")) == status


def test_open_files_are_compared_by_name_not_by_pattern(brick):
    ask(brick, system.OpenWrite("b.txt", 9))
    assert status_of(brick, system.OpenWrite("B.TXT", 9)) == Status.FILE_EXISTS
    assert status_of(brick, system.OpenWrite("b.*", 9)) == Status.OK
    ask(brick, system.OpenWriteData("log", 9))
    assert status_of(brick, system.OpenAppendData("LOG")) == Status.FILE_IS_BUSY
    assert status_of(brick, system.OpenAppendData("*.*")) == Status.OK


def test_after_too_much_data_even_an_empty_write_fails(brick):
    ask(brick, system.OpenWriteData("log", 9))
    assert status_of(brick, system.Write(0, bytes(10))) == Status.END_OF_FILE_EXPECTED
    assert status_of(brick, system.Write(0, b"")) == Status.END_OF_FILE_EXPECTED


@pytest.mark.parametrize(
    ("command", "refreshes"),
    [
        (system.Delete("none"), True),
        (bytes([1, 0x85]) + LONG, True),
        (system.OpenWrite("big", 200_000), False),
        (system.OpenRead("none"), False),
        (system.OpenWriteData("new", 1), True),
    ],
)
def test_what_refreshes_the_free_flash(brick, command, refreshes):
    before = free_flash(brick)
    ask(brick, system.OpenWrite("abandoned", 60_000))
    ask(brick, system.Close(0))
    assert free_flash(brick) < before - 60_000
    ask(brick, command)
    assert (free_flash(brick) > before - 1000) is refreshes


def test_a_crop_refreshes_the_free_flash_even_without_a_file():
    brick = SimBrick()
    before = free_flash(brick)
    ask(brick, system.OpenWrite("abandoned", 60_000))
    ask(brick, system.Close(0))
    assert status_of(brick, system.CropDataFile(9)) == Status.HANDLE_ALREADY_CLOSED
    assert free_flash(brick) == before


@pytest.mark.parametrize("command", [direct.StartProgram("a"), direct.PlaySoundFile(False, "a")])
def test_a_file_found_by_a_direct_command_costs_handle_0(brick, command):
    brick.receive(direct.StopSoundPlayback().encode())
    brick.tick(2)
    store(brick, "a", content=bytes(20))
    assert [handle_of(brick, system.OpenRead("a")) for _ in range(3)] == [0, 1, 2]
    assert status_of(brick, command) == Status.OK
    brick.tick(2)
    assert [handle_of(brick, system.OpenRead("a")) for _ in range(2)] == [0, 4]


def test_the_first_sound_after_power_on_closes_handle_0(brick):
    store(brick, "a")
    assert handle_of(brick, system.OpenRead("a")) == 0
    ask(brick, direct.StopSoundPlayback())
    assert [handle_of(brick, system.OpenRead("a")) for _ in range(2)] == [0, 1]
    ask(brick, direct.StopSoundPlayback())
    assert handle_of(brick, system.OpenRead("a")) == 2


def test_the_settings_are_created_again_at_power_on(brick):
    ask(brick, system.DeleteUserFlash())
    store(brick, "a")
    brick = brick.power_cycle()
    status, rest = ask(brick, system.OpenRead("NVConfig.sys"))
    assert status == Status.OK
    expected = bytes.fromhex({"1.05": "cb"}.get(brick.firmware, "780104030000"))
    assert ask(brick, system.Read(rest[0], len(expected)))[1][3:] == expected
    handle = handle_of(brick, system.FindFirst("*.*"))
    assert next_name(brick, handle) == "a"


def test_a_refused_read_leaves_the_last_reply_in_the_buffer(brick):
    bench = Bench(brick)
    store(brick, "a", content=b"0123456789")
    assert handle_of(brick, system.OpenRead("a")) == 0
    assert bench.telegram("0182000a00") == "028200000a00" + b"0123456789".hex()
    assert bench.telegram("0182070c00") == "028293070c00" + b"0123456789".hex() + "0000"


def test_a_system_command_without_reply_still_fills_the_buffer(brick):
    bench = Bench(brick)
    bench.telegram("000b")
    assert bench.telegram("818400") == ""
    assert bench.telegram("01c00000") == "02c088001e00"


def test_a_file_that_was_written_over_shows_the_one_written_last(brick):
    for name in ("first", "second"):
        ask(brick, system.OpenWrite(name, 3))
    ask(brick, system.Close(1))  # incomplete: the sectors of all downloads are free again
    store(brick, "third", content=b"12345")
    ask(brick, system.Write(0, b"abc"))
    assert status_of(brick, system.Close(0)) == Status.OK
    assert handle_of(brick, system.OpenRead("first")) == 0
    assert status_of(brick, system.OpenRead("third")) == Status.FILE_NOT_FOUND
    handle = handle_of(brick, system.FindFirst("*.*"))
    assert [next_name(brick, handle) for _ in range(2)] == ["first", "NVConfig.sys"]


@pytest.mark.parametrize(("size", "gained"), [(120_867, 256), (120_869, 0)])
def test_a_deletion_counts_the_sectors_of_each_file_anew(size, gained):
    brick = SimBrick(firmware="1.05")
    store(brick, "old")
    ask(brick, system.OpenWriteData("big", size))
    before = free_flash(brick)
    assert status_of(brick, system.Delete("old")) == Status.OK
    assert abs(free_flash(brick) - before - gained) <= 4
