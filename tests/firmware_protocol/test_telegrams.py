"""Every declared telegram, with values made from its declaration."""

from contextlib import suppress
from typing import Annotated

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from firmware_protocol.catalog import ALL_COMMANDS, choices
from firmware_protocol.direct import (
    DatalogRead,
    GetOutputState,
    LSRead,
    LSWrite,
    MailboxMessage,
    MessageRead,
    MessageWrite,
    SetOutputState,
    SetProperty,
)
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead, IOMapWrite, Poll
from firmware_protocol.telegram import Ack, Command, Kind, Reply, direct, reply
from firmware_protocol.wire import U8, Block, Number, Scalar, Tail, Text

EXAMPLES = settings(max_examples=25, deadline=None)
LATIN_1 = st.characters(min_codepoint=1, max_codepoint=255)

every_command = pytest.mark.parametrize("command", ALL_COMMANDS, ids=lambda command: command.__name__)


def values_of(wire):
    match wire:
        case Scalar(minimum=minimum, maximum=maximum):
            return st.integers(minimum, maximum)
        case Number(scalar=scalar):
            return st.integers(scalar.minimum, scalar.maximum) | st.sampled_from(sorted(choices(wire).values()))
        case Text(size=size, closed=closed):
            return st.text(LATIN_1, max_size=size - closed)
        case Block(size=size):
            return st.binary(min_size=size, max_size=size)
        case Tail(limit=limit):
            return st.binary(max_size=min(limit, 300))


def instances_of(declaration):
    made = st.builds(declaration, **{name: values_of(wire) for name, wire in declaration.layout.wires.items()})
    return made.map(counted) if declaration.layout.count else made


def counted(instance):
    """The instance with a count that its data has."""
    name = instance.layout.count
    setattr(instance, name, min(getattr(instance, name), len(instance.data)))
    return instance


@every_command
@EXAMPLES
@given(data=st.data(), want_reply=st.booleans(), surplus=st.binary(max_size=5))
def test_a_request_survives_the_wire(command, data, want_reply, surplus):
    request = data.draw(instances_of(command))

    telegram = request.encode(want_reply=want_reply)

    assert telegram[0] == command.kind | (0 if want_reply else 0x80)
    assert telegram[1] == command.opcode
    assert command.decode(telegram) == request
    if not command.layout.tail:
        assert command.decode(telegram + surplus) == request, "the firmware ignores surplus bytes"


@every_command
@EXAMPLES
@given(data=st.data())
def test_a_reply_survives_the_wire(command, data):
    answer = data.draw(instances_of(command.reply_type))

    telegram = command.encode_reply(answer)

    assert telegram[:3] == bytes((2, command.opcode, 0))
    assert command.decode_reply(telegram) == answer


@pytest.mark.slow
@every_command
@EXAMPLES
@given(data=st.data())
def test_a_reply_that_repeats_the_request_begins_with_the_head_its_request_predicts(command, data):
    request, answer = data.draw(instances_of(command)), data.draw(instances_of(command.reply_type))
    for name in set(request.fields()) & set(answer.fields()):
        setattr(answer, name, getattr(request, name))

    assert command.encode_reply(answer).startswith(command.reply_head(request.encode()))


@every_command
def test_repeated_fields_lead_the_reply(command):
    shared = [name for name in command.reply_type.layout.wires if name in command.layout.wires]

    assert list(command.reply_type.layout.wires)[: len(shared)] == shared


@pytest.mark.slow
@every_command
@EXAMPLES
@given(data=st.data())
def test_cut_telegrams_are_refused(command, data):
    request = data.draw(instances_of(command)).encode()[: 2 + command.layout.size]
    answer = command.encode_reply(data.draw(instances_of(command.reply_type)))[: 3 + command.reply_type.layout.size]

    if command.layout.size:
        with pytest.raises(RemoteProtocolError, match=command.__name__):
            command.decode(request[:-1])
    if command.reply_type.layout.size:
        with pytest.raises(RemoteProtocolError) as caught:
            command.decode_reply(answer[:-1])
        assert caught.value.telegram == answer[:-1]
    if not command.reply_type.layout.tail:
        with pytest.raises(RemoteProtocolError):
            command.decode_reply(answer + b"\0")


@pytest.mark.parametrize(
    ("decode", "telegram", "message"),
    [
        (GetOutputState.decode, b"\0", "GetOutputState takes 1 bytes after its header, not 0 "),
        (GetOutputState.decode_reply, bytes(3 + 23), "OutputState takes 22 bytes after its header, not 23 "),
        (MessageWrite.decode, bytes(2 + 1), "MessageWrite takes at least 2 bytes after its header, not 1 "),
    ],
)
def test_a_telegram_of_another_size_is_described(decode, telegram, message):
    with pytest.raises(RemoteProtocolError, match=message):
        decode(telegram)


@settings(deadline=None)
@given(st.sampled_from(ALL_COMMANDS), st.binary(max_size=80))
def test_any_bytes_are_a_telegram_or_refused(command, noise):
    for decode in (command.decode, command.decode_reply):
        with suppress(RemoteProtocolError):
            assert repr(decode(noise))


@every_command
def test_each_number_out_of_range_is_named(command):
    fitting = {name: _fitting(wire) for name, wire in command.layout.wires.items()}
    for name, wire in command.layout.wires.items():
        with pytest.raises(LocalProtocolError, match=f"{command.__name__}.{name} must be"):
            command(**{**fitting, name: _unfitting(wire)}).encode()


@every_command
def test_each_value_of_another_type_is_named(command):
    fitting = {name: _fitting(wire) for name, wire in command.layout.wires.items()}
    for name, wire in command.layout.wires.items():
        for other in (None, 1.5, b"x" if isinstance(wire, Text) else "x"):
            with pytest.raises(LocalProtocolError, match=f"{command.__name__}.{name} must be"):
                command(**{**fitting, name: other}).encode()


def _fitting(wire):
    return "" if isinstance(wire, Text) else 0 if isinstance(wire, Scalar | Number) else b""


def _unfitting(wire):
    match wire:
        case Scalar(maximum=maximum) | Number(scalar=Scalar(maximum=maximum)):
            return maximum + 1
        case Text(size=size):
            return "x" * (size + 1)
        case Block(size=limit) | Tail(limit=limit):
            return bytes(limit + 1)


def test_no_opcode_is_both_direct_and_system():
    opcodes = [command.opcode for command in ALL_COMMANDS]

    assert len(opcodes) == len(set(opcodes)) == 59


def test_a_full_command_has_the_documented_bytes():
    """Source: docs/firmware.md section 4, 0x04."""
    command = SetOutputState(
        OutputPort.B,
        -75,
        OutputMode.MOTOR_ON | OutputMode.BRAKE | OutputMode.REGULATED,
        RegulationMode.SPEED,
        100,
        RunState.RUNNING,
        360,
    )

    assert command.encode() == bytes.fromhex("00 04 01 b5 07 01 64 20 68 01 00 00")
    assert command.encode(want_reply=False)[0] == 0x80


def test_lengths_are_counted_for_the_user():
    assert MessageWrite.text(1, "hi").encode() == bytes.fromhex("00 09 01 03 68 69 00")
    assert LSWrite.transaction(InputPort.IN_4, b"\x02\x42", 1).encode() == bytes.fromhex("00 0f 03 02 01 02 42")
    assert LSWrite.transaction(InputPort.IN_4, b"\x02\x42").encode() == bytes.fromhex("00 0f 03 02 00 02 42")
    assert IOMapWrite.put(0x000C0001, 28, b"\x02").encode() == bytes.fromhex("01 95 01 00 0c 00 1c 00 01 00 02")
    assert SetProperty.volume(3).encode() == bytes.fromhex("00 1f 01 03")


@given(st.text(LATIN_1, max_size=58))
@example("a" * 58)
def test_a_message_that_was_written_is_read_as_it_was(message):
    written = MessageWrite.text(1, message)
    read = MailboxMessage(1, written.size, written.data + bytes(59 - len(written.data)))
    assert read.text == message


@pytest.mark.parametrize("message", ["a" * 59, "\N{EURO SIGN}", b"a", None])
def test_a_message_that_does_not_fit_is_refused(message):
    with pytest.raises(
        LocalProtocolError, match=r"message must (have at most 58 characters, not 59|be text in Latin-1)"
    ):
        MessageWrite.text(1, message)


@pytest.mark.parametrize("level", [0, 255])
def test_any_byte_is_a_volume(level):
    assert SetProperty.volume(level).encode() == bytes((0x00, 0x1F, 0x01, level))


@pytest.mark.parametrize("level", [-1, 256, "3", 1.5])
def test_a_volume_that_is_no_byte_is_refused(level):
    with pytest.raises(LocalProtocolError, match="level must be a whole number from 0 to 255"):
        SetProperty.volume(level)


@pytest.mark.parametrize("data", [bytes(40), bytearray(40), memoryview(bytes(40)), memoryview(bytes(40)).cast("I")])
def test_too_many_bytes_are_counted_and_not_shown(data):
    with pytest.raises(LocalProtocolError, match=r"LSWrite\.data must be at most 16 bytes, not 40\."):
        LSWrite(InputPort.IN_1, 16, 0, data).encode()


def test_an_unknown_number_survives_as_an_unnamed_member():
    state = GetOutputState.decode_reply(bytes.fromhex("020600") + bytes.fromhex("00 00 00 09 00 77") + bytes(16))

    assert state.regulation == 9
    assert not state.regulation.known
    assert state.regulation.label == "unknown 0x09"
    assert state.run_state == 0x77


def test_instances_behave_like_records():
    one, same, other = GetOutputState(OutputPort.A), GetOutputState(port=OutputPort.A), GetOutputState(OutputPort.B)

    assert one == same != other
    assert repr(other) == "GetOutputState(port=<OutputPort.B: 1>)"
    assert one.fields() == {"port": OutputPort.A}
    with pytest.raises(TypeError, match=r"GetOutputState.__init__\(\) missing 1 required"):
        GetOutputState()
    with pytest.raises(AttributeError):
        one.prot = OutputPort.A


def test_a_read_that_usb_would_cut_short_may_be_answered_with_less():
    whole, long = IOMapRead(0x00020001, 0, 55), IOMapRead(0x00020001, 0, 56)

    assert IOMapRead.reply_head(whole.encode()) == bytes.fromhex("02 94 00 01 00 02 00 37 00")
    assert IOMapRead.reply_head(long.encode()) == bytes.fromhex("02 94 00 01 00 02 00")


def test_a_bare_status_is_a_reply():
    assert GetOutputState.encode_reply(status=Status.OUT_OF_RANGE) == b"\x02\x06\xc0"


def test_declarations_are_checked():
    with pytest.raises(TypeError, match="declared twice"):

        @direct(0x06)
        class Again(Command[Ack]):
            """An opcode that is taken."""

    with pytest.raises(TypeError, match="only the last field"):

        @reply
        class Backwards(Reply):
            """The open end in front."""

            data: Annotated[bytes, Tail(4)]
            size: U8


def test_kinds_are_the_documented_ones():
    """Source: docs/firmware.md section 3."""
    assert [(kind.name, kind.value) for kind in Kind] == [("DIRECT", 0), ("SYSTEM", 1), ("REPLY", 2)]


def test_wire_types_of_different_kinds_are_never_taken_for_one_another():
    # found with CPython 3.11.2, whose typing module hands out an equal annotation it has seen before
    from firmware_protocol.wire import Block, Tail, Text

    kinds = [Block(4), Tail(4), Text(4)]
    assert all(one != other for one in kinds for other in kinds if one is not other)


@pytest.mark.parametrize(
    ("command", "size", "data"),
    [
        (IOMapRead, bytes.fromhex("01000c003700"), bytes(54)),
        (IOMapRead, bytes.fromhex("01000c000200"), b""),
        (Poll, bytes.fromhex("0105"), bytes(4)),
        (LSRead, bytes([17]), bytes(16)),
        (MessageRead, bytes([0, 60]), bytes(59)),
        (DatalogRead, bytes([61]), bytes(60)),
    ],
)
def test_a_reply_with_fewer_bytes_than_it_counts_is_refused(command, size, data):
    with pytest.raises(RemoteProtocolError, match="counts"):
        command.decode_reply(command.encode_reply() + size + data)
