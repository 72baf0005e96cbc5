"""Files, sounds and arrays that programs make, as the firmware answered. See docs/firmware.md 8.2 and 8.4."""

import pytest

from firmware_protocol import direct, system
from firmware_protocol.iomap import SOUND, SoundState
from firmware_protocol.status import Status
from nxtdrive.tools.dev.faults.assembler import Variables, assemble, instruction, store
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import FIRMWARES
from sim_backend.firmware.vm.rxe import Type

BUILD, SIZE, MOVE, TO_TEXT, CALL, STOP, JUMP = 0x18, 0x17, 0x1B, 0x1F, 0x28, 0x29, 0x25
OPEN_READ, CREATE, WRITE, PLAY_TONE, SET_SOUND = 0, 1, 4, 10, 12
END, FOREVER = instruction(STOP, 0xFFFF), [0x4000 | JUMP, 0]
ENDS = {"ends": END, "is stopped": FOREVER, "fails": instruction(BUILD)}


def run(firmware, variables, *code, stop=False):
    brick = SimBrick(firmware=firmware)
    store(brick, "one.txt", b"hello")
    store(brick, "a.rxe", assemble(variables, code))
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(30)
    if stop:
        brick.receive(direct.StopProgram().encode())
    brick.tick(30)
    return brick


def opened(brick, name):
    return system.OpenRead.decode_reply(brick.receive(system.OpenRead(name).encode()))


def creating(variables, name, size, content, count=None):
    """Instructions that create a file and write to it."""
    create, (_, handle, *_) = variables.call(0, 0, name, size)
    write, (_, same, *_) = variables.call(0, 0, content, len(content) if count is None else count)
    return instruction(CALL, CREATE, create), instruction(MOVE, same, handle), instruction(CALL, WRITE, write)


def left_open(firmware, end):
    variables = Variables()
    lines = creating(variables, b"a.dat\0", 600, b"0123456789")
    return run(firmware, variables, *lines, ENDS[end], stop=end == "is stopped")


@pytest.mark.parametrize("end", sorted(ENDS))
@pytest.mark.parametrize(("firmware", "size"), [("1.05", 600), ("1.29", 10), ("1.32", 10)])
def test_a_data_file_that_a_program_leaves_open_ends_behind_what_was_written_but_in_1_05(firmware, end, size):
    brick = left_open(firmware, end)
    found = brick.receive(system.FindFirst("a.dat").encode())
    assert system.FindFirst.decode_reply(found).size == size
    file = opened(brick, "a.dat")
    content = system.Read.decode_reply(brick.receive(system.Read(file.handle, 10).encode())).data
    assert content == b"0123456789"


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
def test_the_files_that_a_program_reads_are_closed_at_its_end(firmware):
    variables = Variables()
    lines = [instruction(CALL, OPEN_READ, variables.call(0, 0, b"one.txt\0", 0)[0]) for _ in range(16)]
    assert opened(run(firmware, variables, *lines, END), "one.txt").handle == 0


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
def test_a_program_may_give_a_data_file_the_name_of_a_program(firmware):
    variables = Variables()
    brick = run(firmware, variables, *creating(variables, b"b.rxe\0", 5, b"12345"), END)
    assert opened(brick, "b.rxe").size == 5


def test_a_telegram_may_not():
    reply = SimBrick().receive(system.OpenWriteData("b.rxe", 5).encode())
    assert reply[2] == Status.ILLEGAL_FILE_NAME


def test_a_program_writes_what_is_behind_an_array_too():
    variables = Variables()
    brick = run("1.29", variables, *creating(variables, b"a.dat\0", 600, b"01234567", 20), END)
    file = opened(brick, "a.dat")
    content = system.Read.decode_reply(brick.receive(system.Read(file.handle, 20).encode())).data
    assert content.startswith(b"01234567")
    assert len(content) == 20


def length_of(firmware, kind, *sources):
    variables = Variables()
    target, length = variables.array([], kind), variables.number()
    arguments = [variables.array(values, of) if of else variables.number(values) for values, of in sources]
    report, (_, _, text) = variables.call(0, 10, b"\0")
    build = instruction(BUILD, target, *arguments)
    lines = [
        build,
        instruction(SIZE, length, target),
        instruction(TO_TEXT, text, length),
        instruction(CALL, 26, report),
    ]
    brick = run(firmware, variables, *lines, FOREVER)
    return brick.receive(direct.MessageRead(10, 0, remove=True).encode())[5:].split(b"\0")[0]


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
@pytest.mark.parametrize(
    ("kind", "sources", "length"),
    [
        (Type.SWORD, [([1, 2], Type.SWORD), (7, None), ([3], Type.SWORD)], b"4"),
        (Type.SWORD, [([1, 2], Type.SLONG), ([1, 2, 3], Type.UWORD), ([1, 2, 3], Type.UBYTE)], b"3"),
        (Type.SLONG, [([1, 2], Type.SLONG), ([1, 2, 3], Type.ULONG)], b"3"),
    ],
)
def test_an_array_of_another_type_counts_as_one_element(firmware, kind, sources, length):
    assert length_of(firmware, kind, *sources) == length


def sound_after(firmware, *calls, ms=3):
    variables = Variables()
    lines = [instruction(CALL, number, variables.call(*members)[0]) for number, members in calls]
    brick = SimBrick(firmware=firmware)
    store(brick, "a.rxe", assemble(variables, [*lines, FOREVER]))
    brick.receive(direct.StartProgram("a.rxe").encode())
    brick.tick(8 + ms)
    return brick.sound


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
def test_a_program_adds_to_the_flags_of_the_sound(firmware):
    tone = PLAY_TONE, (0, 400, 2000, 0, 3)
    sound = sound_after(firmware, tone, (SET_SOUND, (0, SoundState.IDLE, 8)))
    assert sound.flags & 8
    assert sound.flags & 0x3


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
def test_the_state_of_a_file_that_plays_ends_at_once_if_there_is_none(firmware):
    brick = SimBrick(firmware=firmware)
    brick.receive(direct.PlayTone(400, 2000).encode())
    brick.tick(3)
    brick.receive(SOUND.field("State").write(SoundState.FILE).encode())
    brick.tick(3)
    assert brick.sound.state == SoundState.IDLE


@pytest.mark.parametrize(("firmware", "volume"), [("1.05", 9), ("1.29", 4), ("1.32", 4)])
def test_only_1_05_lets_programs_set_a_volume_above_4(firmware, volume):
    assert sound_after(firmware, (PLAY_TONE, (0, 400, 20, 0, 9))).volume == volume


@pytest.mark.parametrize("firmware", sorted(FIRMWARES))
def test_a_file_that_a_program_opens_by_its_own_handle_keeps_its_size(firmware):
    """The program's first tone closes handle 0, its own, which the file gets then, and loses as the program ends."""
    variables = Variables()
    tone, (_, _, length, *_) = variables.call(0, 400, 20, 0, 3)
    wait = [instruction(0x34, 0xFFFF, length)] if firmware != "1.05" else [instruction(SIZE, length, length)] * 3000
    lines = [instruction(CALL, PLAY_TONE, tone), *wait, *creating(variables, b"a.dat\0", 600, b"0123456789"), END]
    found = run(firmware, variables, *lines).receive(system.FindFirst("a.dat").encode())
    assert system.FindFirst.decode_reply(found).size == 600
