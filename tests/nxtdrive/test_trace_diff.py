"""What `nxtdrive trace diff` and `trace replay` print."""

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, KeepAlive
from firmware_protocol.enums import OutputPort
from nxtdrive.transports.trace_diff import differences
from nxtdrive.transports.trace_file import Entry, EntryKind, Exchange

BATTERY = GetBatteryLevel().encode()
FULL, EMPTY = (GetBatteryLevel.encode_reply() + voltage.to_bytes(2, "little") for voltage in (8000, 6000))
REFUSAL = GetBatteryLevel.encode_reply(status=0xBE)
CLOSED, MODULE_CLOSED = bytes.fromhex("02840003"), bytes.fromhex("02920003")
LOST = Entry(0.2, EntryKind.ERROR, error="LinkLost", text="gone")
REOPENED = Entry(0.3, EntryKind.REOPENED)


def answered(*outcome, request=BATTERY, time_s=0.0):
    entries = (Entry(0.1, EntryKind.FROM_BRICK, each) if isinstance(each, bytes) else each for each in outcome)
    return Exchange(time_s, request, tuple(entries))


@pytest.mark.parametrize(
    ("ours", "theirs", "lines"),
    [
        ([FULL], [EMPTY], ["voltage_mv: 8000 mV, then 6000 mV"]),
        ([FULL], [], ["- GetBatteryLevel ok voltage_mv=8000 mV (02 0b 00 40 1f)", "+ no answer"]),
        ([], [LOST], ["- no answer", "+ LinkLost"]),
        ([REOPENED], [LOST], ["- reopened", "+ LinkLost"]),
        ([FULL, LOST], [EMPTY], ["- GetBatteryLevel ok voltage_mv=8000 mV (02 0b 00 40 1f); LinkLost", "+ GetBat"]),
        ([FULL, FULL], [EMPTY, EMPTY], ["- GetBatteryLevel ok voltage_mv=8000 mV (02 0b 00 40 1f); GetB", "+ GetBat"]),
        ([FULL], [REFUSAL], ["- GetBatteryLevel ok", "+ GetBatteryLevel unknown opcode"]),
        ([FULL], [REFUSAL + FULL[3:]], ["- GetBatteryLevel ok", "+ GetBatteryLevel unknown opcode"]),
        ([REFUSAL], [REFUSAL + FULL[3:]], ["- GetBatteryLevel unknown", "+ GetBatteryLevel unknown"]),
        ([FULL], [FULL[:-1]], ["voltage_mv: 8000 mV, then cut off after 40"]),
        ([FULL], [FULL + b"\0"], ["- GetBatteryLevel ok", "+ GetBatteryLevel ok"]),
        (
            [CLOSED],
            [MODULE_CLOSED],
            ["- Close ok handle=3 (02 84 00 03)", "+ CloseModuleHandle ok handle=3 (02 92"],
        ),
        ([b"\x02\x7f\0\1"], [b"\x02\x7e\0\1"], ["- reply ok (02 7f 00 01)", "+ reply ok (02 7e 00 01)"]),
    ],
)
def test_the_same_request_with_other_outcomes(ours, theirs, lines):
    printed = list(differences([answered(*ours)], [answered(*theirs)]))
    assert printed[0] == "  1: GetBatteryLevel (00 0b)"
    assert len(printed) == 1 + len(lines)
    assert all(each.strip().startswith(line) for each, line in zip(printed[1:], lines, strict=True))


def test_the_same_outcomes_at_other_times_are_no_difference():
    assert not list(differences([answered(FULL, LOST)], [answered(FULL, LOST, time_s=3.0)]))


def test_requests_are_numbered_in_the_conversation_that_has_them():
    common, motor = answered(FULL), answered(request=GetOutputState(OutputPort.A).encode())
    alive = answered(request=KeepAlive().encode())
    assert [line.split(" (")[0] for line in differences([common, motor, common], [common, alive, alive, common])] == [
        "- 2: GetOutputState port=A",
        "+ 2: KeepAlive",
        "+ 3: KeepAlive",
    ]
