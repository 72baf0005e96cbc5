"""Keys in the menus, pass by pass. Each value is the one that LEGO's firmware gave."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import SOUND, UI, UiFlag
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, store
from sim_backend.firmware.brick import SimBrick

BUTTONS = {"x": 1, "r": 2, "l": 4, "e": 8}
STATES = {5: "5", 6: "6", 7: ".", 8: "L", 9: "R", 10: "E", 11: "X"}


class Keypad:
    """A bench whose user interface is looked at in each pass."""

    def __init__(self, *files, firmware="1.29"):
        self.bench = Bench(SimBrick(firmware=firmware))
        for name in files:
            self.send(system.OpenWrite(name, 1))
            self.send(system.Write(0, b"a"))
            self.send(system.Close(0))

    def send(self, command):
        self.bench.telegram(command.encode().hex())

    def hold(self, mask, passes):
        """Hold buttons; the state in each pass, and ' behind it while the map's Button waits."""
        self.bench.control(f"!button {mask}")
        ui, states = self.bench.brick.ui, ""
        for _ in range(passes):
            self.bench.control("!tick 1")
            states += STATES[ui.registers.state] + "'" * bool(ui.registers.button)
        return states

    def press(self, keys):
        """Press keys one after the other; the states they bring."""
        states = [self.hold(BUTTONS[key], 16) + self.hold(0, 10) for key in keys]
        return [each.replace(".", "") for each in states]

    def write(self, key):
        self.send(UI.field("Button").write(key))


@pytest.mark.parametrize(
    ("before", "keys", "states"),
    [
        ("", "xrl", ["X56", "R56", "L56"]),
        ("r", "eerxx", ["E566", "E566", "R56", "X56566", "X56"]),
        ("rrrr", "eex", ["E56", "E56E566X56", "X56"]),
        ("l", "e", ["E56E566X56"]),
        ("e", "e", ["E566X56"]),
        ("llee", "rle", ["R566", "L566", "E56X56X56"]),
        ("llee", "x", ["X56X56"]),
        ("ller", "ere", ["E5666", "R566", "E56X56"]),
    ],
)
def test_a_key_brings_its_state_and_draws_the_menu(before, keys, states):
    keypad = Keypad()
    keypad.press(before)
    assert keypad.press(keys) == states


@pytest.mark.parametrize(
    ("before", "keys", "states"),
    [
        ("eee", "rrr", ["R56", "R56", "R5666"]),
        ("eeer", "exl", ["E566", "X56", "L5666"]),
        ("eeel", "eer", ["E56", "E56", "R5666"]),
        ("eeel", "erel", ["E56", "R56", "E56", "L56"]),
        ("errre", "l", ["L566666"]),
        ("re", "ex", ["E566", "X56566"]),
        ("ree", "erex", ["E566", "R56", "E566", "X566"]),
    ],
)
def test_the_pages_of_a_file_and_of_a_program_in_steps(before, keys, states):
    keypad = Keypad("a.rxe", "b.log")
    keypad.press(before)
    assert keypad.press(keys) == states


@pytest.mark.parametrize(
    ("keys", "icons"),
    [
        ("re", "0000000000"),
        ("ree", "0101010101"),
        ("reerre", "0901010101"),
        ("reeele", "0315010101"),
        ("reeeeee", "0311031101"),
        ("reeeeexx", "0311010101"),
        ("reeeeexxxx", "0301010101"),
        ("reerrexe", "0901010101"),
        ("reeeeeeex", "0311031120"),
    ],
)
def test_the_steps_of_a_program_have_icons(keys, icons):
    keypad = Keypad()
    keypad.press(keys)
    assert keypad.bench.brick.ui.program_steps.icons.hex() == icons
    assert keypad.bench.telegram("019401000a0070000500").endswith(icons)


@pytest.mark.parametrize(("keys", "names"), [("eeelele", ["a.rxe"]), ("eeelere", ["b.rxe", "a.rxe"])])
def test_the_page_of_a_file_deletes_it(keys, names):
    keypad = Keypad("a.rxe", "b.rxe")
    keypad.press(keys)
    assert keypad.bench.brick.loader.flash.names_ending(".rxe") == names


@pytest.mark.parametrize(("firmware", "states"), [("1.29", "E5666666666666"), ("1.05", "E566X56")])
def test_firmware_1_05_has_no_item_for_logs(firmware, states):
    keypad = Keypad("b.log", firmware=firmware)
    keypad.press("el")
    assert keypad.press("e") == [states]


@pytest.mark.parametrize(
    ("files", "keys", "off"),
    [
        ([], "xe", True),
        ([], "xre", False),
        ([], "xrle", True),
        ([], "xxe", False),
        ([], "rxe", True),
        ([], "eexe", False),
        ([], "eexxe", True),
        (["a.rxe"], "eexxe", False),
        (["a.rxe"], "eexxxe", True),
        (["a.rso"], "errexxxe", True),
        ([], "reeexxxxe", True),
        ([], "lexe", True),
    ],
)
def test_enter_answers_the_question_whether_to_switch_off(files, keys, off):
    keypad = Keypad(*files)
    keypad.press(keys)
    assert keypad.bench.control("!power").startswith("power=5a display=0") == off


@pytest.mark.parametrize(
    ("keys", "volume", "minutes"),
    [
        ("lleer", 0, 10),
        ("lleel", 3, 10),
        ("lleerx", 4, 10),
        ("lleerre", 1, 10),
        ("llerer", 4, 10),
        ("llerere", 4, 30),
        ("llererx", 4, 10),
        ("llererrre", 4, 0),
        ("llerele", 4, 5),
    ],
)
def test_volume_and_sleep_time_can_be_set(keys, volume, minutes):
    keypad = Keypad()
    keypad.press(keys)
    ui = keypad.bench.brick.ui
    assert (ui.registers.volume, ui.sleep_timer.limit_minutes) == (volume, minutes)


def test_a_key_takes_over_the_volume_of_the_menu():
    keypad = Keypad()
    keypad.press("lleer")
    assert keypad.bench.brick.sound.volume == 4
    keypad.send(SOUND.field("Volume").write(2))
    keypad.press("r")
    assert keypad.bench.brick.sound.volume == 0


@pytest.mark.parametrize(
    ("mask", "states"), [(3, "X56"), (15, "X56"), (12, "E566X56"), (6, "R56"), (10, "E566X56")], ids=str
)
def test_of_several_buttons_one_counts(mask, states):
    keypad = Keypad()
    keypad.press("e")
    assert keypad.hold(mask, 20).replace(".", "") == states


def test_left_and_right_count_again_while_they_are_held():
    for mask, times in ((2, 3), (4, 3), (12, 1), (1, 1)):
        states = Keypad().hold(mask, 1150)
        assert sum(states.count(key) for key in "LREX") == times


def test_a_button_counts_only_after_all_were_released():
    keypad = Keypad()
    assert keypad.hold(4, 6) == ".L56.."
    assert keypad.hold(1, 20) == "." * 20
    assert keypad.hold(0, 2) + keypad.hold(1, 6) == ".." + ".X56.."


def test_a_press_while_the_menu_is_drawn_is_lost():
    keypad = Keypad()
    assert keypad.hold(4, 2) + keypad.hold(0, 2) + keypad.hold(1, 8) == ".L56........"


def test_a_key_of_the_map_waits_for_the_menu_and_for_the_buttons():
    keypad = Keypad()
    keypad.write(1)
    keypad.write(3)
    assert keypad.hold(0, 6) == "6'.'R56."
    keypad.hold(2, 8)
    keypad.write(1)
    assert keypad.hold(2, 3) == ".'.'.'"
    assert keypad.hold(0, 8) == ".'L56...."


def test_the_page_of_a_file_that_has_run_is_four_levels_down():
    for exits in range(5):
        keypad = Keypad("a.rxe")
        keypad.send(direct.StartProgram("a.rxe"))
        keypad.bench.control("!tick 900")
        keypad.press("x" * exits + "e")
        assert keypad.bench.control("!power").startswith("power=5a") == (exits == 4)


def test_the_sleep_timer_can_be_written():
    keypad = Keypad()
    keypad.send(UI.field("SleepTimer").write(5))
    assert keypad.bench.brick.ui.sleep_timer.minutes == 5
    keypad.bench.control("!tick 60000")
    assert keypad.bench.brick.ui.sleep_timer.minutes == 6


def test_a_brick_that_never_sleeps_resets_its_sleep_timer_in_each_pass():
    keypad = Keypad()
    keypad.send(UI.field("SleepTimeout").write(0))
    keypad.bench.brick.tick(125_000)
    ui = keypad.bench.brick.ui
    assert (ui.registers.flags, ui.sleep_timer.minutes) == (0x90, 0)
    keypad.send(UI.field("SleepTimeout").write(3))
    keypad.bench.brick.tick(60_001)
    assert (ui.registers.flags, ui.sleep_timer.minutes) == (0x80, 1)


def test_enter_runs_the_program_of_the_page():
    keypad = Keypad("a.rxe", "b.rxe")
    keypad.press("eee")
    assert keypad.hold(BUTTONS["e"], 6).strip(".") in ("E5666", "E56666")
    assert keypad.bench.brick.ui.registers.flags == 0xC0
    assert keypad.hold(0, 12) == "6" * 12
    assert (keypad.bench.brick.command.program_name, keypad.bench.brick.ui.registers.state) == ("b.rxe", 6)
    keypad.bench.control("!tick 760")
    assert (keypad.hold(0, 1), keypad.press("re")) == (".", ["R56", "E566"])


def test_the_samples_of_the_battery_begin_anew_with_a_start_by_enter():
    keypad = Keypad()
    keypad.press("xe")
    keypad.bench.control("!tick 300")
    keypad.bench.control("!button 8")
    battery, ui = keypad.bench.brick.ui.battery, keypad.bench.brick.ui
    passes = next(n for n in range(10) if keypad.bench.control("!tick 1") and ui.registers.state == 2)
    assert passes < 9
    assert [battery.bars, keypad.bench.control("!tick 165")[:2], battery.bars] == [0, "ok", 0]
    keypad.bench.control("!tick 1")
    assert battery.bars == 4


@pytest.mark.parametrize(
    ("files", "keys", "passes"),
    [
        (1, "ee", 12), (4, "ee", 18), (1, "eer", 5), (3, "eer", 8), (3, "eerr", 9), (3, "eerrr", 7), (3, "eel", 9),
        (2, "eer", 7), (2, "eel", 6), (4, "eee", 4), (4, "eex", 1), (4, "eeex", 10), (3, "eerex", 9),
    ],
)  # fmt: skip
def test_a_list_of_files_is_drawn_in_passes_of_state_6(files, keys, passes):
    keypad = Keypad(*(f"{number}.rxe" for number in range(files)))
    for key in keys[:-1]:
        keypad.hold(BUTTONS[key], 40)
        keypad.hold(0, 10)
    assert keypad.hold(BUTTONS[keys[-1]], 40).count("6") == passes


@pytest.mark.parametrize(("held", "shown"), [(2, 750), (40, 1)])
def test_exit_ends_the_message_if_it_is_held_when_that_is_shown(held, shown):
    bench = Bench(SimBrick())
    store(bench.brick, "a.rxe", assemble(Variables(), [[0x4025, 0]]))
    bench.telegram(direct.StartProgram("a.rxe").encode().hex())
    bench.control("!tick 30")
    bench.control("!button 1")
    bench.control(f"!tick {held}")
    bench.control("!button 0")
    passes = 0
    while bench.brick.ui.registers.state == 14:
        bench.control("!tick 1")
        passes += 1
    assert shown - 1 <= passes <= shown + 2 if shown > 1 else passes == 0


@pytest.mark.parametrize(
    ("pressed", "shown"),
    [(500, 453), (848, 8), (860, 13)],
)
def test_the_warning_of_a_low_battery_ends_with_a_button_that_counts_again(pressed, shown):
    """The right button is held; it is not looked at in the first eight passes of the warning."""
    bench = Bench(SimBrick())
    bench.control("!battery 33268")
    passes = 0
    for number in range(1500):
        if number == pressed:
            bench.control("!button 2")
        bench.control("!tick 1")
        passes += bench.brick.ui.registers.state == 15
    assert passes == shown


@pytest.mark.parametrize(
    ("firmware", "before", "sensor", "left"),
    [
        ("1.29", "rrreee", [7, 0x80], "X56"),
        ("1.29", "rrrelleee", [11, 0], "X56"),
        ("1.29", "rrrerrrree", [11, 0], "X5666"),
        ("1.05", "rreee", [7, 0x80], "X5666"),
        ("1.05", "rrerrrrree", [2, 0xA0], "X56"),
    ],
)
def test_view_sets_a_sensor_until_exit_is_pressed(firmware, before, sensor, left):
    keypad = Keypad(firmware=firmware)
    keypad.press(before)
    port = keypad.bench.brick.input.ports[0]
    assert [port.type, port.mode] == sensor
    assert keypad.press("r") == ["6" * 26]
    assert keypad.bench.brick.ui.registers.flags == UiFlag.ENABLE_STATUS | UiFlag.BUSY
    assert keypad.press("x")[0].lstrip("6") == left
    assert [port.type, port.mode] == [0, sensor[1]]
    assert keypad.bench.brick.ui.registers.flags == UiFlag.ENABLE_STATUS


def _with_enter_on_a_port_of_view(command):
    """A bench to which a command was sent while the value of a sensor was about to be shown."""
    keypad = Keypad("a.rxe")
    keypad.press("rrree")
    keypad.hold(BUTTONS["e"], 2)
    keypad.bench.control("!button 0")
    keypad.send(command)
    return keypad


@pytest.mark.parametrize(
    ("command", "passes", "keys", "states"),
    [
        (UI.field("State").write(3), 20, "re", ["R56", "E566"]),
        (UI.field("State").write(4), 20, "re", ["R56", "E566"]),
        (direct.StartProgram("a.rxe"), 900, "xe", ["X56666666", "E56666"]),
    ],
)
def test_what_takes_the_place_of_a_value_is_shown_without_it(command, passes, keys, states):
    keypad = _with_enter_on_a_port_of_view(command)
    keypad.bench.control(f"!tick {passes}")
    assert keypad.press(keys) == states
    assert keypad.bench.brick.ui.registers.flags == UiFlag.ENABLE_STATUS


def test_keys_count_after_a_value_that_follows_a_question_of_the_radio():
    keypad = _with_enter_on_a_port_of_view(UI.field("State").write(12))
    for control in ("!tick 30", "!button 8", "!tick 8", "!button 0", "!tick 20"):
        keypad.bench.control(control)
    assert [each.lstrip("6") for each in keypad.press("xrr")] == ["X56", "R56", "R56"]


def test_exit_from_the_page_that_stores_a_log_leads_up_only_if_its_state_is_written():
    keypad = Keypad()
    keypad.press("rreeeeex")
    assert keypad.press("x") == [""]
    keypad.send(UI.field("State").write(11))
    assert keypad.hold(0, 10) == "6" + 9 * "."
    assert keypad.press("x") == ["X566"]
