"""Programs made to exhaust the computer that simulates them end with an error, in bounded memory and time."""

import struct

import pytest

from firmware_protocol.direct import StartProgram
from firmware_protocol.iomap import COMMAND, ProgramStatus
from firmware_protocol.system import IOMapRead
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.mailboxes import Mailboxes
from sim_backend.firmware.vm.aggregates import compare
from sim_backend.firmware.vm.data import Data, Place
from sim_backend.firmware.vm.memory import Layout, Memory, OutOfMemory
from sim_backend.firmware.vm.rxe import Clump, Program, Type, Variable

LEVELS = 4
LAYOUT = Layout(clump=28, fire_count=13, growth=25, doubly_linked=True, types=bytes(range(256)))
CONCATENATE, ACQUIRE, FINISH, EQUAL = 0x18, 0x2C, 0x2A, 4


def nested(length, element):
    """Data with one variable, an array of arrays of arrays of bytes, all of which are the same array."""
    descriptors = struct.pack("<5H", 4, 10, 2, 0xFFFF, 1) + struct.pack("<5H", 24, element, length, 0, 0xFFFF)
    values = struct.pack("<H", 1) + descriptors + struct.pack("<H", 1) * length
    table = [Variable(Type.ARRAY, False, 0)] * (LEVELS - 1) + [Variable(Type.UBYTE, True, 0)]
    clumps = (Clump(0, 0, 1),)
    program = Program(tuple(table), LEVELS, values, len(values) + 2, 4, 2, len(values) - 2, 0, 1, 4, clumps, ())
    memory = Memory(program, LAYOUT)
    memory.fill()
    return Data(memory, None)


def run_program(*clumps, variables, **options):
    brick = SimBrick()
    content = assemble(variables, *clumps, **options)
    store(brick, "a.rxe", content)
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(10)
    return brick


def status(brick):
    reply = brick.receive(COMMAND.field("ProgStatus").read().encode())
    return ProgramStatus(IOMapRead.decode_reply(reply).data[0])


@pytest.mark.parametrize(("length", "element"), [(200, 2), (5000, 0)])
def test_arrays_that_contain_themselves_are_not_read_to_the_end(length, element):
    with pytest.raises(OutOfMemory):
        compare(nested(length, element), EQUAL, Place(0), Place(0))


def test_the_pool_keeps_its_size_when_a_message_does_not_fit_its_elements():
    memory = nested(1, 2).memory
    size, array = len(memory.pool), memory.new_array(100)
    memory.set_bytes(array, b"less than one element\0")
    assert len(memory.pool) == size


def test_messages_keep_to_the_pool_when_the_program_has_damaged_its_descriptors():
    memory = nested(1, 2).memory
    boxes = Mailboxes(memory)
    boxes.write(0, b"hello\0")
    size, start = len(memory.pool), memory.base + memory.descriptors
    memory.pool[start:] = b"\xff" * (size - start)
    boxes.read(0, remove=True)
    assert len(memory.pool) == size


def test_an_array_does_not_grow_beyond_the_pool():
    variables = Variables()
    target, text = variables.text(), variables.text(bytes(range(1, 201)))
    brick = run_program([instruction(CONCATENATE, target, *[text] * 10_000)], variables=variables)
    assert status(brick) is ProgramStatus.ERROR
