"""Measure the simulated firmware: telegrams, passes, memory, and programs against real time. Times are CPU time."""

from __future__ import annotations

import statistics
import time
import tracemalloc
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

from firmware_protocol.direct import GetBatteryLevel, GetInputValues, GetOutputState, SetOutputState, StartProgram
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, RegulationMode, RunState
from sim_backend.devices.analog import AnalogInput
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.firmware.vm.rxe import Type

from .bench import REPEATS, Figure, at_least, at_most
from .faults.assembler import Variables, Words, assemble, instruction, store

TELEGRAMS, PASSES, PROGRAM_MS, BRICKS = 3_000, 3_000, 1_000, 10
TELEGRAMS_GOAL, PASSES_GOAL, MEMORY_GOAL_MB, PROGRAMS_GOAL = 150_000, 50, 6, 200

RECORDED = Path(__file__).parents[2] / "tests" / "golden" / "programs"
ONCE_MS, STEP_MS = 3_000, 50
"""A recorded program runs until it ends, at most this long, in steps of this."""

_START_MS = 20
_PASSES_PER_S = 1000
_ADD, _MUL, _INDEX, _REPLACE, _SUBSET, _TO_TEXT, _TO_NUMBER, _JOIN, _PART = (
    *(0x00, 0x03, 0x15, 0x16, 0x19),
    *(0x1F, 0x20, 0x21, 0x22),
)
_FILL, _JUMP, _BRANCH_IF, _SET_OUTPUT, _GET_INPUT, _GET_OUTPUT, _WAIT, _TICK = (
    *(0x1A, 0x25, 0x26, 0x31),
    *(0x32, 0x33, 0x34, 0x35),
)
_ELEMENTS = 50
_NONE, _LESS = 0xFFFF, 0
_SCALED, _ROTATION, _POWER = 4, 14, 2
_FIELDS = (0, 1, 2, 5, 6, 7, 8, 10)


def measure_firmware() -> Iterable[Figure]:
    """Measure one brick in this process; takes about 10 s."""
    yield at_least("telegrams of a brick in process, median of three kinds", _telegrams_hz(), "1/s", TELEGRAMS_GOAL)
    yield at_least("passes with three regulated motors / real time", _passes_ratio(), "x", PASSES_GOAL)
    yield at_most("memory of a brick that runs a program", _brick_mb(), "MB", MEMORY_GOAL_MB)
    ratios = {name: _program_ratio(content) for name, content in programs().items()}
    ratios["counts, firmware 1.05"] = _program_ratio(_loop(_count, floats=()), "1.05")
    for name, ratio in ratios.items():
        yield Figure(f"program that {name} / real time", ratio, "x")
    yield at_least("programs / real time, median", statistics.median(ratios.values()), "x", PROGRAMS_GOAL)
    yield at_least("programs / real time, slowest", min(ratios.values()), "x", PROGRAMS_GOAL)
    once = [_once_s(file) for file in sorted(RECORDED.glob("*.rxe"))]
    yield Figure("CPU time of the recorded programs, each once", sum(cpu_s for _, cpu_s in once), "s")
    ratio = statistics.median(simulated_s / cpu_s for simulated_s, cpu_s in once)
    yield Figure("recorded programs, each once / real time, median", ratio, "x")


def programs() -> Mapping[str, bytes]:
    """Return endless programs by what they do."""
    return {
        "counts": _loop(_count),
        "waits": _loop(
            lambda count, one, limit, *_: [instruction(_ADD, count, count, one), instruction(_WAIT, _NONE, limit)]
        ),
        "polls a sensor": _loop(lambda count, _, limit, port, *__: _poll(_GET_INPUT, _SCALED, count, port, limit)),
        "polls a motor": _loop(lambda count, _, limit, port, *__: _poll(_GET_OUTPUT, _ROTATION, count, port, limit)),
        "polls the time": _loop(
            lambda count, _, limit, *__: [
                instruction(_TICK, count),
                instruction(_BRANCH_IF, -2, limit, count, flags=_LESS),
            ]
        ),
        "calculates with floats": _loop(
            lambda *numbers: [
                instruction(_MUL, numbers[5], numbers[5], numbers[6]),
                instruction(_ADD, numbers[5], numbers[5], numbers[6]),
            ]
        ),
        "fills an array": _loop(_fill),
        "calculates with arrays": _loop(lambda *numbers: [instruction(_ADD, numbers[7], numbers[7], numbers[1])]),
        "copies parts of arrays": _loop(_copy),
        "joins texts": _loop(lambda count, one, _, __, text, *___: _join(count, one, text)),
        "reads texts": _loop(lambda count, one, limit, _, text, *__: _read(count, one, limit, text)),
        "sets motors": _loop(lambda count, _, __, port, *___: [instruction(_SET_OUTPUT, port, _POWER, count)]),
        "changes eight fields of a motor": _loop(_change_motor),
    }


def _loop(body: Callable[..., list[Words]], floats: Iterable[float] = (1.0, 0.5)) -> bytes:
    """Return a program that repeats instructions on: count, 1, limit, port 0, text, two floats, array.

    The program makes the array first, so that it lies at a whole word, as those of compiled programs do.
    """
    variables = Variables()
    numbers = [variables.number(value) for value in (0, 1, 3, 0)]
    text = variables.text(b"text\0")
    decimals = [variables.number(value, Type.FLOAT) for value in floats]
    array = variables.array([], Type.SLONG)
    begin = instruction(_FILL, array, numbers[-1], variables.number(_ELEMENTS))
    lines = body(*numbers, text, *decimals, array)
    return assemble(variables, [begin, *lines, instruction(_JUMP, -sum(map(len, lines)))])


def _poll(opcode: int, field: int, count: int, port: int, limit: int) -> list[Words]:
    return [instruction(opcode, count, port, field), instruction(_BRANCH_IF, -4, limit, count, flags=_LESS)]


def _fill(count: int, one: int, limit: int, _: int, __: int, ___: int, ____: int, array: int) -> list[Words]:
    return [
        instruction(_REPLACE, array, array, limit, count),
        instruction(_INDEX, count, array, limit),
        instruction(_ADD, count, count, one),
    ]


def _count(count: int, one: int, *_: int) -> list[Words]:
    return [instruction(_ADD, count, count, one)]


def _copy(count: int, one: int, _: int, __: int, ___: int, ____: int, _____: int, array: int) -> list[Words]:
    return [instruction(_SUBSET, array, array, _NONE, _NONE), instruction(_ADD, count, count, one)]


def _join(count: int, one: int, text: int) -> list[Words]:
    return [
        instruction(_ADD, count, count, one),
        instruction(_TO_TEXT, text, count),
        instruction(_JOIN, text, text, text),
    ]


def _read(count: int, one: int, limit: int, text: int) -> list[Words]:
    return [
        instruction(_TO_TEXT, text, count),
        instruction(_PART, text, text, _NONE, limit),
        instruction(_TO_NUMBER, count, _NONE, text, _NONE, _NONE),
        instruction(_ADD, count, count, one),
    ]


def _change_motor(count: int, one: int, _: int, port: int, *__: int) -> list[Words]:
    fields = [argument for field in _FIELDS for argument in (field, count)]
    return [instruction(_SET_OUTPUT, port, *fields), instruction(_ADD, count, count, one)]


def brick_with(program: bytes | None = None, firmware: str = "1.29") -> SimBrick:
    """Return a brick with motors and a sensor, which runs a program."""
    brick = SimBrick(firmware=firmware)
    for port in "ABC":
        brick.attach_motor(port, BenchMotor())
    brick.attach_sensor(1, AnalogInput(lambda: 512))
    if program is not None:
        store(brick, "bench.rxe", program)
        brick.receive(StartProgram("bench.rxe").encode())
        brick.tick(_START_MS)
    return brick


def _cpu_s(action: Callable[[], object]) -> float:
    """Return the shortest CPU time of several; the others were disturbed."""
    times = []
    for _ in range(REPEATS):
        begun = time.process_time()
        action()
        times.append(time.process_time() - begun)
    return min(times)


def _telegrams_hz() -> float:
    brick = brick_with()
    rates = []
    for telegram in (GetBatteryLevel(), GetOutputState(OutputPort.A), GetInputValues(InputPort.IN_1)):
        request = telegram.encode()
        rates.append(TELEGRAMS / _cpu_s(lambda: [brick.receive(request) for _ in range(TELEGRAMS)]))  # noqa: B023 - called at once
    return statistics.median(rates)


def _passes_ratio() -> float:
    brick = brick_with()
    mode = OutputMode.MOTOR_ON | OutputMode.REGULATED
    brick.receive(SetOutputState(OutputPort.ALL, 75, mode, RegulationMode.SPEED, 0, RunState.RUNNING, 0).encode())
    return PASSES / _PASSES_PER_S / _cpu_s(lambda: brick.tick(PASSES))


def _brick_mb() -> float:
    content = programs()["counts"]
    brick_with(content)
    tracemalloc.start()
    bricks = [brick_with(content) for _ in range(BRICKS)]
    used = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    return used / len(bricks) / 1e6


def _program_ratio(content: bytes, firmware: str = "1.29") -> float:
    brick = brick_with(content, firmware)
    if not brick.command.active:
        raise RuntimeError("a program of the benchmark does not run")
    return PROGRAM_MS / 1000 / _cpu_s(lambda: brick.tick(PROGRAM_MS))


def _once_s(file: Path) -> tuple[float, float]:
    """Run a recorded program once; return the simulated seconds and those of the CPU, which compiles too."""
    brick = brick_with(file.read_bytes(), "1.32" if file.stem.endswith(".1.32") else "1.29")
    begun_s, simulated_ms = time.process_time(), 0
    while not simulated_ms or (brick.command.active and simulated_ms < ONCE_MS):
        brick.tick(STEP_MS)
        simulated_ms += STEP_MS
    return simulated_ms / 1000, time.process_time() - begun_s
