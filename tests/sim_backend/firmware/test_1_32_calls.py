"""System calls that only firmware 1.32 has, each answer as that firmware gave it. See docs/firmware.md section 8.6."""

import pytest

from firmware_protocol import direct
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.memory import SCALARS

CALL, FOREVER, CLUMP = 0x28, [0x4025, 0], 48
OPEN_READ, READ, CLOSE = 0, 3, 5
FIND_FIRST, FIND_NEXT, OPEN_WRITE_LINEAR, OPEN_WRITE, OPEN_READ_LINEAR = 83, 84, 85, 86, 87
HIGH_SPEED, SEEK, RESIZE, MEMORY, RESPONSE, TELL, RANDOM = 88, 90, 91, 96, 97, 98, 99
DISPLAY = 80
HANDLE = 1
"""Handle of the first file that a program opens; the program's own is 0."""


def called(number, *members, before=()):
    """The numbers among the arguments of a call after it, and the brick."""
    brick, variables = SimBrick(firmware="1.32"), Variables()
    store(brick, "d.txt", b"0123456789")
    store(brick, "l.txt", b"linear", linear=True)
    lines = [instruction(CALL, other, variables.call(*arguments)[0]) for other, *arguments in before]
    cluster, found = variables.call(*members)
    store(brick, "a.rxe", assemble(variables, [*lines, instruction(CALL, number, cluster), FOREVER]))
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(40)
    values = []
    for variable, member in zip(found, members, strict=True):
        if isinstance(member, int):
            kind, _, data = variables.table[variable]
            values.append(SCALARS[kind].unpack_from(brick.command.pool, CLUMP + data)[0])
    return values, brick


READING = (OPEN_READ, 7, 9, b"d.txt\0", 0)


@pytest.mark.parametrize(
    ("call", "before", "answer"),
    [
        ((FIND_FIRST, 7, 9, b"d.*\0", 77), (), [0, HANDLE, 10]),
        ((FIND_FIRST, 7, 9, b"none\0", 77), (), [0x8700, HANDLE, 0]),
        ((FIND_NEXT, 7, HANDLE, b"\0", 77), [(FIND_FIRST, 7, 9, b"*.txt\0", 0)], [0, HANDLE, 10]),
        ((FIND_NEXT, 7, HANDLE, b"\0", 77), [(FIND_FIRST, 7, 9, b"d.*\0", 0)], [0x8700, HANDLE, 0]),
        ((OPEN_WRITE_LINEAR, 7, 9, b"new.txt\0", 5), (), [0, HANDLE, 5]),
        ((OPEN_WRITE, 7, 9, b"d.txt\0", 5), (), [0x8F00, HANDLE, 5]),
        ((OPEN_WRITE, 7, 9, b"big.txt\0", 200_000), (), [0x8200, HANDLE, 200_000]),
        ((OPEN_READ_LINEAR, 7, 9, b"l.txt\0", 77), (), [0, HANDLE, 6]),
        ((OPEN_READ_LINEAR, 7, 9, b"d.txt\0", 77), (), [0x8600, HANDLE, 10]),
        ((OPEN_READ_LINEAR, 7, 9, b"none\0", 77), (), [0x8700, HANDLE, 0]),
        ((TELL, 7, HANDLE, 77), [READING], [0, HANDLE, 0]),
        ((TELL, 7, 5, 77), (), [0x9300, 5, 77]),
        ((RESIZE, 7, HANDLE, 5), [READING], [0, 0, 5]),
        ((HIGH_SPEED, 7, 0, 5, 0), (), [5, 0, 5, 0]),
        ((HIGH_SPEED, 7, 1, 5, 0), (), [1, 1, 5, 0]),
        ((HIGH_SPEED, 7, 2, 5, 0), (), [4, 2, 5, 0]),
        ((HIGH_SPEED, 7, 3, 5, 0), (), [0, 3, 5, 0]),
        ((RESPONSE, 7, 0, 9, 9, b"q"), (), [0, 0, 0, 9]),
    ],
)
def test_calls_return_what_the_firmware_returns(call, before, answer):
    assert called(*call, before=before)[0] == answer


@pytest.mark.parametrize(
    ("origin", "distance", "status", "position"),
    [
        (0, 3, 0, 3),
        (0, 10, 0, 10),
        (0, 11, 0x9C00, 2),
        (0, -1, 0x9C00, 2),
        (1, 2, 0, 4),
        (1, -1, 0, 1),
        (2, -3, 0, 7),
        (2, 1, 0x9C00, 2),
        (3, 1, 0, 2),
    ],
)
def test_a_program_sets_where_it_reads_on(origin, distance, status, position):
    two = [READING, (READ, 7, HANDLE, b"\0", 2)]
    seek = (SEEK, 7, HANDLE, origin, distance)
    assert called(*seek, before=two)[0][0] == status
    assert called(TELL, 7, HANDLE, 77, before=[*two, seek])[0] == [0, HANDLE, position]


@pytest.mark.parametrize(
    ("seed", "draws", "number"),
    [(None, 1, 48271), (None, 2, 182605794), (None, 3, 1291394886), (7, 1, 337897), (7, 2, 1278240558), (-5, 1, 48271)],
)
def test_random_numbers_are_those_of_lehmers_generator(seed, draws, number):
    seeds = [] if seed is None else [(RANDOM, seed, 1)]
    before = [*seeds, *[(RANDOM, 0, 0)] * (draws - 1)]
    assert called(RANDOM, 0, 0, before=before)[0] == [number, 0]


def test_the_arrays_can_be_moved_together():
    loose, _ = called(MEMORY, 7, 0, 9, 9)
    tight, _ = called(MEMORY, 7, 1, 9, 9)
    assert loose[2] - loose[3] == tight[2] - tight[3] == CLUMP
    assert tight[3] < loose[3]


def pixels(*calls):
    """The black pixels, from the bottom left, after calls of display functions."""
    *before, last = [(DISPLAY, 7, *call) for call in calls]
    display = called(*last, before=before)[1].display
    return {(x, y) for x in range(100) for y in range(64) if display.get(x, y)}


@pytest.mark.parametrize(
    ("function", "drawn"),
    [
        ((1, 0, 10, 20, 0, 0), {(10, 20)}),
        ((2, 0, 10, 20, 8, 0), {(8, 20), (9, 20), (10, 20)}),
        ((3, 0, 10, 20, 0, 18), {(10, 18), (10, 19), (10, 20)}),
        ((6, 0, 10, 20, 2, 3), {(x, y) for x in (10, 11) for y in (18, 19, 20)}),
        ((7, 0, 10, 20, 3, 2), {(10, 20), (11, 20), (12, 20), (10, 19), (12, 19)}),
        ((1, 1, 10, 20, 0, 0), set()),
        ((1, 2, 10, 20, 0, 0), {(10, 20)}),
        ((1, 0, 10, 70, 0, 0), set()),
        ((8, 0, 10, 20, 5, 5), set()),
    ],
)
def test_display_functions_draw(function, drawn):
    assert pixels(function) == drawn


def test_display_functions_erase_and_turn_pixels():
    area = (6, 0, 10, 20, 4, 4)
    assert len(pixels(area, (6, 1, 10, 20, 2, 4))) == 8
    assert len(pixels(area, (6, 2, 11, 20, 4, 4))) == 8
    assert pixels(area, (0, 0, 0, 0, 0, 0)) == set()
    letter = pixels((4, 1, 12, 2, 65, 0))
    assert len(letter) == 18
    assert all(12 <= x < 17 and 55 <= y < 62 for x, y in letter)
