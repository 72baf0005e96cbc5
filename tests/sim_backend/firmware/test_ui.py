"""Life cycle of programs in the user interface, pass by pass. Each value is the one that LEGO's firmware gave."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import BUTTON, COMMAND, DISPLAY, UI, ProgramStatus
from firmware_protocol.status import Status
from nxtdrive.tools.conformance.bench import Bench
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.ui.battery import RECHARGEABLE
from sim_backend.firmware.versions import FIRMWARES
from tests.sim_backend.firmware.asking import ask_bench as ask

LOOP = bytes.fromhex(
    "4d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010004000501000004000a000100ffffffff00000000"
    "254002002540feff"
)
END = bytes.fromhex(
    "4d696e6473746f726d734e585400000501000e0004000a0000000a00000000000400010002000501000004000a000100ffffffff00000000"
    "2940ffff"
)
NO_PROGRAM = bytes(80)
CONTENTS = {"loop.rxe": LOOP, "end.rxe": END, "bad.rxe": NO_PROGRAM, "note.txt": b"hello", "c.rpg": b"hello"}

STATUS, STATE = COMMAND.field("ProgStatus").read(), UI.between("Flags", "State")
STATE = system.IOMapRead(STATE.module_id, STATE.offset, STATE.size)


@pytest.fixture(params=FIRMWARES)
def bench(request):
    bench = Bench(SimBrick(firmware=request.param))
    for name, content in CONTENTS.items():
        handle = ask(bench, system.OpenWrite(name, len(content)))[1][0]
        for start in range(0, len(content), 58):
            ask(bench, system.Write(handle, content[start : start + 58]))
        ask(bench, system.Close(handle))
    return bench


def observe(bench, question, passes):
    """The distinct values of the data of a map while `passes` pass, each with the number of passes."""
    seen = []
    for _ in range(passes):
        value = ask(bench, question)[1][6:].hex()
        if not seen or seen[-1][0] != value:
            seen.append([value, 0])
        seen[-1][1] += 1
    return [tuple(each) for each in seen]


def start(bench, name):
    assert ask(bench, direct.StartProgram(name))[0] == Status.OK


def test_start_and_stop(bench):
    start(bench, "loop.rxe")
    assert observe(bench, STATE, 12) == [("e00d", 1), ("e00e", 7), ("e60e", 4)]
    ask(bench, direct.StopProgram())
    assert observe(bench, STATE, 760) == [("e60e", 1), ("e00e", 750), ("8005", 1), ("8006", 3), ("8007", 5)]


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        ("end.rxe", [("00", 8), ("02", 1), ("01", 751), ("05", 1), ("00", 9)]),
        ("bad.rxe", [("00", 8), ("03", 751), ("05", 1), ("00", 10)]),
    ],
)
def test_the_status_after_the_end(bench, name, seen):
    start(bench, name)
    seen = [("fc" if value == "03" and bench.brick.firmware == "1.32" else value, polls) for value, polls in seen]
    assert observe(bench, STATUS, 770) == seen


@pytest.mark.parametrize(
    ("name", "seen"),
    [
        ("note.txt", [("e00d", 1), ("e00e", 5), ("c005", 1), ("c006", 3), ("c007", 790)]),
        ("c.rpg", [("e00d", 1), ("e00e", 757), ("8005", 1), ("8006", 3), ("8007", 38)]),
    ],
)
def test_a_file_that_is_not_a_program(bench, name, seen):
    start(bench, name)
    assert observe(bench, STATE, 800) == seen


@pytest.mark.parametrize(("between", "name"), [(0, b"end.rxe"), (1, b"loop.rxe"), (5, b"loop.rxe")])
def test_a_second_request_replaces_the_first_only_in_the_next_pass(bench, between, name):
    start(bench, "loop.rxe")
    bench.brick.tick(between)
    start(bench, "end.rxe")
    bench.brick.tick(7 - between)
    assert ask(bench, direct.GetCurrentProgramName())[1].rstrip(b"\0") == name


@pytest.mark.parametrize(
    ("passes", "delay"), [(750, None), (751, 8), (752, 10), (753, 9), (754, 10), (755, 9), (756, 8)]
)
def test_a_start_soon_after_the_last_program(bench, passes, delay):
    start(bench, "loop.rxe")
    bench.brick.tick(20)
    ask(bench, direct.StopProgram())
    bench.brick.tick(passes)
    start(bench, "loop.rxe")
    seen = observe(bench, STATUS, 12)
    running = [sum(count for _, count in seen[:number]) for number, (status, _) in enumerate(seen) if status == "02"]
    assert running == ([] if delay is None else [delay])


@pytest.mark.parametrize(("phase", "delay"), [(1, 8), (2, 9), (3, 9), (4, 9), (5, 8)])
def test_a_battery_sample_delays_a_start(phase, delay):
    bench = Bench(SimBrick())
    handle = ask(bench, system.OpenWrite("a.rxe", len(LOOP)))[1][0]
    ask(bench, system.Write(handle, LOOP[:58]))
    ask(bench, system.Write(handle, LOOP[58:]))
    ask(bench, system.Close(handle))
    bench.brick.tick(phase)
    start(bench, "a.rxe")
    assert observe(bench, STATUS, 12) == [("00", delay), ("02", 12 - delay)]


def test_a_start_waits_for_the_end_of_a_tone(bench):
    ask(bench, direct.PlayTone(440, 1000))
    start(bench, "loop.rxe")
    bench.brick.tick(990)
    assert observe(bench, STATUS, 1) == [("00", 1)]
    bench.brick.tick(20)
    assert observe(bench, STATUS, 1) == [("02", 1)]


@pytest.mark.parametrize(("name", "runs_ms"), [("loop.rxe", 8), ("bad.rxe", 760)])
def test_outputs_are_reset_when_a_program_starts_and_when_the_menu_comes_back(bench, name, runs_ms):
    ask(bench, direct.SetOutputState(1, 50, 7, 1, 0, 0x20, 0))
    start(bench, name)
    states = [ask(bench, direct.GetOutputState(1))[1][1] for _ in range(770)]
    assert states.index(0) == runs_ms


def test_outputs_run_on_after_a_program_that_ended_by_itself_until_the_menu_comes_back(bench):
    start(bench, "end.rxe")
    bench.brick.tick(10)
    ask(bench, direct.SetOutputState(1, 50, 7, 1, 0, 0x20, 0))
    states = [ask(bench, direct.GetOutputState(1))[1][1] for _ in range(760)]
    assert states.index(0) == 750


def test_inputs_are_reset_one_pass_after_the_end_and_with_the_menu(bench):
    start(bench, "loop.rxe")
    bench.brick.tick(20)
    ask(bench, direct.SetInputMode(0, 1, 0x20))
    bench.brick.tick(50)
    ask(bench, direct.StopProgram())
    types = [ask(bench, direct.GetInputValues(0))[1][3] for _ in range(3)]
    assert types == [1, 0, 0]
    bench.brick.tick(100)
    ask(bench, direct.SetInputMode(0, 1, 0x20))
    types = [ask(bench, direct.GetInputValues(0))[1][3] for _ in range(660)]
    assert types.index(0) == 752 - 104


def test_a_file_that_is_not_a_program_counts_as_active_for_one_pass(bench):
    start(bench, "bad.rxe")
    bench.brick.tick(8)
    assert ask(bench, direct.MessageRead(5, 1, False)) == (Status.MAILBOX_EMPTY, b"\1" + bytes(60))
    assert ask(bench, direct.MessageRead(5, 1, False)) == (Status.NO_ACTIVE_PROGRAM, b"\1" + bytes(60))


@pytest.mark.parametrize(("box", "status"), [(0, Status.MAILBOX_EMPTY), (20, Status.ILLEGAL_MAILBOX)])
def test_a_refused_message_names_the_local_mailbox(bench, box, status):
    start(bench, "loop.rxe")
    bench.brick.tick(10)
    assert ask(bench, direct.MessageRead(box, 7, True)) == (status, b"\7" + bytes(60))


@pytest.mark.parametrize(
    ("before", "answer"),
    [
        ([], (Status.END_OF_FILE, bytes(4))),
        ([system.OpenRead("bad.rxe")], (Status.OK, NO_PROGRAM[:4])),
        ([system.OpenRead("note.txt"), system.Read(0, 2)], (Status.END_OF_FILE, b"llo\0")),
    ],
)
def test_the_handle_of_a_program_reads_on_where_its_last_file_was_left(bench, before, answer):
    for command in before:
        ask(bench, command)
    start(bench, "loop.rxe")
    bench.brick.tick(10)
    status, reply = ask(bench, system.Read(0, 4))
    assert (status, reply[3:]) == answer
    assert ask(bench, system.Delete("loop.rxe"))[0] == Status.FILE_IS_BUSY


def test_a_request_during_a_program_closes_its_file(bench):
    start(bench, "loop.rxe")
    bench.brick.tick(10)
    start(bench, "end.rxe")
    assert ask(bench, system.Delete("loop.rxe"))[0] == Status.OK
    assert observe(bench, STATUS, 5) == [("02", 5)]


def test_the_memory_pool_is_filled_anew_for_each_program(bench):
    pool, filler = COMMAND.field("MemoryPool").offset, "efbeadde"
    end = system.IOMapRead(COMMAND.module_id, pool + 32_760, 8)
    assert observe(bench, end, 1) == [(filler * 2, 1)]
    ask(bench, system.IOMapWrite(COMMAND.module_id, pool + 32_760, 4, b"abcd"))
    start(bench, "bad.rxe")
    bench.brick.tick(10)
    assert observe(bench, end, 1) == [(filler * 2, 1)]


def test_a_button_skips_the_message_about_the_end(bench):
    start(bench, "end.rxe")
    bench.brick.tick(40)
    bench.control("!button 1")
    bench.brick.tick(3)
    assert observe(bench, STATE, 1)[0][0] in ("8005", "8006")


@pytest.mark.parametrize(
    ("before", "raw", "bars"),
    [
        (400, 447, 0),
        (400, 448, 1),
        (400, 470, 2),
        (455, 476, 1),
        (455, 477, 2),
        (560, 542, 4),
        (560, 541, 3),
        (560, 440, 0),
        (RECHARGEABLE | 518, RECHARGEABLE | 523, 1),
        (RECHARGEABLE | 518, RECHARGEABLE | 524, 2),
        (RECHARGEABLE | 560, RECHARGEABLE | 512, 0),
        (433, RECHARGEABLE | 545, 4),
    ],
)
def test_one_bar_more_needs_more_voltage_than_one_less(before, raw, bars):
    bench = Bench(SimBrick())
    for value in (before, raw):
        bench.control(f"!battery {value}")
        bench.brick.tick(170)
    assert observe(bench, UI.field("BatteryState").read(), 1) == [(f"{bars:02x}", 1)]


def test_the_battery_popup_comes_two_passes_after_the_sixth_sample():
    bench = Bench(SimBrick())
    bench.control("!battery 430")
    assert observe(bench, STATE, 850) == [("8007", 849), ("c00f", 1)]


def test_a_volume_in_the_map_of_the_user_interface_is_not_that_of_the_sounds():
    bench = Bench(SimBrick())
    ask(bench, UI.field("Volume").write(2))
    assert ask(bench, direct.GetProperty(1)) == (Status.OK, b"\4")
    ask(bench, direct.SetProperty(1, b"\3\0\0\0"))
    assert ask(bench, direct.GetProperty(1)) == (Status.OK, b"\3")
    assert observe(bench, UI.field("Volume").read(), 1) == [("03", 1)]


def test_an_idle_program_status_is_reported(bench):
    assert observe(bench, STATUS, 1) == [(f"{int(ProgramStatus.IDLE):02x}", 1)]


def test_the_display_stays_on_at_power_off_during_the_battery_popup():
    bench = Bench(SimBrick())
    bench.control("!battery 430")
    bench.brick.tick(1200)
    ask(bench, UI.field("ForceOff").write(1))
    bench.brick.tick(7)
    assert bench.control("!power").startswith("power=5a display=1")


def test_enter_starts_a_brick_again_that_switched_itself_off():
    bench = Bench(SimBrick())
    ask(bench, system.DeleteUserFlash())
    ask(bench, direct.KeepAlive())
    ui = bench.brick.ui
    ui.set_sleep_minutes(1)
    bench.control("!tick 60010")
    assert bench.control("!power").startswith("power=5a display=0")
    assert (ui.registers.state, ui.registers.force_off, bench.brick.loader.flash.files) == (6, 0, [])
    for button in (8, 0, 1, 0):  # too early, and the wrong one
        bench.control(f"!button {button}")
        bench.control("!tick 120")
        assert ui.registers.state == 6
    bench.control("!button 8")
    bench.control("!tick 10")
    assert (ui.registers.state, ui.registers.flags, ui.sleep_timer.limit_minutes) == (2, 0x40, 10)
    assert [file.name for file in bench.brick.loader.flash.files] == ["NVConfig.sys"]
    assert bench.control("!power").startswith("power=5a display=1")
    bench.control("!tick 3700")
    assert (ui.registers.state, ui.registers.flags) == (7, 0x80)


def test_a_key_that_is_taken_clicks():
    bench = Bench(SimBrick())
    sound = bench.brick.sound
    sound.mode = 2
    bench.control("!button 2")
    bench.control("!tick 2")
    assert (sound.name.rstrip(b"\0"), sound.mode) == (b"! Click.rso\0o", 0)


def test_a_new_press_shows_for_one_pass():
    bench = Bench(SimBrick())
    bench.control("!tick 10")
    bench.control("!button 1")
    assert [bench.telegram("0194010004002000" + "0100")[-2:] for _ in range(4)] == ["00", "00", "81", "80"]


def test_the_tick_leaves_out_the_pass_of_an_abort(bench):
    tick = COMMAND.field("Tick")
    start(bench, "loop.rxe")
    bench.brick.tick(20)
    ask(bench, direct.StopProgram())
    behind = bench.brick.firmware != "1.05"
    assert tick.decode(ask(bench, tick.read())[1][6:]) == bench.brick.now_ms - 1 - behind
    bench.brick.tick(800)
    assert tick.decode(ask(bench, tick.read())[1][6:]) == bench.brick.now_ms - 1 - behind
    start(bench, "loop.rxe")
    bench.brick.tick(10)
    assert tick.decode(ask(bench, tick.read())[1][6:]) == bench.brick.now_ms - 1


@pytest.mark.parametrize("waits", [1, 30])
def test_the_button_of_the_map_waits_while_a_program_runs(bench, waits):
    start(bench, "loop.rxe")
    bench.brick.tick(waits)
    ask(bench, UI.field("Button").write(3))
    assert observe(bench, UI.field("Button").read(), 30) == [("03", 30)]
    ask(bench, direct.StopProgram())
    assert observe(bench, STATE, 4) == [("e60e", 1), ("e00e", 1), ("8005", 1), ("8006", 1)]


@pytest.mark.parametrize(
    ("waits", "held", "passes"), [(1, 4, 4), (1, 5, 5), (1, 20, 4), (6, 1, 2), (6, 2, 5), (7, 1, 5)]
)
def test_enter_delays_a_start_while_it_is_held(bench, waits, held, passes):
    bench.brick.tick(bench.brick.now_ms % 2)
    start(bench, "loop.rxe")
    bench.brick.tick(waits - 1)
    bench.control("!button 8")
    bench.control(f"!tick {held}")
    bench.control("!button 0")
    assert observe(bench, STATUS, 12)[0] == ("00", passes)


def test_a_start_clears_the_counters_of_releases(bench):
    for mask in (2, 0, 2, 0):
        bench.control(f"!button {mask}")
        bench.control("!tick 4")
    counters = system.IOMapRead(BUTTON.module_id, 8, 5)
    assert observe(bench, counters, 1) == [("0200020002", 1)]
    start(bench, "loop.rxe")
    assert observe(bench, counters, 12) == [("0200020002", 8), ("0200000000", 4)]


def test_hidden_icons_stay_and_change_with_the_next_sample_after_they_are_shown(bench):
    icons = system.IOMapRead(DISPLAY.module_id, DISPLAY.field("StatusIcons").offset, 4)
    bench.control(f"!tick {6015 - bench.brick.now_ms + 167}")
    ask(bench, UI.field("Flags").write(0))
    assert observe(bench, icons, 600) == [("1a210211", 600)]
    ask(bench, UI.field("Flags").write(0x80))
    assert observe(bench, icons, 200)[0] == ("1a210211", 63)


REST = [DISPLAY.field(name) for name in ("EraseMask", "UpdateMask", "StatusIcons", "Flags")]
REST += [UI.field(name) for name in ("BatteryVoltage", "Flags", "State", "SleepTimer", "BatteryState")]


@pytest.mark.parametrize("firmware", FIRMWARES)
@pytest.mark.parametrize("sleep_min", [0, 1])
@pytest.mark.parametrize("passes", [10_021, 59_990, 100_000, 350_700])
def test_a_long_rest_ends_as_if_each_sample_of_the_battery_had_been_taken(firmware, sleep_min, passes):
    once, often = (Bench(SimBrick(firmware=firmware)) for _ in range(2))
    for each in (once, often):
        ask(each, UI.field("SleepTimeout").write(sleep_min))
        each.brick.ui.set_battery(each.brick.ui.battery.raw - 30)
    once.brick.tick(passes)
    for begin in range(0, passes, 1000):
        often.brick.tick(min(1000, passes - begin))
    for _ in range(200):
        assert [ask(once, each.read()) for each in REST] == [ask(often, each.read()) for each in REST]
        for each in (once, often):
            each.brick.tick(1)


@pytest.mark.parametrize(("firmware", "active"), [("1.29", False), ("1.05", False), ("1.32", True)])
def test_exit_with_enter_does_not_stop_a_program_of_1_32(firmware, active):
    bench = Bench(SimBrick(firmware=firmware))
    store(bench.brick, "a.rxe", assemble(Variables(), [[0x4025, 0]]))
    ask(bench, direct.StartProgram("a.rxe"))
    bench.control("!tick 10")
    bench.control("!button 9")
    bench.control("!tick 5")
    assert bench.brick.command.active is active
