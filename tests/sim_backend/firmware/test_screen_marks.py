"""What menus and files add to the masks of the display. Each value is the one that LEGO's firmware gave."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import DISPLAY, UI
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick

KEYS = {"l": 1, "e": 2, "r": 3, "x": 4}


def write(bench, name, value):
    bench.telegram(UI.field(name).write(value).encode().hex())


def press(bench, keys, passes=40):
    """Press keys by the map, each when the menu is drawn: after a number of passes."""
    for key in keys:
        bench.control(f"!tick {passes}")
        write(bench, "Button", KEYS[key])


def masks(bench, passes):
    """Both masks in each pass."""
    request = DISPLAY.field("EraseMask").read().encode().hex()[:-4] + "0800"
    replies = [bytes.fromhex(bench.telegram(request))[9:] for _ in range(passes)]
    pairs = [(int.from_bytes(each[:4], "little"), int.from_bytes(each[4:8], "little")) for each in replies]
    return " ".join(f"{erase:x}|{update:x}" if erase or update else "-" for erase, update in pairs)


@pytest.mark.parametrize(
    ("firmware", "keys", "expected"),
    [
        ("1.29", "r", "- - - 40000200|ff700 200|fe700 0|fe700 0|7e700"),
        ("1.29", "ee", "- - - - - - - 40000200|ff700 200|fe700"),
        ("1.29", "le", "- - - 40000200|ff700 200|fe700"),
        ("1.29", "lllee", "- - - 40000200|ff700 200|fe700 0|fe700 40000200|ff700 200|fe700"),
        ("1.29", "llee", "- - - e0600|ff700 6060c|1ff704 e060c|1ff704 6060c|1ff704"),
        ("1.29", "lleer", "- - - c|100004 e0604|1ff704 60604|1ff704"),
        ("1.29", "lleere", "- - - - - - - - - 40000200|ff700 200|fe700"),
        ("1.29", "re", "- - - 40000200|ff700 2fc|ff6fc fc|ff6fc"),
        ("1.29", "rer", "- - - - -"),
        ("1.29", "rre", "- - - 80000000|4 e0600|ff704 60600|ff704"),
        ("1.29", "rrer", "- - - e0600|ff700 60600|ff700"),
        ("1.29", "rrreee", "- - - 40000200|11f200 200|11e200"),
        ("1.29", "rrreeex", "80000000|4 0|4 - - e0600|ff700"),
        ("1.05", "rre", "- - - e0600|ff700 80060600|ff704 e0600|ff704 60600|ff704"),
        ("1.05", "llllle", "- - - 40000200|ff700 2fc|ff6fc fc|ff6fc"),
    ],
)
def test_a_page_of_the_menus_is_drawn_when_state_6_ends(firmware, keys, expected):
    bench = Bench(SimBrick(firmware=firmware))
    press(bench, keys)
    assert masks(bench, len(expected.split())) == expected


@pytest.mark.parametrize(
    ("files", "keys", "expected"),
    [
        (
            1,
            "ee",
            "- - - - - - - e0010|40500 40060210|ff700 60210|fe700 20210|fe700 210|fe700 10|fe700 "
            "e0010|fe700 40060210|ff700 60210|fe700 20210|fe700 210|fe700",
        ),
        (3, "ee", "- - - - - - - - - e0010|e0500 40060210|ff700 60210|fe700 20210|fe700 210|fe700"),
        (2, "eer", "- - - - - - - - - e0010|60500 60010|60500"),
        (3, "eer", "- - - - - - - - - - e0010|e0500 60010|e0500"),
        (1, "eee", "- - - - e0600|ff700 60600|8 e0600|ff708 60600|ff708 20600|ff708"),
        (
            2,
            "eeex",
            "- - - 40000200|ff700 200|fe700 0|fe700 0|7e700 0|3e700 0|1e700 "
            "e0010|ce700 40060210|ff700 60210|fe700 20210|fe700",
        ),
        (1, "eeer", "- - - 40000200|ff700 200|fe700"),
        (1, "eeerl", "- - - e0600|ff700 60600|8 e0600|ff708 60600|ff708"),
        (1, "eeere", "- - - 40000200|ff700 e0210|fe700 60210|fe700"),
    ],
)
def test_lists_and_pages_of_files_are_drawn(files, keys, expected):
    bench = Bench(SimBrick())
    for number in range(files):
        store(bench.brick, f"{number}.rxe", b"a")
    press(bench, keys, 60)
    assert masks(bench, len(expected.split())) == expected


@pytest.mark.parametrize(
    ("wait", "expected"),
    [
        (0, "- 0|8 - 40000000|1018 0|18 0|8 - - - 40000200|5f218 200|5e218 0|5e218"),
        (756, "- - - 10|e0408 0|e0408 e0600|ff708 60600|8 e0600|ff708 60600|ff708 20600|ff708"),
    ],
)
def test_a_file_is_drawn_at_its_start_at_its_end_and_after_its_message(wait, expected):
    bench = Bench(SimBrick())
    for command in (system.OpenWrite("a.rxe", 1), system.Write(0, b"A"), system.Close(0)):
        bench.telegram(command.encode().hex())
    bench.control("!tick 30")
    bench.telegram(direct.StartProgram("a.rxe").encode().hex())
    if wait:
        bench.control(f"!tick {wait}")
    assert masks(bench, len(expected.split())) == expected


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        ("BluetoothState", 5, "0|a000 0|2000 -"),
        ("RunState", 0, "0|8000 - -"),
        ("UsbState", 0, "0|8000 - -"),
        ("BatteryState", 0, "0|18000 0|8000 -"),
    ],
)
def test_icons_that_changed_are_drawn_with_the_next_sample_of_the_battery(name, value, expected):
    bench = Bench(SimBrick())
    write(bench, name, value)
    bench.control("!battery 500" if name == "BatteryState" else "!tick 1")
    bench.control("!tick 10" if name == "BatteryState" else "!tick 9")
    assert masks(bench, 4)[2:] == expected


def test_a_page_changes_the_volume_when_its_state_6_ends():
    bench = Bench(SimBrick())
    press(bench, "lleer")
    volumes = []
    for _ in range(5):
        volumes.append(bench.brick.ui.registers.volume)
        bench.control("!tick 1")
    assert volumes == [4, 4, 4, 0, 0]


DISPLAY_FLAGS, UI_FLAGS, MASKS = "019401000a0075000100", "019401000c001a000100", "019401000a0004000800"
PRESS_LEFT, ACTIVATE = "019501000c001c00010001", "0195010001001e00010001"


@pytest.mark.parametrize(
    ("firmware", "lines", "reply"),
    [
        pytest.param("1.29", ["019501000c001a00010010", PRESS_LEFT, "!tick 5", UI_FLAGS], "80", id="menu"),
        pytest.param("1.29", ["019501000c001a00010084", ACTIVATE, "!tick 1", UI_FLAGS], "80", id="failed start"),
        pytest.param("1.29", ["019501000a00750001000b", ACTIVATE, "!tick 3", DISPLAY_FLAGS], "0b", id="popup"),
        pytest.param("1.32", ["019501000a00750001000b", ACTIVATE, "!tick 3", DISPLAY_FLAGS], "83", id="popup 1.32"),
        pytest.param("1.29", ["!button 3", "!tick 2100", "!button 0", "!tick 5", DISPLAY_FLAGS], "82", id="off"),
    ],
)
def test_flags_after_menus_ends_and_the_power_button(firmware, lines, reply):
    bench = Bench(SimBrick(firmware=firmware))
    answers = [bench.answer(line) for line in lines]
    assert answers[-1][18:] == reply


WAIT, JUMP = 0x34, 0x25


def test_the_tick_stays_behind_after_an_abort_while_programs_only_wait():
    bench, variables = Bench(SimBrick()), Variables()
    pause = variables.number(5)
    content = assemble(variables, [instruction(WAIT, 0xFFFF, pause), instruction(JUMP, -3)])
    store(bench.brick, "a.rxe", content)
    lags = []
    for _ in range(2):
        bench.telegram(direct.StartProgram("a.rxe").encode().hex())
        bench.control("!tick 40")
        lags.append(bench.brick.now_ms - bench.brick.command.tick)
        bench.telegram(direct.StopProgram().encode().hex())
        bench.control("!tick 800")
    assert lags == [0, 1]
