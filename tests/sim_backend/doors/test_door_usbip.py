"""The brick and its camera over USB/IP, talked to as Linux's kernel does."""

import contextlib
import errno
import socket
import struct
import threading
from functools import partial

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.errors import ConfigError
from firmware_protocol.system import GetVersions
from sim_backend.doors.usb_device import Stall
from sim_backend.doors.usbip import NxtDevice, UsbIpDoor, attach_command
from sim_backend.doors.usbip_session import UsbIpSession
from sim_backend.doors.uvc import UvcDoor, UvcWebcam
from tests.waiting import until

SERIAL_NUMBER = "001653010203"
GET_BATTERY = GetBatteryLevel().encode()
HEADER = struct.Struct(">5Ii4I8s")
IMPORT = struct.pack(">HHI32s", 0x0111, 0x8003, 0, b"1-1")
LIST = struct.pack(">HHI", 0x0111, 0x8005, 0)
SUBMIT, UNLINK = 1, 2
OUT, IN = 1, 2
"""The brick's endpoint numbers; the webcam's only one is 1."""


def submit(sequence, *, endpoint=0, to_host=False, data=b"", length=0, setup=b""):
    return HEADER.pack(SUBMIT, sequence, 0x10001, to_host, endpoint, 0, len(data) or length, 0, 0, 0, setup) + data


def unlink(sequence, victim):
    return HEADER.pack(UNLINK, sequence, 0x10001, 0, 0, victim, 0, 0, 0, 0, b"")


def control(sequence, request_type, request, value=0, index=0, length=0):
    setup = struct.pack("<BBHHH", request_type, request, value, index, length)
    return submit(sequence, to_host=bool(request_type & 0x80), length=length, setup=setup)


class Host:
    """The kernel's end of a session."""

    def __init__(self, device):
        self.session = UsbIpSession(device, lambda: False)
        self.session.feed(IMPORT)
        assert self.session.imported
        self.session.outgoing.clear()

    def say(self, message):
        """Send a message; returns the answers as (sequence number, status, data)."""
        self.session.feed(message)
        return self.receive()

    def receive(self):
        self.session.pump()
        answers = []
        data = bytes(self.session.outgoing)
        self.session.outgoing.clear()
        while data:
            command, sequence, _, _, _, status, length, *_ = HEADER.unpack_from(data)
            length = length if command == 3 and sequence not in self.writes else 0
            answers.append((sequence, status, data[HEADER.size : HEADER.size + length]))
            data = data[HEADER.size + length :]
        return answers

    writes = ()
    """Sequence numbers of transfers to the device, whose answers carry a length but no data."""


@pytest.fixture
def device():
    return NxtDevice(SERIAL_NUMBER)


@pytest.fixture
def host(device):
    return Host(device)


def test_the_list_says_what_lsusb_would(device):
    session = UsbIpSession(device, lambda: False)
    session.feed(LIST)
    version, code, status, count = struct.unpack_from(">HHII", session.outgoing)
    assert (version, code, status, count) == (0x0111, 0x0005, 0, 1)
    described = session.outgoing[12:]
    assert described[256:288].rstrip(b"\0") == b"1-1"
    _, _, speed, vendor, product, _ = struct.unpack_from(">IIIHHH", described, 288)
    assert (speed, vendor, product) == (2, 0x0694, 0x0002)
    assert described[312:] == b"\xff\xff\xff\x00"
    assert session.finished


@pytest.mark.parametrize(("bus_id", "in_use", "status"), [(b"1-2", False, 4), (b"1-1", True, 2)])
def test_a_brick_that_is_not_there_or_in_use_is_refused(device, bus_id, in_use, status):
    session = UsbIpSession(device, lambda: in_use)
    session.feed(struct.pack(">HHI32s", 0x0111, 0x8003, 0, bus_id))
    assert struct.unpack(">HHI", session.outgoing) == (0x0111, 0x0003, status)
    assert session.finished
    assert not session.imported


def test_the_kernel_can_enumerate_the_brick(host):
    [(_, _, descriptor)] = host.say(control(1, 0x80, 6, 0x0100, 0, 64))
    assert descriptor.hex() == "120100020000000894060200000000000101"
    [(_, _, configuration)] = host.say(control(2, 0x80, 6, 0x0200, 0, 9))
    assert len(configuration) == 9
    [(_, _, configuration)] = host.say(control(3, 0x80, 6, 0x0200, 0, 255))
    assert len(configuration) == struct.unpack_from("<H", configuration, 2)[0] == 32
    [(_, _, language)] = host.say(control(4, 0x80, 6, 0x0300, 0, 255))
    assert language.hex() == "04030904"
    [(_, _, serial_number)] = host.say(control(5, 0x80, 6, 0x0301, 0x0409, 255))
    assert serial_number[2:].decode("utf-16-le") == SERIAL_NUMBER
    assert host.say(control(6, 0x00, 9, 1)) == [(6, 0, b"")]
    assert host.say(control(7, 0x80, 8, 0, 0, 1)) == [(7, 0, b"\x01")]


@pytest.mark.parametrize(
    "unknown", [(0x80, 6, 0x0600, 0, 10), (0x80, 6, 0x0302, 0, 255), (0xC0, 1, 0, 0, 8), (0x80, 0x33)]
)
def test_unsupported_requests_stall(host, unknown):
    assert host.say(control(1, *unknown)) == [(1, -errno.EPIPE, b"")]


def test_each_packet_to_the_brick_is_a_telegram(host, device):
    host.writes = (1,)
    assert host.say(submit(1, endpoint=OUT, data=bytes(range(100)))) == [(1, 0, b"")]
    assert device.inbox == [bytes(range(64)), bytes(range(64, 100))]


def test_a_read_waits_for_a_reply(host, device):
    assert host.say(submit(1, endpoint=IN, to_host=True, length=64)) == []
    device.outbox[0x82].append(b"reply")
    assert host.receive() == [(1, 0, b"reply")]


def test_a_long_read_ends_with_a_short_packet(host, device):
    device.outbox[0x82].extend([bytes(64), b"end", b"next"])
    assert host.say(submit(1, endpoint=IN, to_host=True, length=256)) == [(1, 0, bytes(64) + b"end")]
    assert host.say(submit(2, endpoint=IN, to_host=True, length=2)) == [(2, -errno.EOVERFLOW, b"")]


def test_a_read_can_be_withdrawn_until_it_is_answered(host, device):
    host.say(submit(1, endpoint=IN, to_host=True, length=64))
    assert host.say(unlink(2, 1)) == [(2, -errno.ECONNRESET, b"")]
    device.outbox[0x82].append(b"kept")
    assert host.receive() == []
    assert host.say(submit(3, endpoint=IN, to_host=True, length=64)) == [(3, 0, b"kept")]
    assert host.say(unlink(4, 3)) == [(4, 0, b"")]


@pytest.mark.parametrize(("address", "endpoint", "to_host"), [(0x82, IN, True), (0x01, OUT, False)])
def test_a_halted_endpoint_fails_until_the_host_clears_it(host, device, address, endpoint, to_host):
    device.halted.add(address)
    transfer = {"endpoint": endpoint, "to_host": to_host, "length": 0 if not to_host else 64}
    assert host.say(submit(1, **transfer)) == [(1, -errno.EPIPE, b"")]
    assert host.say(control(2, 0x82, 0, 0, address, 2)) == [(2, 0, b"\x01\x00")]
    assert host.say(control(3, 0x02, 1, 0, address)) == [(3, 0, b"")]
    device.outbox[0x82].append(b"again")
    answer = b"again" if to_host else b""
    assert host.say(submit(5, **transfer)) == [(5, 0, answer)]


def test_endpoints_that_the_brick_lacks_stall(host):
    assert host.say(submit(1, endpoint=5, to_host=True, length=8)) == [(1, -errno.EPIPE, b"")]
    assert host.say(submit(2, endpoint=5)) == [(2, -errno.EPIPE, b"")]


@given(noise=st.lists(st.binary(max_size=200), max_size=6), imported=st.booleans())
def test_no_bytes_break_a_session(noise, imported):
    session = UsbIpSession(NxtDevice(SERIAL_NUMBER), lambda: False)
    if imported:
        session.feed(IMPORT)
    for data in noise:
        session.feed(data)
    assert len(session.outgoing) < 10_000


def test_reads_without_end_are_refused(host):
    for number in range(300):
        host.session.feed(submit(number, endpoint=IN, to_host=True, length=64))
    assert host.session.finished


# --- the doors ---


@pytest.fixture
def door(house):
    with contextlib.closing(UsbIpDoor(SERIAL_NUMBER, 0, now=house.wall.now)) as door:
        house.doors.append(door)
        yield door
        house.board.close()


def imported(house, door):
    line = house.connect(door)
    line.sendall(IMPORT)
    assert len(house.receive(line, 320)) == 320
    return line


def test_the_brick_answers_through_the_door(house, door):
    line = imported(house, door)
    line.sendall(submit(1, endpoint=IN, to_host=True, length=64) + submit(2, endpoint=OUT, data=GET_BATTERY))
    received = house.receive(line, 2 * HEADER.size + 5)
    assert HEADER.unpack_from(received)[1:6] == (2, 0, 0, 0, 0)
    assert received[2 * HEADER.size :][:3] == b"\x02\x0b\x00"
    assert [each.event for each in house.events] == ["connected"]


def test_one_computer_at_a_time_has_the_brick(house, door):
    first = imported(house, door)
    second = house.connect(door)
    second.sendall(IMPORT)
    assert struct.unpack(">HHI", house.receive(second, 8)) == (0x0111, 0x0003, 2)
    first.close()
    house.until(lambda: not house.board.clients)
    imported(house, door)


def test_a_client_that_only_asks_gets_no_link_and_may_not_stay(house, door):
    line = house.connect(door)
    line.sendall(LIST)
    assert len(house.receive(line, 328)) == 328
    silent = house.connect(door)
    house.turn(2)
    house.wall.now_s += 6
    house.turn(2)
    assert silent.recv(1) == b""
    assert house.events == []


def test_a_pulled_cable_ends_the_connection_and_can_be_plugged_in_again(house, door):
    line = imported(house, door)
    line.sendall(submit(1, endpoint=IN, to_host=True, length=64))
    house.turn(3)
    door.unplug()
    house.turn(3)
    assert line.recv(1) == b""
    assert not house.board.clients
    imported(house, door)


def test_a_mute_brick_reads_but_does_not_answer(house, door):
    line = imported(house, door)
    door.device.mute = True
    line.sendall(submit(1, endpoint=OUT, data=GetVersions().encode()))
    house.receive(line, HEADER.size)
    house.turn(20)
    door.device.mute = False
    line.sendall(submit(2, endpoint=IN, to_host=True, length=64) + submit(3, endpoint=OUT, data=GET_BATTERY))
    received = house.receive(line, 2 * HEADER.size + 5)
    assert b"\x02\x0b\x00" in received
    assert b"\x02\x88" not in received


def test_a_halted_endpoint_ends_the_reads_under_way(house, door):
    line = imported(house, door)
    line.sendall(submit(1, endpoint=IN, to_host=True, length=64))
    house.turn(3)
    door.halt(0x82)
    assert HEADER.unpack(house.receive(line, HEADER.size))[5] == -errno.EPIPE


@pytest.mark.parametrize(
    ("host", "named"), [("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "127.0.0.1"), ("10.0.0.7", "10.0.0.7")]
)
def test_the_command_names_an_address_that_answers(host, named):
    assert attach_command(host, 3240) == f"usbip --tcp-port 3240 attach -r {named} -b 1-1"


# --- the webcam ---

PROBE = struct.Struct("<HBBI5HII")


@pytest.fixture
def webcam():
    return UvcWebcam((320, 240), 15.0)


def test_the_format_is_negotiated(webcam):
    host = Host(webcam)
    [(_, _, configuration)] = host.say(control(1, 0x80, 6, 0x0200, 0, 999))
    assert len(configuration) == struct.unpack_from("<H", configuration, 2)[0]
    blocks, rest = [], configuration
    while rest:
        blocks.append(rest[: rest[0]])
        rest = rest[rest[0] :]
    [frame] = [block for block in blocks if block[1:3] == b"\x24\x07"]
    assert struct.unpack_from("<HH", frame, 5) == (320, 240)
    assert struct.unpack_from("<I", frame, 26) == (666667,)
    for sequence, request in enumerate((0x81, 0x82, 0x83, 0x87)):
        [(_, status, probe)] = host.say(control(sequence, 0xA1, request, 0x0100, 1, PROBE.size))
        assert status == 0
        assert PROBE.unpack(probe)[1:4] == (1, 1, 666667)
    assert host.say(control(9, 0x21, 0x01, 0x0200, 1)) == [(9, 0, b"")]
    assert host.say(control(10, 0xA1, 0x81, 0x0200, 0, 1)) == [(10, 0, b"\x06")]


@pytest.mark.parametrize("size", [5, 510, 16_382, 16_383, 40_000])
def test_a_frame_arrives_whole(webcam, size):
    host, jpeg = Host(webcam), bytes(index % 251 for index in range(size))
    webcam.show(b"too early", wanted=host.session.reading)
    for number in range(5):
        host.session.feed(submit(number, endpoint=1, to_host=True, length=16_384))
    webcam.show(jpeg, wanted=host.session.reading)
    payloads = [data for _, _, data in host.receive()]
    assert b"".join(payload[2:] for payload in payloads) == jpeg
    assert [bool(payload[1] & 0x02) for payload in payloads] == [False] * (len(payloads) - 1) + [True]


def test_a_frame_that_comes_too_soon_is_lost(webcam):
    host = Host(webcam)
    host.session.feed(submit(1, endpoint=1, to_host=True, length=16_384))
    webcam.show(bytes(30_000), wanted=True)
    host.receive()
    host.session.feed(submit(2, endpoint=1, to_host=True, length=1))  # one that no packet fits
    webcam.show(b"second", wanted=True)
    assert b"second" not in b"".join(webcam.outbox[0x81])


def test_the_webcam_does_not_answer_what_it_lacks(webcam):
    with pytest.raises(Stall):
        webcam.take(1, b"")
    assert Host(webcam).say(control(1, 0xA1, 0x81, 0x0500, 1, 26))[0][1] == 0
    assert Host(webcam).say(control(1, 0xA1, 0x84, 0x0100, 1, 26)) == [(1, -errno.EPIPE, b"")]


def test_the_camera_streams_to_one_computer_until_it_is_unplugged():
    image = np.full((240, 320, 3), 90, np.uint8)
    with contextlib.closing(UvcDoor((320, 240), 15.0)) as door:
        assert not door.watched
        with socket.create_connection(("127.0.0.1", door.port), timeout=10) as line:
            line.sendall(IMPORT + submit(1, endpoint=1, to_host=True, length=16_384))
            stream = line.makefile("rb")
            stream.read(320)
            until(lambda: door.watched)
            with socket.create_connection(("127.0.0.1", door.port), timeout=10) as other:
                other.sendall(IMPORT)
                assert struct.unpack(">HHI", other.makefile("rb").read())[2] == 2
            door.show(image)
            *_, status, length, _, _, _, _ = HEADER.unpack(stream.read(HEADER.size))
            assert status == 0
            frame = cv2.imdecode(np.frombuffer(stream.read(length)[2:], np.uint8), cv2.IMREAD_COLOR)
            assert np.abs(frame.astype(int) - image).max() < 5
            door.unplug()
            assert stream.read() == b""
    door.close()


def test_the_webcam_can_be_closed_while_a_computer_has_it():
    door = UvcDoor((320, 240), 15.0)
    connect = partial(socket.create_connection, ("127.0.0.1", door.port), timeout=10)
    with connect() as computer, connect() as asking:
        computer.sendall(IMPORT)
        stream = computer.makefile("rb")
        stream.read(320)
        closing = threading.Thread(target=door.close, daemon=True)
        closing.start()
        closing.join(10)
        assert not closing.is_alive()
        assert stream.read() == asking.recv(1) == b""


def test_silent_connections_do_not_keep_a_computer_from_the_camera(monkeypatch):
    """Without a limit, a thousand of them left the server no file to open, and it ended."""
    monkeypatch.setattr("sim_backend.doors.uvc.BACKLOG", 3)
    with contextlib.closing(UvcDoor((320, 240), 15.0)) as door, contextlib.ExitStack() as lines:
        connect = partial(socket.create_connection, ("127.0.0.1", door.port), timeout=10)
        silent = [lines.enter_context(connect()) for _ in range(5)]
        computer = lines.enter_context(connect())
        computer.sendall(IMPORT)
        assert len(computer.makefile("rb").read(320)) == 320
        assert [line.recv(1) for line in silent[:3]] == [b""] * 3


def test_a_connection_without_a_request_is_closed(monkeypatch):
    monkeypatch.setattr("sim_backend.doors.uvc.REQUEST_S", 0.01)
    with (
        contextlib.closing(UvcDoor((320, 240), 15.0)) as door,
        socket.create_connection(("127.0.0.1", door.port), timeout=10) as line,
    ):
        line.sendall(LIST[:4])
        assert line.recv(1) == b""


def test_a_computer_that_asks_without_reading_is_disconnected():
    questions = control(1, 0x80, 6, 0x0200, 0, 255) * 1000

    def ask(line):
        for _ in range(2000):
            line.sendall(questions)

    with contextlib.closing(UvcDoor((320, 240), 15.0)) as door:
        with socket.create_connection(("127.0.0.1", door.port), timeout=10) as line:
            line.sendall(IMPORT)
            with pytest.raises(ConnectionError):
                ask(line)
        until(lambda: not door.watched)


def test_a_port_in_use_is_refused_with_advice():
    with (
        contextlib.closing(UvcDoor((320, 240), 15.0)) as door,
        pytest.raises(ConfigError, match="Take another port") as caught,
    ):
        UvcDoor((320, 240), 15.0, door.port)
    assert str(door.port) in str(caught.value)
