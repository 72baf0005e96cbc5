"""Regulation to a position and the options of the limit, in firmware 1.32: docs/firmware.md section 9.8.

Motor A is locked, and its D gain shows in its PWM by how much the position error changed in a period.
"""

import pytest

from firmware_protocol.direct import SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.iomap import OUTPUT, OutputFlag
from nxtdrive.tools.conformance.bench import Bench
from sim_backend.firmware.brick import SimBrick

POSITION, SPEED, SYNC = 4, 1, 2
HOLD_AT_LIMIT, RAMP_DOWN_TO_LIMIT = 0x10, 0x20
LOCKED = "!motor 0 590 60 12 150 5 1"


def written(name: str, *values: int, port: int = 0) -> str:
    spot = OUTPUT.field(name, port) if "[" not in name else OUTPUT.field(name)
    return f"0195010002{'00'}{spot.offset:02x}00{len(values):02x}00{bytes(value & 0xFF for value in values).hex()}"


def started(power: int, limit: int, regulation: int, options: int = 0, port: int = 0, turn: int = 0) -> str:
    mode = OutputMode(0x07 | options)
    run = SetOutputState(
        OutputPort(port), power, mode, RegulationMode(regulation), turn, RunState.RUNNING, limit & 0xFFFF_FFFF
    )
    return run.encode().hex()


def bench(*lines: str) -> Bench:
    made = Bench(SimBrick(firmware="1.32"))
    for line in lines:
        made.answer(line)
    return made


def gains(p: int, i: int, d: int) -> list[str]:
    return [written("RegPParameter", p, i, d), written("Flags", OutputFlag.PID)]


def bounds(speed: int, acceleration: int) -> list[str]:
    return [written("MaxSpeed", speed, acceleration), written("Flags", OutputFlag.PID)]


def powers(made: Bench, count: int, passes: int = 101) -> list[int]:
    found = []
    for _ in range(count):
        made.control(f"!tick {passes}")
        found.append(int(made.control("!motors").split("/")[0]))
    return found


@pytest.mark.parametrize(
    ("power", "limit", "speeds"),
    [
        (0, 90, [20, 40, 34, 14, -6, -21, -1, 19, -1, -17, 3, 15, -5, -12, 8, 0]),
        (0, 500, [20, 40, 60, 80, 80, 80, 74, 54, 34, 14, -6, -26, -12, 8, 0]),
        (50, 1000, [70, 80, 80]),
        (-50, 1000, [-30, -10, 10, 30, 50, 70, 80, 80]),
        (0, -1000, [-20, -40, -60, -80, -80]),
        (0, -(2**31), [0, 0]),
    ],
)
def test_the_wanted_position_goes_to_the_limit_and_back(power, limit, speeds):
    made = bench(LOCKED, *gains(0, 0, 64), "!tick 50", started(power, limit, POSITION))
    assert powers(made, len(speeds)) == speeds


@pytest.mark.parametrize(
    ("speed", "acceleration", "limit", "speeds"),
    [
        (40, 20, 200, [20, 40, 40, 40, 40, 28, 8, -12, -12, 8, 0]),
        (80, 1, 10, [1, 2, 3, 2, 2, 1, 0, -1, 0]),
        (80, 0, 200, [80, 80, 40, 0]),
        (0, 20, 90, [90, 0]),
        (-40, 20, 200, [-20, -40, -40, -40]),
        (40, -5, 200, [5, 10, 15, 20]),
        (100, -16, -90, [-16, -32]),
        (127, 127, 500, [100, 100, 100, 100, 0, -45]),
        (-128, -128, 200, [-100, 0, -100, 0]),
    ],
)
def test_speed_and_acceleration_have_bounds(speed, acceleration, limit, speeds):
    made = bench(LOCKED, *gains(0, 0, 64), *bounds(speed, acceleration), "!tick 50", started(0, limit, POSITION))
    assert powers(made, len(speeds)) == speeds


@pytest.mark.parametrize(
    ("period", "regulation", "power", "limit", "speeds"),
    [
        (20, POSITION, 0, 100, [1, 1, 3, 3, 4, 5, 5, 7, 7, 8]),
        (50, POSITION, 0, 100, [5, 10, 15, 20, 22, 17]),
        (50, SPEED, 7, 0, [3, 4, 3, 4]),
        (20, SPEED, -33, 0, [-7, -6, -7, -6, -7, -7]),
        (254, SPEED, 7, 0, [18, 18, 17, 18]),
        (0, SPEED, 50, 0, [0, 0]),
    ],
)
def test_the_period_can_be_changed(period, regulation, power, limit, speeds):
    made = bench(LOCKED, *gains(0, 0, 64), written("PwmFreq", period), "!tick 50", started(power, limit, regulation))
    assert powers(made, len(speeds), period + 1) == speeds


def test_a_period_of_255_is_never_over():
    made = bench(LOCKED, written("PwmFreq", 255), "!tick 50", started(0, 500, POSITION))
    assert powers(made, 3, 300) == [0, 0, 0]


@pytest.mark.parametrize(("options", "power"), [(0, 50), (1, 80)])
def test_the_parts_of_a_regulator_need_not_be_limited(options, power):
    made = bench(
        LOCKED,
        *gains(32, 0, 0),
        written("RegulationOptions", options),
        *bounds(0, 0),
        "!tick 50",
        started(0, 160, POSITION),
    )
    assert powers(made, 2) == [power, power]


def test_the_wanted_position_does_not_follow_the_motor_but_resets_with_its_count():
    turned = [LOCKED, *gains(0, 0, 64), "!turn 0 30", "!tick 300"]
    assert powers(bench(*turned, started(0, 100, POSITION)), 2) == [-10, 40]
    assert powers(bench(*turned, "002100", started(0, 100, POSITION)), 2) == [20, 40]


@pytest.mark.parametrize(
    ("options", "regulation", "motors"),
    [
        (0, SPEED, "0/0/463"),
        (HOLD_AT_LIMIT, SPEED, "-3/1/478"),
        (RAMP_DOWN_TO_LIMIT, SPEED, "0/0/470"),
        (HOLD_AT_LIMIT | RAMP_DOWN_TO_LIMIT, SPEED, "-4/1/456"),
        (HOLD_AT_LIMIT, POSITION, None),
    ],
)
def test_options_say_what_happens_at_the_limit(options, regulation, motors):
    made = bench(started(75, 360, regulation, options), "!tick 2500")
    if motors is None:
        assert made.control("!motors") == bench(started(75, 360, regulation), "!tick 2500").control("!motors")
    else:
        assert made.control("!motors").startswith(motors)


@pytest.mark.parametrize(
    ("before", "limit", "threshold"), [("!tick 1", 360, 288), ("!tick 1", 361, 288), ("!turn 0 100", 360, 288)]
)
def test_the_ramp_begins_at_80_percent_of_the_absolute_limit(before, limit, threshold):
    made = bench(before, "!tick 5", started(75, limit, 0, RAMP_DOWN_TO_LIMIT))
    control = made.brick.output.controls[0]
    while control.run_state == RunState.RUNNING:
        made.control("!tick 1")
    assert (control.count, control.run_state) == (threshold, RunState.RAMP_DOWN)


@pytest.mark.parametrize(("turn", "targets"), [(0, [51, 51]), (50, [50, 10])])
def test_synchronised_motors_only_change_to_the_ramp(turn, targets):
    made = bench(started(50, 300, SYNC, RAMP_DOWN_TO_LIMIT, port=3, turn=turn), "!tick 800")
    controls = made.brick.output.controls[:2]
    assert [control.target_speed for control in controls] == targets
    assert [control.run_state for control in controls] == [RunState.RAMP_DOWN] * 2
