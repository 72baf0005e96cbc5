"""Programs that are compiled in blocks do what their instructions do one by one."""

from __future__ import annotations

from random import Random

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.enhanced import SetInterpreterState
from firmware_protocol.enums import InterpreterState
from nxtdrive.tools.dev.faults.assembler import Variables, Words, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import VERSIONS
from sim_backend.firmware.vm import blocks
from sim_backend.firmware.vm.instructions import Branch, Cell, Effect, Ports, Translation
from sim_backend.firmware.vm.linear_loops import linear
from sim_backend.firmware.vm.rxe import Type

_ADD, _SUB, _NEG, _MUL, _COMPARE, _MOVE, _SET, _JUMP, _BRANCH_IF, _BRANCH_TEST = (
    *(0x00, 0x01, 0x02, 0x03, 0x11),
    *(0x1B, 0x1C, 0x25, 0x26, 0x27),
)
_SET_OUTPUT, _GET_INPUT, _WAIT, _TICK = 0x31, 0x32, 0x34, 0x35
_LESS, _NONE, _SCALED, _POWER = 0, 0xFFFF, 4, 2
_TYPES = (Type.SLONG, Type.ULONG, Type.SWORD, Type.UWORD, Type.SBYTE, Type.UBYTE)
_PASSES = 5


def _random_loop(random: Random) -> bytes:
    """An endless loop of calculations, some of them with branches."""
    variables = Variables()
    kind = random.choice((None, *_TYPES))
    names = [variables.number(random.choice((0, 1, 3, 200)), kind or random.choice(_TYPES)) for _ in range(4)]
    lines = list[Words]()
    for _ in range(random.randint(1, 7)):
        lines.append(_random_instruction(random, names))
        if random.random() < 0.2:  # over the next one
            lines.append(instruction(_BRANCH_IF, 8, *random.choices(names, k=2), flags=random.randrange(6)))
            lines.append(instruction(_ADD, *random.choices(names, k=3)))
    content: bytes = assemble(variables, [*lines, instruction(_JUMP, -sum(map(len, lines)))])
    return content


def _random_instruction(random: Random, names: list[int]) -> Words:
    opcode = random.choice((_ADD, _ADD, _SUB, _SUB, _NEG, _MUL, _COMPARE, _MOVE, _SET))
    if opcode == _SET:
        return instruction(opcode, random.choice(names), random.choice((0, 1, 0xFFFF)))
    return instruction(opcode, *random.choices(names, k=2 if opcode in (_MOVE, _NEG) else 3))


def _loop_with_pauses(random: Random) -> bytes:
    """An endless loop that calculates for some passes, and then does something with the rest of the brick."""
    variables = Variables()
    count, one, many, port, tick, rest = (
        variables.number(value) for value in (0, 1, random.randint(50, 3000), 0, 0, 2)
    )
    calculation = [instruction(_ADD, count, count, one), instruction(_BRANCH_IF, -4, count, many, flags=_LESS)]
    action = random.choice(
        (
            instruction(_TICK, tick),
            instruction(_WAIT, _NONE, rest),
            instruction(_GET_INPUT, tick, port, _SCALED),
            instruction(_SET_OUTPUT, port, _POWER, count),
        )
    )
    lines = [*calculation, action, instruction(_ADD, rest, tick, one), instruction(_SET, count, 0)]
    content: bytes = assemble(variables, [*lines, instruction(_JUMP, -sum(map(len, lines)))])
    return content


def _brick(content: bytes, firmware: str = "1.32") -> SimBrick:
    brick = SimBrick(firmware=firmware)
    store(brick, "loop.rxe", content)
    brick.receive(StartProgram("loop.rxe").encode())
    brick.tick(20)
    return brick


@pytest.mark.parametrize("often", [1, blocks.OFTEN])
@pytest.mark.parametrize("seed", range(25))
def test_a_pass_does_the_same_as_its_instructions_one_by_one(
    seed: int, often: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(blocks, "OFTEN", often)
    content = _random_loop(Random(seed))
    at_once, in_steps = _brick(content), _brick(content)
    at_once.tick(_PASSES)
    for _ in range(_PASSES * VERSIONS["1.32"].dialect.timing.instructions):
        in_steps.receive(SetInterpreterState(InterpreterState.STEP).encode())
        in_steps.tick()
    assert at_once.command.pool == in_steps.command.pool
    assert at_once.command.place == in_steps.command.place


@pytest.mark.parametrize("firmware", VERSIONS)
@pytest.mark.parametrize("seed", range(8))
def test_passes_at_once_do_the_same_as_one_by_one(seed: int, firmware: str) -> None:
    content = _loop_with_pauses(Random(seed))
    at_once, one_by_one = _brick(content, firmware), _brick(content, firmware)
    for passes in (1, 50, 200, 3, 77):
        at_once.tick(passes)
        for _ in range(passes):
            one_by_one.tick()
        assert at_once.command.pool == one_by_one.command.pool
        assert at_once.command.place == one_by_one.command.place


def _calculation(cells: str, factors: tuple[int, ...] | None) -> Effect:
    return Effect(
        ("",), Ports.NOTHING, cells=tuple(Cell(each[0], int(each[1])) for each in cells.split()), factors=factors
    )


def test_repeats_of_sums_are_a_power_of_a_matrix() -> None:
    repeated = linear(
        [
            _calculation("b4 b4", (1, 1)),
            _calculation("b5 b5 b4", (1, -1, 0)),
            _calculation("b6 b5", (1, 0)),
            _calculation("b7", (9,)),
        ]
    )
    assert repeated is not None
    cells = {4: 250, 5: 7, 6: 0, 7: 0}
    expected = dict(cells)
    for _ in range(1000):
        expected[4] = expected[4] + 1 & 255
        expected[5] = expected[5] - expected[4] & 255
        expected[6] = expected[5]
        expected[7] = 9
    names = {"B": cells}
    exec(f"{repeated.factors} = {repeated.powers(1000)}\n{repeated.statement}", names)
    assert cells == expected


@pytest.mark.parametrize(
    "path",
    [
        [_calculation("b4 i4", (1, 1))],
        [_calculation("i4 i4 i5", None)],
        [_calculation("f4 f4 f5", (1, 1, 0))],
        [Effect(("b[4] = now()",), Ports.NOTHING, reads_clock=True)],
        [_calculation("b4 b4", (1, 1)), Branch("b[4] < b[5]", 0, 2, (Cell("b", 4), Cell("b", 5)))],
        [],
    ],
    ids=["sizes", "product", "floats", "clock", "branch", "nothing"],
)
def test_other_loops_are_not_sums(path: list[Translation]) -> None:
    assert linear(path) is None
