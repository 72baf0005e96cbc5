"""Whatever comes through a door: the brick and the server survive, and the next request is answered."""

import contextlib
import os

import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.framing import frame
from firmware_protocol.telegram import COMMANDS
from sim_backend.doors.door import PARTIAL_LIMIT_S
from sim_backend.firmware.brick import SimBrick

GET_BATTERY = GetBatteryLevel().encode()
ANSWER = b"\x02\x0b\x00"
PAUSE_MS = round(PARTIAL_LIMIT_S * 1000) + 50

HEADS = [bytes((command.kind, command.opcode)) for command in COMMANDS.values()]
telegrams = st.builds(lambda head, rest: head + rest, st.sampled_from(HEADS), st.binary(max_size=62))
noise = st.binary(min_size=1, max_size=400)
bursts = st.lists(st.one_of(noise, telegrams, telegrams.map(frame)), min_size=1, max_size=8)
thorough = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def _revive(house):
    """A brick that has switched itself off, as it may have been told to, is switched on again."""
    if house.simulation.brick.powered_off:
        house.simulation.brick.io_control.power_word = 0


def _say(house, line, pieces):
    with contextlib.suppress(OSError):
        for piece in pieces:
            line.sendall(piece)
            house.turn(2)
            _drain(line)


def _drain(line):
    line.setblocking(False)
    with contextlib.suppress(BlockingIOError):
        while line.recv(4096):
            pass
    line.settimeout(10)


def _settle(house, line):
    """Everything said has been taken, everything answered has been read, and a pause has passed."""
    for _ in range(PAUSE_MS // 10):
        house.turn(10)
        with contextlib.suppress(OSError):
            _drain(line)
    _revive(house)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["tcp", "packets", "nxt-server"])
@thorough
@given(pieces=bursts)
@example(pieces=[b"\x00\x00"])
@example(pieces=[b"\xff\xff" + bytes(300)])
@example(pieces=[b"\x98" * 300, b"\x99"])
def test_after_any_bytes_the_same_program_and_the_next_are_answered(house, kind, pieces):
    door = next((door for door in house.doors), None) or house.add(kind)
    request = GET_BATTERY if kind == "nxt-server" else frame(GET_BATTERY)
    with house.connect(door) as line:
        _say(house, line, pieces)
        _settle(house, line)
        if b"\x99" not in b"".join(pieces):
            line.sendall(request)
            assert ANSWER in house.receive(line, 3)
    with house.connect(door) as line:
        line.sendall(request)
        assert ANSWER in house.receive(line, 3)
    house.turn(5)


@pytest.mark.slow
@thorough
@given(pieces=bursts)
def test_after_any_bytes_the_serial_port_answers(house, pieces):
    door = next((door for door in house.doors), None) or house.add("pty")
    port = os.open(door.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
    try:
        for piece in pieces:
            os.write(port, piece)
            house.turn(2)
        house.turn(PAUSE_MS)
        _revive(house)
        _empty(port)
        os.write(port, frame(GET_BATTERY))
        received = bytearray()
        assert house.until(lambda: received.extend(_empty(port)) or ANSWER in received)
    finally:
        os.close(port)


def _empty(port):
    with contextlib.suppress(BlockingIOError):
        return os.read(port, 8192)
    return b""


@pytest.mark.slow
@pytest.mark.parametrize("receive", ["receive", "receive_bluetooth"])
@settings(max_examples=150, deadline=None)
@given(pieces=st.lists(st.one_of(noise, telegrams), max_size=20))
def test_no_bytes_crash_the_brick(receive, pieces):
    brick = SimBrick()
    for piece in pieces:
        getattr(brick, receive)(frame(piece) if receive == "receive_bluetooth" else piece)
        brick.tick(3)
    brick.io_control.power_word = 0
    assert brick.receive(GET_BATTERY)[:3] == ANSWER
