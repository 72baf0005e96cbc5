"""Programs made to exhaust the computer that simulates them end with an error, in bounded memory and time."""

import struct
import tracemalloc

import pytest

from firmware_protocol.direct import RECORD_LIMIT, DatalogRead, StartProgram
from firmware_protocol.iomap import COMMAND, ProgramStatus
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead, IOMapWrite
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.display import DisplayModule
from sim_backend.firmware.mailboxes import LOG, Mailboxes
from sim_backend.firmware.vm import instructions, task
from sim_backend.firmware.vm.aggregates import compare
from sim_backend.firmware.vm.array_descriptor import LENGTH_AT
from sim_backend.firmware.vm.data import ERR_MEM, NO_FIELDS, Data, Place
from sim_backend.firmware.vm.memory import Memory, OutOfMemory
from sim_backend.firmware.vm.pool_layout import Layout
from sim_backend.firmware.vm.rxe import Clump, Header, Program, Type, Variable

LEVELS = 4
LAYOUT = Layout(clump=28, fire_count=13, growth=25, doubly_linked=True, types=bytes(range(256)))
ADD, CONCATENATE, CALL, ACQUIRE, FINISH, PRINT, EQUAL = 0x00, 0x18, 0x28, 0x2C, 0x2A, 0x6A, 4
PICTURE_OF_BYTES, LINE = 92, 15
FILLED, MAPPED = 0x20, 0x1100
"""Options of a drawing, and a coordinate that is the first parameter by the first map."""
OUT_OF_MEMORY = ERR_MEM & 0xFF
"""Status of a program in firmware 1.32."""


def nested(length, element):
    """Data with one variable, an array of arrays of arrays of bytes, all of which are the same array."""
    descriptors = struct.pack("<5H", 4, 10, 2, 0xFFFF, 1) + struct.pack("<5H", 24, element, length, 0, 0xFFFF)
    values = struct.pack("<H", 1) + descriptors + struct.pack("<H", 1) * length
    table = [Variable(Type.ARRAY, False, 0)] * (LEVELS - 1) + [Variable(Type.UBYTE, True, 0)]
    clumps = (Clump(0, 0, 1),)
    sizes = len(values) + 2, 4, len(values), 2, len(values) - 2
    header = Header(b"", 0, 5, LEVELS, *sizes, 0, 1, 4, 1, 0)
    program = Program(header, tuple(table), values, clumps, (), b"", table[-1])
    memory = Memory(program, LAYOUT)
    memory.fill()
    return Data(memory, None, NO_FIELDS, ())


def run_program(*clumps, variables, firmware="1.29", **options):
    brick = SimBrick(firmware=firmware)
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


@pytest.mark.parametrize("length", [61, 256, 65_535])
def test_a_record_of_the_data_log_is_cut_when_the_map_has_changed_its_length(length):
    brick = run_program([[0x4025, 0]], variables=Variables())
    brick.command.mailboxes.write(LOG, b"12345\0")
    pool = brick.command.pool
    descriptor = pool.index(struct.pack("<5H", pool.index(b"12345\0") - LAYOUT.clump, 1, 6, 0, 0xFFFF))
    address = COMMAND.field("MemoryPool").offset + descriptor + LENGTH_AT
    brick.receive(IOMapWrite.put(COMMAND.module_id, address, struct.pack("<H", length)).encode())
    reply = brick.receive(DatalogRead(remove=False).encode())
    assert reply[2:10] == bytes((Status.OK, length & 0xFF)) + b"12345\0"
    assert len(reply) == 4 + RECORD_LIMIT


class CountedTable(tuple):
    reads = 0

    def __getitem__(self, index):
        CountedTable.reads += 1
        return super().__getitem__(index)


def test_clusters_that_contain_each_other_are_measured_once():
    table = CountedTable([Variable(Type.CLUSTER, True, 1)] * 300 + [Variable(Type.UBYTE, True, 0)])
    header = Header(b"", 0, 5, len(table), 4, 4, *[0] * 7, 1)
    program = Program(header, table, b"", (Clump(0, 0, 1),), (), b"", table[-1])
    list(program.initial_values())
    assert CountedTable.reads < 4 * len(table)


def test_code_that_clumps_share_is_scanned_once(monkeypatch):
    clumps = [[instruction(FINISH, 0, 0)] * 20] * 10
    content = assemble(Variables(), *clumps)
    code_at = len(content) - sum(2 * len(line) for clump in clumps for line in clump)
    records = [content[at : at + 4] for at in range(code_at - 40, code_at, 4)]
    records[1::2], records[2::2] = [records[-1]] * 5, [records[0]] * 4  # every second clump is almost all of the code
    content = content[: code_at - 40] + b"".join(records) + content[code_at:]
    scans = []
    monkeypatch.setattr(task, "scanned", lambda code, at: scans.append(at) or instructions.scanned(code, at))
    brick = SimBrick()
    store(brick, "a.rxe", content)
    brick.receive(StartProgram("a.rxe").encode())
    brick.tick(10)
    assert scans
    assert len(scans) == len(set(scans))


def test_an_array_does_not_grow_beyond_the_pool():
    variables = Variables()
    target, text = variables.text(), variables.text(bytes(range(1, 201)))
    brick = run_program([instruction(CONCATENATE, target, *[text] * 10_000)], variables=variables)
    assert status(brick) is ProgramStatus.ERROR


@pytest.mark.parametrize("pattern", [b"%9999999d", b"%.9999999d", b"%-9999999c", b"%9999999f", b"%.9999999999d"])
def test_a_number_is_not_printed_in_more_characters_than_the_pool_has(pattern):
    variables = Variables()
    target, text, number = variables.text(), variables.text(pattern + b"\0"), variables.number(5)
    tracemalloc.start()
    brick = run_program([instruction(PRINT, target, text, number)], variables=variables, firmware="1.32")
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert status(brick) == OUT_OF_MEMORY
    assert most < 5_000_000


def shape(opcode, *words):
    return struct.pack(f"<{2 + len(words)}H", 2 + 2 * len(words), opcode, *words)


@pytest.mark.slow
@pytest.mark.parametrize(
    "content",
    [
        shape(7, 0, 50, 30, 0x6FFF) * 100,
        shape(1, 1, 1, 1, 0) + shape(3, 0, 1, 0, 0, 100, 64, 0, 0) * 1000,
        shape(6, FILLED, 0, 0, 99, 63) * 1000,
        shape(9, 0, 50, 30, 0x6FFF, 0x6FFF) * 100,
        shape(10, 0, 1000) * 2000,
        shape(10, FILLED, 1000) * 500,
        shape(2, 1, 3000, *[0, 0] * 3000) + shape(4, 0, MAPPED, MAPPED, 0) * 500,
    ],
    ids=["circles", "sprites", "filled rectangles", "ellipses", "polygons", "filled polygons", "a long map"],
)
def test_a_picture_of_more_than_the_brick_could_draw_ends_the_program(content):
    variables = Variables()
    variables.table.append((Type.CLUSTER, 0, 5))
    picture = len(variables.table) - 1
    variables.number()
    variables.call(0, 0)
    variables.text(content)
    variables.array([0], Type.SLONG)
    variables.number()
    code = [instruction(CALL, PICTURE_OF_BYTES, picture), [0x4025, 0]]
    assert status(run_program(code, variables=variables, firmware="1.32")) == OUT_OF_MEMORY


@pytest.mark.slow
def test_lines_far_beyond_the_screen_take_the_time_of_later_passes():
    variables = Variables()
    variables.table.append((Type.CLUSTER, 0, 4))
    line = len(variables.table) - 1
    variables.number()
    variables.call(-32_768, 0)
    variables.call(32_767, 0)
    variables.number()
    count, one = variables.number(), variables.number(1)
    code = [instruction(CALL, LINE, line), instruction(ADD, count, count, one), [0x4025, -7 & 0xFFFF]]
    brick = run_program(code, variables=variables)
    brick.tick(20)
    assert 0 < brick.command.pool[LAYOUT.clump + variables.table[count][2]] < 15
    assert status(brick) is ProgramStatus.RUNNING


def test_a_shape_beyond_the_screen_is_filled_on_the_screen_only():
    display = DisplayModule(enhanced=True)
    display.collect()
    display.circle(50, 32, 300)
    tracemalloc.start()
    display.combine(FILLED, fills=True)
    _, most = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert display.pixels == b"\xff" * len(display.pixels)
    assert most < 5_000_000


def test_a_drawing_that_fails_does_not_suppress_later_ones():
    display = DisplayModule(enhanced=True)
    display.collect()
    display.begin(clear=False, spend=lambda _: None)
    display.point(5, 6)
    assert display.get(5, 6)
