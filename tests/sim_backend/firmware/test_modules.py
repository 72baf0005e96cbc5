"""Rules of modules and of the Comm map. The replies are those of LEGO's firmware."""

from functools import partial

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import COMM
from firmware_protocol.status import Status
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES

NO_MODULE = bytes(4).hex()
ALL = "0190" + b"*.*".ljust(20, b"\0").hex()
CALL, TO_TEXT, FOREVER = 0x28, 0x1F, [0x4025, 0]


@pytest.fixture(params=FIRMWARES)
def bench(request):
    return Bench(SimBrick(firmware=request.param))


def read(offset, size):
    return system.IOMapRead(COMM.module_id, offset, size).encode().hex()


def names(bench, *telegrams):
    """The names of the modules that replies contain, empty for an error."""
    replies = [bytes.fromhex(bench.telegram(telegram)) for telegram in telegrams]
    return [reply[4:24].rstrip(b"\0").decode() for reply in replies]


def test_a_listing_of_all_modules_is_open_at_power_on(bench):
    assert names(bench, "0191", "0191", "0191") == ["Comm.mod", "Input.mod", "Button.mod"]
    assert bench.telegram("0192") == "02920000"
    assert names(bench, "0191") == ["Display.mod"]


def test_a_listing_that_finds_nothing_is_open(bench):
    assert bench.telegram("0190" + (b"y" * 20).hex())[4:6] == f"{Status.MODULE_NOT_FOUND:02x}"
    assert bench.telegram("0190" + b"*.*".ljust(20, b"\0").hex())[4:6] == f"{Status.NO_MORE_HANDLES:02x}"


@pytest.mark.parametrize(
    ("telegram", "status"),
    [
        ("0194" + NO_MODULE + "00000000", Status.OK),
        ("0194" + NO_MODULE + "00000100", Status.OUT_OF_BOUNDARY),
        ("0194" + NO_MODULE + "01000000", Status.OUT_OF_BOUNDARY),
        ("0195" + NO_MODULE + "00000000", Status.OK),
        ("0195" + NO_MODULE + "0000010055", Status.OUT_OF_BOUNDARY),
        ("019401000d0000000000", Status.MODULE_NOT_FOUND),
    ],
)
def test_module_0_has_an_empty_map(bench, telegram, status):
    assert bench.telegram(telegram)[4:6] == f"{status:02x}"


@pytest.mark.parametrize("command", [direct.StartProgram, partial(direct.PlaySoundFile, False)])
def test_the_empty_module_has_the_size_of_the_file_that_a_start_found_as_its_id(bench, command):
    def found(*numbers):
        replies = [bench.telegram(system.IOMapRead(number, 0, 0).encode().hex()) for number in numbers]
        return [reply[4:6] == f"{Status.OK:02x}" for reply in replies]

    store(bench.brick, "a.txt", bytes(100))
    bench.telegram(command("a.txt").encode().hex())
    assert found(0, 100) == [False, True]
    bench.telegram(command("b.txt").encode().hex())
    assert found(0, 100) == [True, False]


def test_the_map_shows_the_receive_buffer(bench):
    bench.telegram("0190" + bytes(range(1, 59)).hex())
    request = read(COMM.field("UsbInBuf").offset, 20)
    assert bench.telegram(request)[18:] == request + "090a0b0c0d0e0f101112"


@pytest.mark.parametrize(
    ("start", "data"),
    [
        (0, "020b00" "01000500" "d906" "020b00" "01000500" "d906" "020b"),
        (7, "e006" * 10),
    ],
)  # fmt: skip
def test_the_send_buffer_is_copied_into_itself(bench, start, data):
    bench.telegram("000b")
    assert bench.telegram(read(COMM.field("UsbOutBuf").offset + start, 20))[18:] == data


def test_the_map_at_power_on(bench):
    assert [bench.telegram(read(at, 1))[18:] for at in (981, 1028, 1075, 1122, 1142, 1151)] == [
        *("00", "ff", "ff", "ff", "01", "03")
    ]


@pytest.mark.parametrize(("status", "known"), [(0, False), (1, False), (2, True), (0x42, True), (0x80, False)])
def test_a_contact_is_known_by_a_bit_of_its_status(status, known):
    bench = Bench(SimBrick())
    entry = bytes(range(0x41, 0x51)) + b"\1\2\3\4" + bytes(7) + bytes([status])
    offset = COMM.field("DeviceName", 3).offset
    bench.telegram(system.IOMapWrite(COMM.module_id, offset, len(entry), entry).encode().hex())
    assert bench.telegram(direct.GetBluetoothContactName(3).encode().hex())[6:] == "00" + (
        entry[:17].hex() if known else bytes(17).hex()
    )


def test_a_connection_s_name_is_what_the_map_has():
    bench = Bench(SimBrick())
    offset = COMM.field("ConnectionName", 1).offset
    bench.telegram(system.IOMapWrite(COMM.module_id, offset, 6, b"Robot\0").encode().hex())
    assert bench.telegram("001e01") == "021e0000" + b"Robot".ljust(17, b"\0").hex()
    assert bench.telegram("001e02") == "021e0000" + bytes(17).hex()


@pytest.mark.parametrize(
    ("start", "lines"),
    [
        (0, [("0200000b", 1), ("0200000b0200000b02", 2), ("00000b", 1)]),
        (57, [("0200000b0200000b", 2)]),  # without a rest, passes go on until all is taken
        (63, [("0200000b02", 0), ("00000b", 2)]),  # the ring buffer ends after byte 66
        (59, [("0200000b0200000b02", 1), ("00000b", 2)]),
    ],
)
def test_a_telegram_across_the_end_of_the_ring_buffer_takes_one_pass_more(bench, start, lines):
    battery = "0500020b004a1e"
    bench.control("!btmode 1")
    while start:
        size = start if start <= 20 else min(20, start - 3)
        assert bench.control(f"!bt {size - 2:02x}00" + "05" * (size - 2)) == ""
        start -= size
    for line, replies in lines:
        assert bench.control(f"!bt {line}") == battery * replies


def test_a_program_looks_a_module_up_in_the_same_listing_and_closes_it(bench):
    variables = Variables()
    reads, (status, *_) = variables.call(0, b"Output.mod\0", 0, 2, b"")
    tells, (_, _, told) = variables.call(0, 10, b"\0")
    look_up = [instruction(CALL, 32, reads), instruction(TO_TEXT, told, status), instruction(CALL, 26, tells)]
    store(bench.brick, "a.rxe", assemble(variables, [*look_up, FOREVER]))
    assert names(bench, ALL, "0191") == ["Comm.mod", "Input.mod"]
    bench.telegram(direct.StartProgram("a.rxe").encode().hex())
    bench.control("!tick 20")
    told = bench.telegram(direct.MessageRead(10, 0, remove=True).encode().hex())
    assert bytes.fromhex(told)[5:].rstrip(b"\0") == b"%d" % Status.NO_MORE_HANDLES
    assert names(bench, "0191", ALL) == ["Button.mod", "Comm.mod"]


def test_the_listing_of_a_program_goes_on_for_telegrams(bench):
    variables = Variables()
    writes, _ = variables.call(0, b"Sound.mod\0", 29, b"\1")
    store(bench.brick, "a.rxe", assemble(variables, [instruction(CALL, 33, writes), FOREVER]))
    bench.telegram(direct.StartProgram("a.rxe").encode().hex())
    bench.control("!tick 20")
    assert bench.telegram("0191")[4:6] == f"{Status.MODULE_NOT_FOUND:02x}"
