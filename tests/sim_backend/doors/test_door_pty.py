"""The pseudo-terminal: any serial program talks to the brick, however badly it behaves."""

import os
import select
import subprocess
import sys
import time

import pytest
import serial
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from firmware_protocol.errors import ConfigError
from firmware_protocol.framing import FrameReader, frame
from sim_backend.doors.door import PARTIAL_LIMIT_S
from sim_backend.doors.pty import REOPEN_S, PtyDoor, Terminal

GET_BATTERY = bytes.fromhex("00 0b")
KEEP_ALIVE = bytes.fromhex("00 0d")


def _open(path):
    return serial.Serial(str(path), timeout=10, exclusive=True)


def _read(port):
    size = int.from_bytes(port.read(2), "little")
    return port.read(size)


def _ask(port, telegram):
    port.write(frame(telegram))
    return _read(port)


@pytest.fixture
def door(tmp_path, wall):
    door = PtyDoor(tmp_path / "port", now=wall.now)
    yield door
    door.close()


@pytest.fixture
def terminal(tmp_path, wall):
    """Without a door around it; its name is `device`."""
    terminal = Terminal("terminal", now=wall.now)
    yield terminal
    terminal.disconnect()


@pytest.fixture
def client(terminal):
    with _open(terminal.device) as port:
        yield port


def _visitor(door, port, telegram):
    """Who has come through the door once it has said something."""
    port.write(frame(telegram))
    select.select([door], [], [], 10)
    (visitor,) = door.accept()
    return visitor


def _arrived(terminal):
    """What has come once the system has passed it on."""
    select.select([terminal], [], [], 10)
    return terminal.receive()


def test_a_serial_program_gets_its_answers(served):
    with _open(served.path) as port:
        battery = _ask(port, GET_BATTERY)
        assert battery[:3] == bytes.fromhex("02 0b 00")
        assert 5000 < int.from_bytes(battery[3:5], "little") < 10000
        assert _ask(port, KEEP_ALIVE)[:3] == bytes.fromhex("02 0d 00")


def test_the_next_program_can_connect_after_the_first(served):
    for _ in range(3):
        with _open(served.path) as port:
            assert _ask(port, GET_BATTERY)[1] == 0x0B


def test_telegrams_written_at_once_are_answered_in_order(served):
    with _open(served.path) as port:
        port.write(frame(GET_BATTERY) + frame(KEEP_ALIVE) + frame(GET_BATTERY))
        assert [_read(port)[1] for _ in range(3)] == [0x0B, 0x0D, 0x0B]


def test_a_telegram_may_arrive_byte_by_byte(served):
    with _open(served.path) as port:
        for byte in frame(GET_BATTERY):
            port.write(bytes([byte]))
        assert _read(port)[:3] == bytes.fromhex("02 0b 00")


def test_simulated_time_passes_by_itself(served):
    with _open(served.path) as port:
        _ask(port, GET_BATTERY)
        before_ms = served.simulation.now_ms
        _ask(port, GET_BATTERY)
        assert served.simulation.now_ms > before_ms


def test_a_reply_comes_in_one_piece(terminal):
    port = os.open(terminal.device, os.O_RDWR | os.O_NOCTTY)
    try:
        terminal.send(frame(bytes(64)))
        select.select([port], [], [], 10)
        assert os.read(port, 1000) == frame(bytes(64))
    finally:
        os.close(port)


def test_half_a_telegram_does_not_spoil_the_next_programs_first(terminal, client, wall):
    client.write(frame(GET_BATTERY)[:-1])
    assert _arrived(terminal) == []
    wall.now_s += PARTIAL_LIMIT_S * 2
    assert terminal.receive() == []
    client.write(frame(KEEP_ALIVE))
    assert _arrived(terminal) == [KEEP_ALIVE]


def test_anything_that_is_not_a_telegram_is_dropped(terminal, client, wall):
    client.write(b"AT+GMM\r\n")
    assert _arrived(terminal) == []
    wall.now_s += PARTIAL_LIMIT_S * 2
    client.write(frame(KEEP_ALIVE))
    assert _arrived(terminal) == [KEEP_ALIVE]


def test_unread_replies_do_not_stop_the_brick(terminal):
    for _ in range(3000):
        terminal.send(frame(bytes(64)))
    with _open(terminal.device) as port:
        port.reset_input_buffer()
        port.write(frame(GET_BATTERY))
        assert _arrived(terminal) == [GET_BATTERY]


def test_nothing_is_written_unasked(terminal, client):
    terminal.receive()
    assert client.in_waiting == 0


@pytest.mark.slow
@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(garbage=st.binary(min_size=1, max_size=300), telegram=st.binary(min_size=1, max_size=64))
def test_after_any_garbage_and_a_pause_telegrams_pass(wall, garbage, telegram):
    terminal = Terminal("terminal", now=wall.now)
    try:
        with _open(terminal.device) as port:
            port.write(garbage)
            while select.select([terminal], [], [], 0.01)[0]:
                terminal.receive()
            wall.now_s += PARTIAL_LIMIT_S * 2
            port.write(frame(telegram))
            assert _arrived(terminal) == [telegram]
    finally:
        terminal.disconnect()


def test_the_door_has_a_visitor_once_a_program_writes(door):
    assert door.accept() == []
    with _open(door.path) as port:
        assert door.accept() == []
        assert _visitor(door, port, GET_BATTERY).receive() == [GET_BATTERY]
        assert door.accept() == []
        assert door.fileno() is None


def test_a_lost_link_ends_the_terminal_and_the_next_program_finds_a_new_one(door):
    with _open(door.path) as port:
        _visitor(door, port, GET_BATTERY).disconnect()
        with pytest.raises((OSError, serial.SerialException)):
            port.read(1)
    assert door.accept() == []
    with _open(door.path) as port:
        assert _visitor(door, port, KEEP_ALIVE).receive() == [KEEP_ALIVE]


def test_while_the_name_cannot_be_made_again_the_server_continues_and_tries_later(tmp_path, wall, caplog):
    folder = tmp_path / "ports"
    folder.mkdir()
    door = PtyDoor(folder / "port", now=wall.now)
    with _open(door.path) as port:
        _visitor(door, port, GET_BATTERY).disconnect()
    door.path.unlink()
    folder.rmdir()
    for _ in range(3):
        assert door.accept() == []
        assert door.fileno() is None
        wall.now_s += 0.5
    assert caplog.text.count("the port cannot be named") == 1
    folder.mkdir()
    wall.now_s += REOPEN_S
    assert door.accept() == []
    assert door.path.is_char_device()
    door.close()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux hands out controlling terminals unasked")
def test_a_session_leader_survives_the_end_of_the_door(door):
    program = "import sys; port = open(sys.argv[1], 'r+b', buffering=0); print('open', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", program, str(door.path)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
    ) as leader:
        assert leader.stdout.readline() == b"open\n"
        door.close()
        leader.communicate(timeout=30)
    assert leader.returncode == 0


def test_the_name_goes_with_the_door(tmp_path):
    door = PtyDoor(tmp_path / "port", now=time.monotonic)
    assert door.path.is_symlink()
    door.close()
    door.close()
    assert list(tmp_path.iterdir()) == []


def test_a_link_left_behind_is_replaced(tmp_path):
    (tmp_path / "port").symlink_to("/dev/nowhere")
    door = PtyDoor(tmp_path / "port", now=time.monotonic)
    with _open(door.path):
        pass
    door.close()


def test_a_door_does_not_take_another_ones_name_away(tmp_path):
    first = PtyDoor(tmp_path / "port", now=time.monotonic)
    with pytest.raises(ConfigError, match="port of another program"):
        PtyDoor(tmp_path / "port", now=time.monotonic)
    with _open(first.path) as port:
        assert _visitor(first, port, GET_BATTERY).receive() == [GET_BATTERY]
    first.path.unlink()
    second = PtyDoor(tmp_path / "port", now=time.monotonic)
    first.close()
    assert second.path.is_symlink()
    second.close()


def test_a_file_in_the_way_is_not_overwritten(tmp_path):
    (tmp_path / "port").write_text("precious")
    with pytest.raises(ConfigError, match="not a link"):
        PtyDoor(tmp_path / "port", now=time.monotonic)
    assert (tmp_path / "port").read_text() == "precious"


def test_a_folder_that_does_not_exist_is_named(tmp_path):
    with pytest.raises(ConfigError, match="No such file"):
        PtyDoor(tmp_path / "nowhere" / "port", now=time.monotonic)


def test_frames_read_back_are_whole(terminal, client):
    for size in range(1, 65):
        terminal.send(frame(bytes([size]) * size))
    reader = FrameReader()
    reader.feed(client.read(sum(range(3, 67))))
    assert [reader.next() for _ in range(64)] == [bytes([size]) * size for size in range(1, 65)]
