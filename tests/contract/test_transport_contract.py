"""The contract of every transport, whatever lies between it and the brick. The rigs are in conftest.py."""

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, KeepAlive, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.errors import LinkLost, LinkTimeout, RemoteProtocolError
from firmware_protocol.system import GetDeviceInfo
from nxtdrive.brick import Brick
from nxtdrive.transports import reopen_transport, usb_port

BATTERY = GetBatteryLevel().encode()
PATIENCE_S = 2.0
SHORT_S = 0.1


@pytest.fixture
def brick(faulty_rig):
    """Makes a brick over the rig; the dialogue gives up early."""

    def make(faults=()):
        return Brick(faulty_rig.open(faults), timeout_s=SHORT_S)

    return make


def test_a_telegram_goes_there_and_its_reply_comes_back(rig):
    transport = rig.open()
    transport.send(BATTERY)
    reply = transport.receive(PATIENCE_S)
    assert reply is not None
    assert GetBatteryLevel.decode_reply(reply).voltage_mv > 1000


def test_replies_keep_their_order_and_their_boundaries(rig):
    transport = rig.open()
    for port in (2, 0, 1):
        transport.send(GetOutputState(OutputPort(port)).encode())
    replies = [transport.receive(PATIENCE_S) for _ in range(3)]
    assert [GetOutputState.decode_reply(reply).port for reply in replies] == [2, 0, 1]


def test_the_longest_telegram_of_the_brick_passes(rig):
    transport = rig.open()
    telegram = BATTERY + bytes(64 - len(BATTERY))
    transport.send(telegram)
    assert transport.receive(PATIENCE_S)[:3] == b"\x02\x0b\x00"


@pytest.mark.slow
def test_silence_is_none_and_not_an_error(rig):
    transport = rig.open()
    assert transport.receive(SHORT_S) is None
    assert transport.receive(0) is None
    transport.send(BATTERY)
    assert transport.receive(PATIENCE_S) is not None


def test_a_reply_that_waits_is_told_until_it_is_received(rig, monkeypatch):
    monkeypatch.setattr(usb_port, "LOOK_EVERY_S", 0.0)
    transport = rig.open()
    assert not transport.waiting()
    transport.send(BATTERY)
    deadline = transport.now() + PATIENCE_S
    while not transport.waiting() and transport.now() < deadline:
        transport.sleep(0.001)
    assert transport.waiting()
    assert GetBatteryLevel.decode_reply(transport.receive(0.0)).voltage_mv > 1000
    assert not transport.waiting()


def test_time_passes_by_sleeping_and_by_waiting_and_never_goes_back(rig):
    transport = rig.open()
    start = transport.now()
    transport.sleep(0.01)
    slept = transport.now()
    transport.receive(0.01)
    assert start + 0.01 <= slept + 1e-9
    assert slept + 0.01 <= transport.now() + 1e-9
    transport.sleep(0)
    transport.sleep(-1)


def test_a_closed_transport_says_so(rig):
    transport = rig.open()
    transport.close()
    transport.close()
    with pytest.raises(LinkLost, match="closed"):
        transport.send(BATTERY)
    with pytest.raises(LinkLost, match="closed"):
        transport.receive(SHORT_S)
    with pytest.raises(LinkLost, match="closed"):
        transport.waiting()


def test_the_brick_answers_through_it(rig):
    with Brick(rig.open(), timeout_s=PATIENCE_S) as brick:
        assert len(brick.request(GetDeviceInfo()).address) == 7
        assert brick.battery_v > 1


@pytest.mark.slow
def test_a_lost_reply_is_a_timeout_and_the_next_question_is_answered(brick, fault):
    with brick({1: fault.DROP}) as lossy:
        lossy.request(KeepAlive())
        with pytest.raises(LinkTimeout):
            lossy.request(KeepAlive())
        assert lossy.request(GetBatteryLevel()).voltage_mv > 1000


@pytest.mark.slow
def test_a_late_reply_is_never_taken_for_the_answer_to_a_later_question(brick, fault):
    with brick({0: fault.LATE}) as slow:
        with pytest.raises(LinkTimeout):
            slow.request(GetOutputState(OutputPort.A))
        for port in (OutputPort.A, OutputPort.B, OutputPort.C, OutputPort.A):
            assert slow.request(GetOutputState(port)).port is port


def test_a_reply_that_comes_twice_counts_once(brick, fault):
    with brick({0: fault.TWICE}) as stuttering:
        for port in (OutputPort.A, OutputPort.B, OutputPort.C):
            assert stuttering.request(GetOutputState(port)).port is port


@pytest.mark.slow
def test_garbage_is_not_believed_and_does_not_outlast_the_next_question(brick, fault):
    with brick({0: fault.GARBAGE}) as noisy:
        with pytest.raises((LinkTimeout, RemoteProtocolError)):
            noisy.request(GetBatteryLevel())
        assert noisy.request(GetBatteryLevel()).voltage_mv > 1000


def test_a_reply_in_pieces_is_whole_again(piecemeal_rig, fault):
    with Brick(piecemeal_rig.open({0: fault.PIECES}), timeout_s=PATIENCE_S) as brick:
        assert brick.request(GetBatteryLevel()).voltage_mv > 1000


@pytest.mark.slow
def test_half_a_reply_and_then_silence_does_not_lose_the_next_one(piecemeal_rig, fault):
    with Brick(piecemeal_rig.open({0: fault.HALF}), timeout_s=0.6) as brick:
        with pytest.raises(LinkTimeout):
            brick.request(GetBatteryLevel())
        assert brick.request(GetBatteryLevel()).voltage_mv > 1000


def test_bytes_that_are_not_frames_are_refused_once(stream_rig, fault):
    with Brick(stream_rig.open({0: fault.NONSENSE}), timeout_s=PATIENCE_S) as brick:
        with pytest.raises(RemoteProtocolError):
            brick.request(GetBatteryLevel())
        assert brick.request(GetBatteryLevel()).voltage_mv > 1000


def test_an_unplugged_brick_is_a_lost_link(faulty_rig, fault):
    transport = faulty_rig.open({0: fault.UNPLUG})

    def ask():
        transport.send(BATTERY)
        return transport.receive(PATIENCE_S)

    for _ in range(2):
        with pytest.raises(LinkLost):
            ask()


def test_a_lost_brick_can_be_closed_without_fuss(faulty_rig, fault):
    with Brick(faulty_rig.open({1: fault.UNPLUG}), timeout_s=PATIENCE_S) as brick:
        brick.motor("A").brake()
        with pytest.raises(LinkLost):
            brick.request(GetBatteryLevel())


def test_the_address_opens_the_same_link_again(rig):
    if type(rig).__name__ in ("TcpRig", "NxtServerRig", "BluetoothRig"):
        pytest.skip("this server serves one program")
    first = rig.open()
    second = reopen_transport(first, timeout_s=PATIENCE_S)
    try:
        assert second.address == first.address
        second.send(BATTERY)
        assert second.receive(PATIENCE_S) is not None
    finally:
        second.close()


def test_a_burst_without_replies_reaches_the_brick_telegram_by_telegram(rig):
    transport = rig.open()
    for power in range(1, 21):
        told = SetOutputState(OutputPort.C, power, OutputMode(0), RegulationMode.IDLE, 0, RunState.IDLE, 0)
        transport.send(told.encode(want_reply=False))
    transport.send(GetOutputState(OutputPort.C).encode())
    reply = transport.receive(PATIENCE_S)
    assert GetOutputState.decode_reply(reply).power == 20


@pytest.mark.slow
def test_every_question_to_a_mute_brick_ends_within_its_time(brick, fault):
    with brick(dict.fromkeys(range(1000), fault.DROP)) as mute:
        for _ in range(3):
            with pytest.raises(LinkTimeout):
                mute.request(GetBatteryLevel())
