from collections import deque

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.dialogue import FENCE_SIZES, Dialogue
from firmware_protocol.direct import (
    Ack,
    BatteryLevel,
    GetBatteryLevel,
    GetOutputState,
    LSGetStatus,
    MessageRead,
    PlayTone,
    ResetMotorPosition,
    SetProperty,
)
from firmware_protocol.enums import InputPort, OutputPort, Property
from firmware_protocol.errors import (
    BrickError,
    CommunicationPending,
    LinkTimeout,
    LocalProtocolError,
    MailboxEmpty,
    RemoteProtocolError,
)
from firmware_protocol.status import Status
from firmware_protocol.system import Close, FileData, FileHandle, IOMapData, IOMapRead, Read

BATTERY = GetBatteryLevel()
ANSWER = bytes.fromhex("020b004a1e")


def opened(command):
    dialogue = Dialogue()
    dialogue.open(command, 0.0, 1.0)
    return dialogue


def fence_answer(fence):
    question = IOMapRead.decode(fence)
    return IOMapRead.encode_reply(IOMapData(question.module_id, question.size, bytes(question.size)))


class OrderlyLink:
    """A link that may lose and delay answers, but keeps their order, and a brick that numbers its answers."""

    def __init__(self, fates):
        self.fates = fates
        self.number = 0
        self.waiting = deque()
        self.arrived = deque()

    def send(self, telegram):
        if telegram[1] == IOMapRead.opcode:
            answer = fence_answer(telegram)
        else:
            self.number += 1
            answer = GetBatteryLevel.encode_reply(BatteryLevel(self.number))
        fate = self.fates.popleft() if self.fates else "prompt"
        if fate != "lost":
            self.waiting.append(answer)
        if fate == "prompt":
            self.arrived += self.waiting
            self.waiting.clear()

    def receive(self):
        return self.arrived.popleft() if self.arrived else None

    def ask(self, dialogue):
        self.send(dialogue.open(BATTERY, 0.0, 1.0))
        while (telegram := self.receive()) is not None:
            reply = dialogue.feed(telegram)
            if reply is not None:
                return reply.voltage_mv
            if request := dialogue.follow_up(0.0):
                self.send(request)
        raise dialogue.expire()


@settings(deadline=None, max_examples=300)
@given(st.lists(st.sampled_from(["prompt", "late", "lost"]), max_size=60))
def test_no_answer_is_ever_an_old_one(fates):
    dialogue, link = Dialogue(), OrderlyLink(deque(fates))
    while link.fates:
        try:
            assert link.ask(dialogue) == link.number
        except LinkTimeout:
            continue

    assert link.ask(dialogue) == link.number, "with the link in order again, the first request is answered"


def test_a_late_answer_to_the_same_question_is_not_taken_for_the_new_one():
    dialogue = opened(BATTERY)

    fence = dialogue.open(BATTERY, 1.0, 1.0)
    assert IOMapRead.decode(fence).module_id == 0x000C0001
    assert dialogue.feed(ANSWER) is None
    assert dialogue.follow_up(1.2) == b""
    assert dialogue.feed(fence_answer(fence)) is None
    assert dialogue.follow_up(1.5) == BATTERY.encode()

    assert dialogue.deadline == 2.5
    assert dialogue.feed(ANSWER) == BatteryLevel(7754)
    assert dialogue.open(BATTERY, 3.0, 1.0) == BATTERY.encode(), "in step again"


def test_each_fence_has_another_number():
    dialogue = opened(BATTERY)

    sizes = [IOMapRead.decode(dialogue.open(BATTERY, 0.0, 1.0)).size for _ in FENCE_SIZES]

    assert sorted(sizes) == list(FENCE_SIZES)


def test_a_lost_fence_does_not_pass_for_the_next_one():
    dialogue = opened(BATTERY)
    first = dialogue.open(BATTERY, 1.0, 1.0)
    second = dialogue.open(BATTERY, 2.0, 1.0)

    assert dialogue.feed(fence_answer(first)) is None
    assert dialogue.follow_up(2.0) == b""
    assert dialogue.feed(fence_answer(second)) is None
    assert dialogue.follow_up(2.0) == BATTERY.encode()


def test_a_lost_read_that_looks_like_a_fence_is_not_taken_for_one():
    """Whatever fence comes next, it differs from the user's own reads of the same place."""
    for size in FENCE_SIZES:
        lost, new = IOMapRead(0x000C0001, 26, size), IOMapRead(0x000C0001, 26, size % 16 + 1)
        dialogue = opened(lost)

        fence = IOMapRead.decode(dialogue.open(new, 1.0, 1.0))

        assert fence.size not in (lost.size, new.size)


def test_a_brick_that_refuses_the_fence_has_answered():
    dialogue = opened(BATTERY)
    dialogue.open(BATTERY, 1.0, 1.0)

    assert dialogue.feed(IOMapRead.encode_reply(status=Status.MODULE_NOT_FOUND)) is None

    assert dialogue.follow_up(1.0) == BATTERY.encode()


def test_a_telegram_without_a_status_does_not_answer_a_fence():
    dialogue = opened(BATTERY)
    dialogue.open(BATTERY, 1.0, 1.0)

    assert dialogue.feed(IOMapRead.encode_reply()[:2]) is None

    assert dialogue.follow_up(1.0) == b""


def test_a_new_link_needs_no_fence():
    dialogue = opened(BATTERY)
    dialogue.open(BATTERY, 1.0, 1.0)
    dialogue.reset()

    assert dialogue.open(BATTERY, 2.0, 1.0) == BATTERY.encode()
    assert dialogue.follow_up(2.0) == b""


def test_a_request_given_up_behind_its_fence_is_not_sent_later():
    dialogue = opened(BATTERY)
    fence = dialogue.open(PlayTone(440, 100), 1.0, 1.0)
    dialogue.feed(fence_answer(fence))

    fence = dialogue.open(BATTERY, 2.0, 1.0)
    dialogue.feed(fence_answer(fence))

    assert dialogue.follow_up(2.0) == BATTERY.encode()
    assert dialogue.follow_up(2.0) == b""


@pytest.mark.parametrize(
    "foreign",
    [
        "",
        "02",
        "000b",
        "010b004a1e",
        "020c00",
        "0206 00 01" + "00" * 21,
        "8009 00 02 4100",
    ],
)
def test_foreign_telegrams_are_dropped(foreign):
    dialogue = opened(GetOutputState(OutputPort.A))

    assert dialogue.feed(bytes.fromhex(foreign)) is None

    assert dialogue.feed(bytes.fromhex("0206 00 00") + bytes(21)).port == OutputPort.A


def test_nothing_open_means_nothing_is_an_answer():
    dialogue = Dialogue()
    assert dialogue.feed(ANSWER) is None

    dialogue.open(BATTERY, 0.0, 1.0)
    assert dialogue.feed(ANSWER) is not None
    assert dialogue.feed(ANSWER) is None, "a repeated answer"

    assert dialogue.open(PlayTone(440, 100), 0.0, 1.0) == PlayTone(440, 100).encode()
    assert dialogue.feed(ANSWER) is None
    assert dialogue.feed(b"\x02\x03\x00") == Ack()


@pytest.mark.parametrize(
    ("command", "other"),
    [
        (Close(3), Close.encode_reply(FileHandle(4))),
        (Read(3, 5), Read.encode_reply(FileData(3, 4, b"abcd"))),
        (IOMapRead(0x00020001, 0, 4), IOMapRead.encode_reply(IOMapData(0x00030001, 4, bytes(4)))),
        (MessageRead(0, 1, True), bytes.fromhex("0213 00 02 00") + bytes(59)),
    ],
)
def test_an_answer_about_something_else_is_dropped(command, other):
    assert opened(command).feed(other) is None


def test_telegrams_are_surplus_if_no_reply_was_missing():
    dialogue = Dialogue()
    dialogue.discard(2)
    assert dialogue.surplus_telegrams == 2, "found before a request"

    dialogue.open(Close(3), 0.0, 1.0)
    dialogue.feed(ANSWER)
    assert dialogue.surplus_telegrams == 3, "of another kind"

    dialogue.feed(Close.encode_reply(FileHandle(4)))
    assert dialogue.surplus_telegrams == 4, "about something else"

    dialogue.feed(Close.encode_reply(FileHandle(3)))
    assert dialogue.surplus_telegrams == 4


def test_a_late_reply_is_not_surplus():
    dialogue = opened(BATTERY)
    dialogue.discard(1)
    fence = dialogue.open(BATTERY, 1.0, 1.0)
    dialogue.discard(1)
    dialogue.feed(ANSWER)
    dialogue.feed(fence_answer(fence))

    assert dialogue.surplus_telegrams == 0


@pytest.mark.parametrize("malformed", ["020b", "020b00", "020b004a", "020b004a1e00"])
def test_a_malformed_answer_is_an_error_and_unsettles_the_dialogue(malformed):
    dialogue = opened(BATTERY)

    with pytest.raises(RemoteProtocolError) as caught:
        dialogue.feed(bytes.fromhex(malformed))

    assert caught.value.telegram == bytes.fromhex(malformed)
    assert dialogue.open(BATTERY, 0.0, 1.0) != BATTERY.encode()


@pytest.mark.parametrize(
    ("status", "error"),
    [("c0", BrickError), ("20", CommunicationPending), ("40", MailboxEmpty), ("be", BrickError), ("77", BrickError)],
)
@pytest.mark.parametrize("payload", ["", "00"])
def test_a_refusal_is_an_error_whatever_follows_its_status(status, error, payload):
    dialogue = opened(LSGetStatus(InputPort.IN_1))

    with pytest.raises(error, match="the brick refused LSGetStatus") as caught:
        dialogue.feed(bytes.fromhex("020e" + status + payload))

    assert type(caught.value) is error
    assert caught.value.status == int(status, 16)
    assert dialogue.open(BATTERY, 0.0, 1.0) == BATTERY.encode(), "a refusal is an answer"


@pytest.mark.parametrize(
    ("command", "refusal", "named"),
    [
        (LSGetStatus(InputPort.IN_4), "020edd00", "LSGetStatus on port 4: bus error"),
        (ResetMotorPosition(OutputPort.C, relative=False), "020ac0", "ResetMotorPosition on port C: out of range"),
        (BATTERY, "020bbe", "GetBatteryLevel: unknown opcode"),
    ],
)
def test_a_refusal_names_the_port_that_the_command_was_for(command, refusal, named):
    with pytest.raises(BrickError, match=f"the brick refused {named} "):
        opened(command).feed(bytes.fromhex(refusal))


def test_the_end_of_a_file_comes_with_data():
    dialogue = opened(Read(0, 3))

    reply = dialogue.feed(bytes.fromhex("0282 85 00 0300 616200"))

    assert reply == FileData(0, 3, b"ab\0")
    assert dialogue.open(BATTERY, 0.0, 1.0) == BATTERY.encode(), "it was an answer"


def test_in_progress_is_not_an_error():
    assert opened(SetProperty(Property.BLUETOOTH, b"\0")).feed(bytes.fromhex("021f01")) == Ack()


def test_a_command_that_does_not_fit_changes_nothing():
    dialogue = Dialogue()

    with pytest.raises(LocalProtocolError):
        dialogue.open(PlayTone(-1, 100), 0.0, 1.0)

    assert dialogue.open(BATTERY, 0.0, 1.0) == BATTERY.encode()


def test_timeouts_say_what_was_asked_and_what_to_do():
    dialogue = opened(BATTERY)
    assert dialogue.deadline == 1.0
    with pytest.raises(TimeoutError, match=r"GetBatteryLevel was not answered within 1 s\. Is the brick on"):
        raise dialogue.expire()

    dialogue.open(PlayTone(440, 100), 1.0, 0.5)
    with pytest.raises(LinkTimeout, match=r"PlayTone was not sent, because the brick had not replied for 0\.5 s"):
        raise dialogue.expire()


@given(st.lists(st.binary(max_size=70), max_size=10))
def test_no_bytes_break_the_dialogue(noise):
    dialogue = opened(GetOutputState(OutputPort.A))
    for telegram in noise:
        try:
            dialogue.feed(telegram)
        except (RemoteProtocolError, BrickError):
            return
