"""Types that system calls take their arguments for, as the firmware answered. See docs/firmware.md 8.4 and 8.6."""

import pytest

from firmware_protocol.direct import StartProgram
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick

CALL, FOREVER = 0x28, [0x4025, 0]
CLUMP = {"1.29": 28, "1.32": 48}
FIVES = 0x5555_5555
DELETE, CLOSE, OPEN, WRITE, BUTTON, RADIO, CONNECT, LOG_TIMES, READ_MAP, SEEK, RANDOM = (
    8,
    5,
    0,
    4,
    20,
    35,
    36,
    45,
    32,
    90,
    99,
)


def fives(low):
    return FIVES & ~0xFF | low


@pytest.mark.parametrize(
    ("firmware", "number", "members", "expected"),
    [
        ("1.29", DELETE, (FIVES, b"none\0"), (0x5555_8700,)),
        ("1.29", CLOSE, (FIVES, FIVES), (0x5555_9300, FIVES)),
        ("1.29", OPEN, (FIVES, FIVES, b"none\0", FIVES), (0x5555_8700, fives(1), FIVES)),
        ("1.29", WRITE, (FIVES, fives(9), b"ab\0", FIVES), (0x5555_9300, fives(9), 0x5555_0000)),
        ("1.29", BUTTON, (FIVES, fives(4), FIVES, FIVES, FIVES), (fives(0xF0), fives(4), fives(0), fives(0), FIVES)),
        ("1.29", BUTTON, (FIVES, fives(1), FIVES, FIVES, 0), (fives(0), fives(1), fives(0), fives(0), 0)),
        ("1.29", LOG_TIMES, (FIVES, FIVES, FIVES), (FIVES, 0, 0)),
        ("1.29", RADIO, (FIVES, fives(0)), (fives(1), fives(0))),
        ("1.32", RADIO, (FIVES, fives(0)), (0x5555_0001, fives(0))),
        ("1.32", CONNECT, (FIVES, FIVES, b"x\0", FIVES), (0x5555_9500, FIVES, FIVES)),
        ("1.32", SEEK, (FIVES, fives(1), FIVES, FIVES), (0x5555_0000, fives(0), FIVES, FIVES)),
        ("1.32", READ_MAP, (FIVES, b"Command.mod\0", 2, 801, b"\0"), (fives(0xED), 2, 801)),
        ("1.32", READ_MAP, (FIVES, b"Command.mod\0", 2, 255, b"\0"), (fives(0), 2, 255)),
        ("1.32", RANDOM, (-5, 1), (1, 1)),
    ],
)
def test_a_call_takes_its_arguments_for_their_types_whatever_is_declared(firmware, number, members, expected):
    variables = Variables()
    cluster, found = variables.call(*members)
    brick = SimBrick(firmware=firmware)
    store(brick, "a.rxe", assemble(variables, [instruction(CALL, number, cluster), FOREVER]))
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(20)
    numbers = [variable for variable, member in zip(found, members, strict=True) if isinstance(member, int)]
    places = [CLUMP[firmware] + variables.table[variable][2] for variable in numbers]
    assert tuple(int.from_bytes(brick.command.pool[at : at + 4], "little") for at in places) == expected


def test_reading_a_button_can_clear_its_counters_of_releases():
    variables = Variables()
    cluster, _ = variables.call(0, 3, 0, 0, 1)
    brick = SimBrick()
    store(
        brick,
        "a.rxe",
        assemble(variables, [instruction(0x34, 0xFFFF, 0xFFFF), instruction(CALL, BUTTON, cluster), FOREVER]),
    )
    button = brick.button.buttons[3]
    button.presses = button.long_presses = 2
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(7)
    button.short_releases = button.long_releases = button.releases = 1
    brick.tick(20)
    assert (button.presses, button.long_presses) == (2, 2)
    assert (button.short_releases, button.long_releases, button.releases) == (0, 0, 0)


def test_the_data_log_tells_that_it_drops_its_oldest_record():
    variables = Variables()
    calls = [variables.call(FIVES, b"12345\0") for _ in range(31)]
    brick = SimBrick()
    store(brick, "a.rxe", assemble(variables, [*(instruction(CALL, 44, cluster) for cluster, _ in calls), FOREVER]))
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(20)
    places = [CLUMP["1.29"] + variables.table[members[0]][2] for _, members in calls]
    assert [brick.command.pool[at] for at in places] == [0] * 30 + [0x10]
