"""Several programs at several doors: one brick, and every reply reaches its sender."""

import contextlib
import errno
import socket

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.framing import LENGTH_SIZE, frame
from firmware_protocol.system import IOMapRead, OpenWrite, Write
from sim_backend.doors.door import wait_readable
from sim_backend.doors.sockets import SocketDoor, StreamClient, is_loopback
from sim_backend.doors.switchboard import CLIENT_LIMIT, WAITING_LIMIT
from sim_backend.link import LinkFaults
from tests.open_files import files_left

GET_BATTERY = GetBatteryLevel().encode()


def state_of(port):
    return GetOutputState(OutputPort[port]).encode()


def run_motor(port):
    return SetOutputState(
        OutputPort[port], 80, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0
    ).encode()


class _Framed:
    """A program at a door with lengths in front."""

    def __init__(self, house, door):
        self.house, self.line = house, house.connect(door)

    def ask(self, telegram):
        self.line.sendall(frame(telegram))
        return self.house.receive(self.line, LENGTH_SIZE + 3)[LENGTH_SIZE:]


class _Bare:
    """A program at a door without."""

    def __init__(self, house, door):
        self.house, self.line = house, house.connect(door)

    def ask(self, telegram):
        self.line.sendall(telegram)
        return self.house.receive(self.line, 3)


PROGRAMS = {"tcp": _Framed, "packets": _Framed, "nxt-server": _Bare}


@pytest.mark.parametrize("kind", PROGRAMS)
def test_a_program_gets_its_answer(house, kind):
    program = PROGRAMS[kind](house, house.add(kind))
    assert GetBatteryLevel.decode_reply(program.ask(GET_BATTERY)).voltage_mv > 5000


def test_replies_go_to_the_door_that_asked_and_all_doors_lead_to_one_brick(house):
    programs = [PROGRAMS[kind](house, house.add(kind)) for kind in PROGRAMS for _ in range(2)]
    for program, port in zip(programs, "ABCABC", strict=True):
        telegram = state_of(port)
        program.line.sendall(frame(telegram) if isinstance(program, _Framed) else telegram)
    for program, port in zip(programs, "ABCABC", strict=True):
        skip = LENGTH_SIZE if isinstance(program, _Framed) else 0
        reply = house.receive(program.line, 25 + skip)[skip:]
        assert GetOutputState.decode_reply(reply).port is OutputPort[port]
    programs[0].ask(run_motor("B"))
    for program in programs:
        assert GetOutputState.decode_reply(program.ask(state_of("B"))).power == 80


@pytest.mark.parametrize(("kind", "limit"), [("tcp", 119), ("packets", 55), ("nxt-server", 55)])
def test_each_door_has_the_limits_of_its_link(house, kind, limit):
    program = PROGRAMS[kind](house, house.add(kind))
    reply = program.ask(IOMapRead(0x000A0001, 119, 200).encode())
    assert len(IOMapRead.decode_reply(reply).data) == limit


def test_the_radio_refuses_what_only_the_cable_may(house):
    boot = b"\x01\x97" + b"Let's dance: SAMBA\0"
    assert PROGRAMS["tcp"](house, house.add("tcp")).ask(boot)[2] == 0x8A


def test_a_long_write_over_the_radio_arrives_whole(house):
    program = PROGRAMS["tcp"](house, house.add("tcp"))
    program.ask(OpenWrite("long.txt", 1000).encode())
    assert Write.decode_reply(program.ask(Write(0, bytes(1000)).encode())).size == 1000


def test_nxt_server_reports_its_link_and_ends_on_request(house):
    door = house.add("nxt-server")
    line = house.connect(door)
    line.sendall(b"\x98")
    assert house.receive(line, 3) == b"usb"
    line.sendall(GET_BATTERY + b"\x99")
    assert house.receive(line, 5)[:3] == b"\x02\x0b\x00"
    assert house.receive(line) == b""


def test_a_burst_through_nxt_server_is_not_one_telegram(house):
    program = PROGRAMS["nxt-server"](house, house.add("nxt-server"))
    quiet = SetOutputState(OutputPort.A, 0, OutputMode(0), RegulationMode.IDLE, 0, RunState.IDLE, 0)
    burst = quiet.encode(want_reply=False) * 200
    assert program.ask(burst + state_of("C"))[3] == OutputPort.C
    assert house.board.telegrams == 201


def test_a_client_that_hangs_up_after_a_request_still_gets_the_reply(house):
    line = house.connect(house.add("tcp"))
    line.sendall(frame(GET_BATTERY))
    line.shutdown(1)
    assert house.receive(line, 7)[2:5] == b"\x02\x0b\x00"
    assert house.receive(line) == b""


def test_all_requests_of_a_program_that_disconnects_at_once_are_handled(house):
    program = PROGRAMS["nxt-server"](house, house.add("nxt-server"))
    handle = OpenWrite.decode_reply(program.ask(OpenWrite("short.txt", 10).encode())).handle
    program.line.sendall(Write(handle, bytes(10)).encode())
    program.line.shutdown(1)
    assert Write.decode_reply(house.receive(program.line, 6)).size == 10


def test_programs_that_come_and_go_are_counted(house):
    door = house.add("tcp")
    program = PROGRAMS["tcp"](house, door)
    program.ask(GET_BATTERY)
    program.ask(GET_BATTERY)
    assert house.board.clients == 1
    program.line.close()
    assert house.until(lambda: house.board.clients == 0)
    assert [(each.event, each.client, each.door, each.telegrams) for each in house.events] == [
        ("connected", 1, door.address, 0),
        ("disconnected", 1, door.address, 2),
    ]


def test_a_client_that_leaves_does_not_stop_the_motors_nor_close_the_files(house):
    door = house.add("tcp")
    program = PROGRAMS["tcp"](house, door)
    program.ask(run_motor("A"))
    program.ask(OpenWrite("half.txt", 100).encode())
    program.line.close()
    assert house.until(lambda: house.board.clients == 0)
    program = PROGRAMS["tcp"](house, door)
    assert GetOutputState.decode_reply(program.ask(state_of("A"))).power == 80
    assert program.ask(OpenWrite("half.txt", 100).encode())[2] != 0


def test_a_program_that_never_reads_is_sent_away(house):
    door = house.add("tcp")
    with socket.socket() as line:
        line.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        line.settimeout(10)
        line.connect(("127.0.0.1", door.port))
        line.setblocking(False)
        asking = frame(IOMapRead(0x000A0001, 119, 119).encode())

        def sent_away():
            try:
                line.send(asking * 20)
            except BlockingIOError:
                return False
            except ConnectionError:
                return True
            return False

        assert house.until(sent_away)
        assert house.board.clients == 0
    assert PROGRAMS["tcp"](house, door).ask(GET_BATTERY)[1] == 0x0B


def test_a_flood_waits_outside_the_brick(house):
    door = house.add("tcp")
    line = house.connect(door)
    line.setblocking(False)
    silent = frame(
        SetOutputState(OutputPort.A, 0, OutputMode(0), RegulationMode.IDLE, 0, RunState.IDLE, 0).encode(
            want_reply=False
        )
    )
    flooded = 0
    for _ in range(300):
        with contextlib.suppress(BlockingIOError):
            flooded += line.send(silent * 100)
        house.turn()
    taken = house.board.telegrams
    assert taken < flooded / len(silent)
    assert taken <= 300 + WAITING_LIMIT + 4096 // len(silent) + 1
    assert PROGRAMS["tcp"](house, door).ask(GET_BATTERY)[1] == 0x0B


def test_too_many_programs_are_refused_once_all_have_spoken(house):
    door = house.add("tcp")
    programs = []
    for _ in range(CLIENT_LIMIT):
        programs.append(PROGRAMS["tcp"](house, door))
        assert programs[-1].ask(GET_BATTERY)[1] == 0x0B
    for _ in range(3):
        assert house.receive(house.connect(door)) == b""
    assert house.board.clients == CLIENT_LIMIT
    assert [each.event for each in house.events].count("refused") == 1
    programs[0].line.close()
    assert house.until(lambda: house.board.clients == CLIENT_LIMIT - 1)
    assert PROGRAMS["tcp"](house, door).ask(GET_BATTERY)[1] == 0x0B


def test_programs_that_send_nothing_keep_no_other_out(house):
    door = house.add("tcp")
    silent = []
    for _ in range(CLIENT_LIMIT + 8):
        silent.append(house.connect(door))
        house.turn()
    assert house.board.clients == CLIENT_LIMIT
    assert PROGRAMS["tcp"](house, door).ask(GET_BATTERY)[1] == 0x0B
    assert house.receive(silent[0]) == b"", "the oldest gave way"


def test_a_pulled_cable_ends_connections_until_it_is_back(house):
    house.faults = LinkFaults(unplugged_ms=((100, 400),))
    door = house.add("packets")
    program = PROGRAMS["packets"](house, door)
    program.ask(GET_BATTERY)
    assert house.receive(program.line) == b""
    assert house.simulation.now_ms >= 100
    assert house.receive(house.connect(door)) == b""
    house.turn(400)
    assert PROGRAMS["packets"](house, door).ask(GET_BATTERY)[1] == 0x0B


def test_closing_disconnects_all_programs(house):
    program = PROGRAMS["tcp"](house, house.add("tcp"))
    program.ask(GET_BATTERY)
    house.board.close()
    assert program.line.recv(1) == b""
    assert house.events[-1].event == "disconnected"


@pytest.mark.parametrize(
    ("host", "here_only"),
    [("127.0.0.1", True), ("localhost", True), ("::1", True), ("0.0.0.0", False), ("::", False), ("brick.lan", False)],
)
def test_which_hosts_are_this_computer_only(host, here_only):
    assert is_loopback(host) is here_only


def test_a_program_that_is_gone_before_it_is_accepted_does_not_end_the_server(monkeypatch):
    """On macOS a connection that its program has reset takes no options."""
    door, refusals = SocketDoor(StreamClient, now=lambda: 0.0), iter([True])

    def setsockopt(connection, *option):
        if next(refusals, False):
            raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(socket.socket, "setsockopt", setsockopt, raising=False)
    with contextlib.closing(door), socket.create_connection(("127.0.0.1", door.port)) as first:
        with socket.create_connection(("127.0.0.1", door.port)):
            (client,) = door.accept()
            client.disconnect()
        assert first.recv(1) == b""


def test_a_program_waits_outside_while_too_many_files_are_open(house):
    door = house.add("tcp")
    waiting = _Framed(house, door)
    with files_left(0):
        house.turn()
        # readable would be the listener, at once and again and again
        assert not wait_readable(house.board.files(), 0.0)
    assert waiting.ask(GET_BATTERY)[:2] == b"\x02\x0b"
