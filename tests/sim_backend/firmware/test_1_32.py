"""Different replies of the community's firmware 1.32: docs/firmware.md section 11."""

import re

import pytest

from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.rxe import Type


def answers(firmware: str, *lines: str) -> list[str]:
    """Replies to telegrams in hex and to control lines (docs/firmware.md section 0.1)."""
    bench = Bench(SimBrick(firmware=firmware))
    return [bench.answer(line) for line in lines]


@pytest.mark.parametrize(("firmware", "reply"), [("1.29", "0288007c011d01"), ("1.32", "0288007c012001")])
def test_it_reports_its_own_version(firmware, reply):
    assert answers(firmware, "0188") == [reply]


@pytest.mark.parametrize(("firmware", "free"), [("1.29", 120_868), ("1.32", 103_852)])
def test_it_has_less_flash_for_files(firmware, free):
    assert answers(firmware, "019b")[0][-8:] == free.to_bytes(4, "little").hex()


@pytest.mark.parametrize(
    ("name", "size"),
    [("Comm.mod", 1900), ("Input.mod", 420), ("Low Speed.mod", 172), ("Output.mod", 100), ("Ui.mod", 44)],
)
def test_its_maps_are_longer(name, size):
    (reply,) = answers("1.32", "0190" + name.encode().ljust(20, b"\0").hex())
    assert reply[-4:] == size.to_bytes(2, "little").hex()


def test_its_motors_have_speed_limits_and_a_common_period():
    assert answers("1.32", "0194010002001e000200", "01940100020060000100") == [
        "0294000100020002005014",
        "02940001000200010064",
    ]


def test_a_written_byte_beyond_the_map_of_1_29_is_kept():
    assert answers("1.32", "019501000c002800010007", "019401000c0028000100")[1] == "02940001000c00010007"


LOW_SPEED_9V = ("0005000b00", "!tick 50")


@pytest.mark.parametrize(("firmware", "tries"), [("1.29", ["00", "00", "00"]), ("1.32", ["02", "02", "02"])])
def test_a_message_without_acknowledge_is_sent_again(firmware, tries):
    log = answers(firmware, *LOW_SPEED_9V, "000f00020002ff", "!tick 30", "!i2c 0 log")[-1]
    assert log.startswith("S [02]n P " + "".join(f"S [{address}]n P " for address in tries))


@pytest.mark.parametrize(("firmware", "ready"), [("1.29", 0), ("1.32", 16)])
def test_sixteen_bytes_can_be_read_over_i2c_and_stay(firmware, ready):
    read = ["000e00", "001000", "001000"]
    replies = answers(firmware, *LOW_SPEED_9V, "!i2c 0 attach 02", "000f0001100200", "000e00", "!tick 80", *read)
    waiting = f"021000{ready:02x}"
    assert replies[4] == "020e2000"
    assert replies[-3] == f"020e00{ready:02x}"
    assert [reply[:8] for reply in replies[-2:]] == [waiting] * 2


@pytest.mark.parametrize(("port", "status"), [(4, "00"), (5, "e0"), (8, "00"), (255, "e0")])
def test_ls_write_takes_ports_modulo_four(port, status):
    assert answers("1.32", *LOW_SPEED_9V, f"000f{port:02x}020002ff")[-1] == "020f" + status
    assert answers("1.29", *LOW_SPEED_9V, f"000f{port:02x}020002ff")[-1] == "020fc0"


I2C_MAP = "019401000b009c000b00"
"""ChannelState, ErrorType, State and the two bytes of options."""


def at_once(message: str, *lines: str, size: int = 2, port: int = 8) -> list[str]:
    """Send an I2C message with options to a sensor of address 2; then the map, the log and what was received."""
    sensor = ["!i2c 0 attach 02", "!i2c 0 set 40 00010203"]
    write = f"000f{port:02x}{len(message) // 2:02x}{size:02x}{message}"
    return answers("1.32", *LOW_SPEED_9V, *sensor, *lines, write, I2C_MAP, "!i2c 0 log", "001000")[-3:]


@pytest.mark.parametrize("port", [8, 12])
def test_an_i2c_transfer_can_be_over_at_once(port):
    state, log, received = at_once("0242", port=port)
    assert state[18:] == "0000000000000000000100" if port == 8 else "0000000000000000000101"
    assert log.startswith("S [02]a 42 S [03]a r02 r03 N P  clocks=47")
    assert received == "0210000202030000000000000000000000000000"


@pytest.mark.parametrize(
    ("message", "line", "error", "log"),
    [
        ("0442", "!i2c 0 ack 1", "fd", "S [04]n P  clocks=10"),
        ("024255", "!i2c 0 wack 0", "fd", "S [02]a 42 P  clocks=19"),
        ("0242", "!i2c 0 detach", "fd", "S [02]n P  clocks=10"),
        ("", "!i2c 0 ack 1", "fc", "  clocks=0"),
    ],
)
def test_a_transfer_at_once_has_one_try(message, line, error, log):
    state, seen, received = at_once(message, line)
    assert state[18:] == f"04000000{error}000000010100"
    assert seen.startswith(log)
    assert received[4:6] == "dd"


def test_an_i2c_message_without_a_second_start_reads_nothing():
    sensor = ["!i2c 0 attach 02", "!i2c 0 set 40 00010203"]
    replies = answers("1.32", *LOW_SPEED_9V, *sensor, "000f0402020242", "!tick 20", "001000", "!i2c 0 log", I2C_MAP)
    assert replies[-3] == "02100002ffff" + bytes(14).hex()
    assert replies[-2].startswith("S [02]a 42 ff ff")
    assert replies[-1].endswith("0001")


def test_only_port_1_reads_without_a_second_start():
    lines = ["0005010b00", "!tick 50", "!i2c 1 attach 04", "000f0502020440", "!tick 20", "!i2c 1 log"]
    assert answers("1.32", *lines)[-1].startswith("S [04]a 40 P S [05]a r00 r00 N")


def test_a_plain_message_clears_the_options():
    assert answers("1.32", *LOW_SPEED_9V, "000f0c0202", "!tick 5", "000f00020002ff", I2C_MAP)[-1].endswith("0000")


@pytest.mark.parametrize(("port", "moved"), [(3, "AB"), (4, "AC"), (5, "BC"), (6, "ABC"), (7, ""), (255, "ABC")])
def test_set_output_state_has_numbers_for_groups_of_motors(port, moved):
    power = "".join(f"{50 if motor in moved else 0}/0/.* " for motor in "ABC").rstrip()
    request = f"0004{port:02x}320100002000000000"
    reply, _, motors = answers("1.32", request, "!tick 100", "!motors")
    assert reply == ("020400" if moved else "0204c0")
    assert re.fullmatch(power, motors)
    assert answers("1.29", request) == ["020400" if port == 255 else "0204c0"]


COLOR, DIGITAL, VALUES = "0005000d20", "0005000c20", "000700"


@pytest.mark.parametrize(("firmware", "scaled", "valid"), [("1.29", "0000", "00"), ("1.32", "0100", "01")])
def test_an_absent_colour_sensor_is_black_and_valid_after_400_passes(firmware, scaled, valid):
    first, _, waiting, settled = answers(firmware, COLOR, VALUES, "!tick 398", VALUES, VALUES)[1:]
    assert first == waiting == f"0207000000000d2000000000{scaled}0000"
    assert settled == f"02070000{valid}000d2000000000{scaled}0000"


@pytest.mark.parametrize(("firmware", "raw"), [("1.29", "0000"), ("1.32", "f401")])
def test_the_raw_value_of_a_digital_sensor_is_read(firmware, raw):
    values = answers(firmware, "!sensor 0 500", DIGITAL, "!tick 30", VALUES)[-1]
    assert values == f"0207000001000c20{raw}000000000000"


def program(content: bytes) -> list[str]:
    """Telegrams that store a program, start it and read ProgStatus."""
    name = b"p.rxe".ljust(20, b"\0").hex()
    size = len(content).to_bytes(4, "little").hex()
    parts = [f"018300{content[start : start + 58].hex()}" for start in range(0, len(content), 58)]
    stored = [f"0189{name}{size}", *parts, "018400"]
    return [*stored, "!tick 1", f"0000{name}", "!tick 9", "0194010001001c000100"]


HEADER = b"MindstormsNXT\0"


@pytest.mark.parametrize(
    ("content", "fault"),
    [
        (b"garbage", "fc"),
        (HEADER + b"\0\0", "fc"),
        (HEADER + b"\0\x05", "f9"),
        (HEADER + b"\0\x05" + bytes(18) + b"\xff\0\0\0", "f9"),
        (HEADER + b"\0\x05" + bytes(18) + b"\x01\0\0\0", "f8"),
        (HEADER + b"\0\x05" + bytes(18) + b"\x01\0\x01\0", "f7"),
    ],
)
def test_the_status_says_why_a_program_cannot_be_started(content, fault):
    assert answers("1.32", *program(content))[-1] == f"029400010001000100{fault}"
    assert answers("1.29", *program(content))[-1] == "02940001000100010003"


@pytest.mark.parametrize(("firmware", "power"), [("1.29", "60/0"), ("1.32", "88/0")])
def test_a_motor_catches_up_on_all_that_a_stall_cost_it(firmware, power):
    stalled, free = "!motor 0 590 60 12 150 5 1", "!motor 0 590 60 12 150 5 0"
    motors = answers(firmware, stalled, "0004003205010020000000000000", "!tick 2500", free, "!tick 2400", "!motors")[-1]
    assert motors.startswith(power)


@pytest.mark.parametrize(("firmware", "options"), [("1.29", "00"), ("1.32", "e0")])
def test_the_upper_bits_of_the_mode_are_options(firmware, options):
    assert answers(firmware, "00040132e10000200000000000", "019401000200" + "3d000100")[-1][-2:] == options


def test_a_low_voltage_keeps_an_absent_colour_sensor_invalid():
    rises = ["!sensor 0 51", "!tick 401", VALUES]
    values = answers("1.32", "!sensor 0 50", COLOR, "!tick 900", VALUES, *rises)
    assert [values[3][6:10], values[-1][6:10]] == ["0000", "0001"]


def state(number: int) -> str:
    return f"0022{number:02x}"


ASK_STATE = "0023"
ADD, JUMP, INSTRUCTION = 0x00, 0x4025, 4
STATUS = "0194010001001c000100"


def counting_program() -> list[str]:
    """Telegrams that store a program which counts without end, and start it."""
    variables = Variables()
    total, one = variables.number(0, Type.UBYTE), variables.number(1, Type.UBYTE)
    content = assemble(variables, [instruction(ADD, total, total, one), [JUMP, -INSTRUCTION & 0xFFFF]])
    name = b"p.rxe".ljust(20, b"\0").hex()
    pieces = [f"018300{content[i : i + 58].hex()}" for i in range(0, len(content), 58)]
    return [f"0189{name}{len(content).to_bytes(4, 'little').hex()}", *pieces, "018400", f"0000{name}", "!tick 9"]


def test_a_program_can_be_paused_and_stepped():
    replies = answers(
        "1.32", *counting_program(), ASK_STATE, state(3), ASK_STATE, state(2), ASK_STATE, state(2), ASK_STATE, STATUS
    )
    states = [reply[6:8] for reply in replies[-8:-1]]
    words = [int(reply[10:12], 16) for reply in replies[-7:-1]]
    assert states == ["01", "03", "03", "02", "03", "02", "03"]
    assert words[0] == words[1] == words[2] != words[3] == words[4] != words[5]
    assert replies[-1] == "02940001000100010002"


def test_a_paused_program_stops_when_it_goes_on():
    replies = answers("1.32", *counting_program(), state(3), "0001", STATUS, state(1), STATUS, ASK_STATE)
    assert [replies[-4][-2:], replies[-2][-2:], replies[-1]] == ["02", "04", "02230005ff0000"]


@pytest.mark.parametrize("number", [0, 5, 6, 255])
def test_a_program_in_another_state_stays_there(number):
    replies = answers("1.32", *counting_program(), state(number), state(1), "0001", ASK_STATE, STATUS)
    assert [replies[-2][6:8], replies[-1][-2:]] == [f"{number:02x}", "02"]


def test_state_4_stops_a_program_at_once():
    assert answers("1.32", *counting_program(), state(4), STATUS)[-1][-2:] == "04"


def test_without_a_program_there_is_no_state_to_set():
    assert answers("1.32", state(1), ASK_STATE) == ["02220000ff0000", "02230000ff0000"]


def test_a_telegram_stores_four_breakpoints():
    points = ["002400" + "01010100" + "02010200" + "03010300" + "00010400", "002400" + "02050600", "002500"]
    stored, over_stale_bytes, kept = answers("1.32", *counting_program(), *points)[-3:]
    assert stored == "022400" + "010400" + "010100" + "010200" + "010300"
    assert over_stale_bytes == "022400" + "010400" + "010100" + "010200" + "010300"
    assert kept[6:] == over_stale_bytes[6:]


def test_zeros_behind_a_breakpoint_clear_the_first():
    points = ["00240000013412", "00240001017856", "00240004013333", "002500", "002501"]
    first, *_, kept, missing = answers("1.32", *counting_program(), *points)[-5:]
    assert first == "022400" + bytes(12).hex()
    assert kept == "022500000000017856000000000000"
    assert missing == "0225c0"


def test_interpreter_states_are_set_without_a_reply_too():
    assert answers("1.32", *counting_program(), "802203", ASK_STATE)[-1][6:8] == "03"


def named(name: str) -> str:
    return name.encode().ljust(20, b"\0").hex()


FILE = [f"0181{named('a.txt')}03000000", "018300616263", "018400"]


@pytest.mark.parametrize(
    ("old", "new", "status"),
    [
        ("a.txt", "b.txt", "00"),
        ("A.TXT", "a.rxe", "00"),
        ("a.txt", "a.txt", "8f"),
        ("a.txt", "*.txt", "8f"),
        ("c.txt", "d.txt", "87"),
        ("c.txt", "x" * 20, "92"),
        ("x" * 20, "d.txt", "92"),
        ("a.txt", "", "00"),
    ],
)
def test_a_file_is_renamed_over_the_wire(old, new, status):
    replies = answers("1.32", *FILE, f"01a3{named(old)}{named(new)}", f"0186{named(new)}")
    assert replies[-2] == f"02a3{status}00{named(old)}{named(new)}"
    assert status != "00" or replies[-1] == f"02860000{named(new)}03000000"


def test_an_open_file_is_not_renamed():
    rename = f"01a3{named('a.txt')}{named('b.txt')}"
    assert answers("1.32", *FILE, f"0180{named('a.txt')}", rename)[-1][4:8] == "8b01"


def test_the_commands_are_unknown_to_firmware_1_29():
    assert answers("1.29", "002203", "0023", "002500") == ["0222be", "0223be", "0225be"]
    assert answers("1.29", f"01a3{named('a')}{named('b')}")[0].startswith("02a3")


COMPARES_AND_LOOPS = (
    "4d696e6473746f726d734e585400000603001c0004001c00040018000100000008000100090004000000070002000400000001000100fbff"
    "000008000a000200ffffffff04000200020002000000000000002684060000000100254000002a60ffffffff"
)
"""Compare a number and an array for equality and branch to the end, else loop forever."""


@pytest.mark.parametrize(
    ("arguments", "status"), [("06000000 0100", "01"), ("06000000 0000", "01"), ("06000100 0000", "ff")]
)
def test_a_comparison_of_an_array_always_branches_unless_it_is_an_error(arguments, status):
    content = bytes.fromhex(COMPARES_AND_LOOPS.replace("060000000100", arguments.replace(" ", "")))
    assert answers("1.32", *program(content))[-1] == f"029400010001000100{status}"
