"""The Tick of the Command map after an abort: the clumps of the next program wake up by it."""

import pytest

from firmware_protocol import direct
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.vm.data import NONE

SYSCALL, WAIT, PLAY_TONE, FOREVER = 0x28, 0x34, 10, [0x4025, 0]


def nap_and_tone():
    variables = Variables()
    nap, (tone, _) = variables.number(50), variables.call(0, 440, 500, 0, 2)
    return assemble(
        variables, [FOREVER], [instruction(WAIT, NONE, nap), instruction(SYSCALL, PLAY_TONE, tone), FOREVER]
    )


def passes_of_the_nap(brick):
    brick.receive(direct.StartProgram("nap.rxe").encode())
    brick.tick(9)
    passes = 0
    while not brick.sound.state and passes < 100:
        brick.tick()
        passes += 1
    return passes


@pytest.mark.parametrize(("firmware", "less"), [("1.05", 0), ("1.29", 1), ("1.32", 1)])
def test_a_nap_ends_earlier_if_it_began_while_the_tick_was_one_behind(firmware, less):
    brick = SimBrick(firmware=firmware)
    store(brick, "nap.rxe", nap_and_tone())
    first = passes_of_the_nap(brick)
    brick.receive(direct.StopProgram().encode())
    brick.tick(900)
    assert passes_of_the_nap(brick) == first - less
