"""Failures that only serial ports, TCP and Bluetooth have."""

import contextlib
import errno
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import tty
from concurrent.futures import ThreadPoolExecutor
from itertools import count

import pytest
import serial
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.direct import GetBatteryLevel, KeepAlive
from firmware_protocol.errors import (
    AddressError,
    BrickNotFound,
    LinkBusy,
    LinkError,
    LinkLost,
    LinkTimeout,
    PermissionDenied,
    RemoteProtocolError,
)
from firmware_protocol.framing import BLUETOOTH_TELEGRAM_LIMIT, FrameReader, frame
from firmware_protocol.system import IOMapRead
from nxtdrive.link.link import Link
from nxtdrive.transports import open_transport
from nxtdrive.transports.base import SURPLUS_LIMIT, drain
from nxtdrive.transports.bluetooth import BluetoothTransport
from nxtdrive.transports.nxt_server import NxtServerTransport, split_replies
from nxtdrive.transports.sockets import SocketTransport

PATIENCE_S = 10.0
TELEGRAM = bytes(100)


@pytest.fixture
def terminal():
    """The name of a pseudo-terminal."""
    master, slave = os.openpty()
    tty.setraw(slave)
    yield os.ttyname(slave)
    os.close(slave)
    os.close(master)


def test_a_port_is_held_by_one_program(terminal):
    first = open_transport(f"serial://{terminal}")
    with pytest.raises(LinkBusy, match="other program"):
        open_transport(terminal)
    first.close()
    open_transport(terminal).close()


def test_a_serial_port_is_read_no_longer_than_asked(terminal):
    transport = open_transport(f"serial://{terminal}", timeout_s=PATIENCE_S)
    begun_s = transport.now()
    assert transport.receive(0.1) is None
    assert transport.now() - begun_s < PATIENCE_S / 2
    transport.close()


@pytest.mark.parametrize("error", [OSError(errno.EIO, "gone"), TypeError()])
@pytest.mark.parametrize("use", [lambda each: each.receive(0.0), lambda each: each.waiting()])
def test_a_serial_port_that_is_gone_is_a_lost_link(mocker, use, error):
    port = mocker.patch("serial.Serial").return_value
    type(port).in_waiting = mocker.PropertyMock(side_effect=error)
    with pytest.raises(LinkLost):
        use(open_transport("serial://COM5"))


def test_a_missing_port_means_no_brick():
    with pytest.raises(BrickNotFound, match=r"there is no serial port /dev/rfcomm99.*nxtdrive list"):
        open_transport("serial:///dev/rfcomm99")


def test_a_port_must_be_named():
    with pytest.raises(AddressError, match="names no port"):
        open_transport("serial://")


@pytest.mark.parametrize(
    ("error", "ours"),
    [
        (serial.SerialException(errno.EACCES, "Permission denied"), PermissionDenied),
        (
            serial.SerialException("could not open port 'COM5': PermissionError(13, 'Access is denied.', None, 5)"),
            LinkBusy,
        ),
        (
            serial.SerialException("could not open port 'COM5': PermissionError(13, 'Zugriff verweigert', None, 5)"),
            LinkBusy,
        ),
        (
            serial.SerialException("could not open port 'COM5': FileNotFoundError(2, 'cannot find', None, 2)"),
            BrickNotFound,
        ),
        (serial.SerialException(errno.EHOSTDOWN, "Host is down"), BrickNotFound),
        (ValueError("Not a valid port"), BrickNotFound),
    ],
)
def test_errors_of_the_operating_system_become_ours(mocker, error, ours):
    mocker.patch("serial.Serial", side_effect=error)
    says = "there is no serial port" if "FileNotFound" in str(error) else "COM5"
    with pytest.raises(ours, match=says):
        open_transport("serial://COM5")


def test_the_port_does_not_become_the_controlling_terminal(terminal):
    """Else the end of the link would end a service that owns it, by SIGHUP."""
    code = (
        "import os, sys\n"
        "from nxtdrive.transports import open_transport\n"
        "transport = open_transport(sys.argv[1])\n"
        "try:\n    os.open('/dev/tty', os.O_RDWR)\nexcept OSError:\n    print('none')\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, terminal], capture_output=True, text=True, start_new_session=True, check=True
    )
    assert done.stdout.strip() == "none"


class PosixError(Exception):
    """As termios.error, which Windows does not have."""


@pytest.mark.parametrize("gone", [None, OSError(), TypeError(), PosixError(errno.EIO, "Input/output error")])
def test_a_serial_port_that_may_have_taken_part_of_a_telegram_is_closed(mocker, gone):
    """The rest of it would be taken from the next one."""
    port = mocker.patch("serial.Serial").return_value
    port.write.side_effect = serial.SerialTimeoutException("Write timeout")
    port.reset_output_buffer.side_effect = gone
    transport = open_transport("serial://COM5")
    with pytest.raises(LinkLost, match="accepts no more telegrams"):
        transport.send(b"\x00\x0b")
    port.reset_output_buffer.assert_called_once()  # closing would wait until all is sent
    port.close.assert_called_once()
    with pytest.raises(LinkLost, match="is closed"):
        transport.send(b"\x00\x0b")


@pytest.mark.parametrize("error", [OSError(errno.EIO, "gone"), serial.SerialException("gone"), TypeError()])
def test_a_telegram_that_a_serial_port_did_not_take_is_a_lost_link(mocker, error):
    port = mocker.patch("serial.Serial").return_value
    port.write.side_effect = error
    with pytest.raises(LinkLost):
        open_transport("serial://COM5").send(b"\x00\x0b")


class Choking:
    """A socket that takes a number of bytes, and then none."""

    def __init__(self, inner, left):
        self.inner, self.left = inner, left

    def __getattr__(self, name):
        return getattr(self.inner, name)

    def send(self, data):
        if not self.left:
            raise TimeoutError("timed out")
        taken = self.inner.send(data[: self.left])
        self.left -= taken
        return taken


@pytest.fixture
def connected():
    """A socket transport, and the peer's end."""
    ours, theirs = socket.socketpair()
    with ours, theirs:
        yield SocketTransport("tcp://peer", ours), theirs


@pytest.mark.parametrize("looks", [True, False])
def test_a_piece_of_a_telegram_waits_for_its_rest(connected, looks):
    transport, peer = connected
    for byte in frame(TELEGRAM):
        assert transport.receive(0.0) is None
        peer.sendall(bytes((byte,)))
        assert not looks or transport.waiting()
    assert transport.receive(0.0) == TELEGRAM
    assert not transport.waiting()


@pytest.mark.parametrize(
    "use", [lambda each: each.receive(0.0), lambda each: each.waiting(), lambda each: each.send(b"\0")]
)
def test_a_connection_that_another_thread_closes_is_lost(connected, use):
    transport, _ = connected
    transport._connection.close()  # between the check of the transport and its use
    with pytest.raises(LinkLost):
        use(transport)


def test_closing_gives_the_socket_back():
    ours, theirs = socket.socketpair()
    with theirs:
        SocketTransport("tcp://peer", ours).close()
        assert ours.fileno() == -1


@pytest.mark.slow
def test_a_telegram_waits_for_a_peer_that_is_slow_to_take_it(connected):
    transport, peer = connected

    def fill_the_buffers():
        while True:
            transport.send(TELEGRAM)

    with pytest.raises(LinkTimeout):
        fill_the_buffers()
    with ThreadPoolExecutor(1) as other:
        other.submit(lambda: threading.Event().wait(0.2) or peer.recv(10**6))
        transport.send(TELEGRAM)


def test_closing_ends_the_wait_of_another_thread(connected, mocker):
    transport, _ = connected
    begun = threading.Event()
    mocker.patch.object(transport, "_read", side_effect=lambda timeout_s: begun.set() or read(timeout_s))
    read = transport._connection.read
    with ThreadPoolExecutor(1) as other:
        receiving = other.submit(transport.receive, PATIENCE_S)
        assert begun.wait(PATIENCE_S)
        transport.close()
        with pytest.raises(LinkLost):
            receiving.result(PATIENCE_S / 2)


def test_a_command_is_sent_although_invalid_data_arrived_before_it(connected):
    """The command may be one that stops a motor."""
    transport, peer = connected
    peer.settimeout(PATIENCE_S)
    link = Link(transport, timeout_s=PATIENCE_S)
    peer.sendall(b"\xff\xff\xff")
    with ThreadPoolExecutor(1) as other:
        answering = other.submit(lambda: peer.recv(100) and peer.sendall(frame(BATTERY)))
        assert link.request(GetBatteryLevel()).voltage_mv == 8000
        answering.result()
    assert link.surplus_telegrams == 1
    link.close()


def test_a_peer_that_sends_invalid_data_without_end_is_not_read_without_end(connected):
    transport, _ = connected
    seconds = count()
    transport.now = seconds.__next__
    transport._connection.read = lambda timeout_s: b"\xff" if next(seconds) < 1000 else pytest.fail("no end")
    with pytest.raises(RemoteProtocolError):
        transport.receive(0.0)


def test_a_telegram_after_invalid_data_and_a_silence_is_received(connected):
    """More of the invalid data arrives after the error was found; it would be read as the length of the telegram."""
    transport, peer = connected
    with ThreadPoolExecutor(1) as other:
        peer.sendall(b"\xff\xff\xff")
        other.submit(lambda: threading.Event().wait(0.03) or peer.sendall(b"\x40\x00"))
        with pytest.raises(RemoteProtocolError):
            transport.receive(PATIENCE_S)
    peer.sendall(frame(TELEGRAM))
    assert transport.receive(PATIENCE_S) == TELEGRAM


def test_a_telegram_of_which_only_a_part_was_taken_is_followed_by_no_other(connected):
    transport, peer = connected
    transport._connection._socket = choking = Choking(transport._connection._socket, 150)
    transport.send(TELEGRAM)
    with pytest.raises(LinkLost, match="only part of a telegram"):
        transport.send(TELEGRAM)
    choking.left = 1000
    with pytest.raises(LinkLost):
        transport.send(TELEGRAM)
    frames = FrameReader()
    frames.feed(peer.recv(1000))
    assert [frames.next(), frames.next()] == [TELEGRAM, None]


def test_a_telegram_of_which_nothing_was_taken_may_be_sent_again(connected):
    transport, _ = connected
    choking = transport._connection._socket = Choking(transport._connection._socket, 102)
    transport.send(TELEGRAM)
    with pytest.raises(LinkTimeout, match="accepts no more telegrams"):
        transport.send(TELEGRAM)
    choking.left = 102
    transport.send(TELEGRAM)


@pytest.mark.parametrize(
    "use", [lambda transport: transport.receive(0.0), lambda transport: transport.send(b"\x00\x0b")]
)
def test_a_connection_that_the_system_gave_up_is_lost_and_not_silent(use, mocker):
    """Python raises a TimeoutError for ETIMEDOUT as well, the end of a radio link that went silent."""
    dead = mocker.Mock(
        **{f"{name}.side_effect": TimeoutError(errno.ETIMEDOUT, "timed out") for name in ("recv", "send")}
    )
    with pytest.raises(LinkLost, match=r"is lost: timed out\. Is the brick on"):
        use(SocketTransport("bt://00:16:53:0A:1B:2C", dead))


def test_a_lost_serial_port_says_why_in_the_words_of_the_system(mocker):
    port = mocker.patch("serial.Serial").return_value
    port.read.side_effect = OSError(errno.EIO, os.strerror(errno.EIO))
    with pytest.raises(LinkLost, match=r"is lost: Input/output error\. Is the brick on"):
        open_transport("serial://COM5").receive(0.1)


def test_surplus_telegrams_of_a_peer_that_never_stops_are_not_discarded_without_end(mocker):
    assert drain(mocker.Mock(**{"receive.return_value": TELEGRAM})) == SURPLUS_LIMIT


def test_a_missing_server_means_no_brick():
    with pytest.raises(BrickNotFound, match="server"):
        open_transport("tcp://127.0.0.1:1", timeout_s=0.5)


def test_a_connection_that_cannot_be_set_up_is_closed(mocker):
    """macOS refuses options of a socket whose peer has left."""
    connection = mocker.patch("socket.create_connection").return_value
    connection.setsockopt.side_effect = OSError(errno.EINVAL, "Invalid argument")

    with pytest.raises(BrickNotFound, match="Invalid argument"):
        open_transport("tcp://host")
    connection.close.assert_called_once_with()


@pytest.mark.parametrize(
    ("address", "place"),
    [
        ("tcp://", ("localhost", 2727)),
        ("tcp://host", ("host", 2727)),
        ("tcp://[::1]", ("::1", 2727)),
        ("tcp://[::1]:2728", ("::1", 2728)),
    ],
)
def test_a_port_may_be_left_out(mocker, address, place):
    connect = mocker.patch("socket.create_connection", side_effect=OSError("refused"))
    with pytest.raises(BrickNotFound):
        open_transport(address)
    assert connect.call_args.args == (place,)


@pytest.mark.parametrize("place", ["serial://COM5", "bt://00:16:53:0A:1B:2C", "tcp://host", "nxt-server://host"])
def test_an_address_has_no_options(place):
    with pytest.raises(AddressError, match="unknown option 'speed'"):
        open_transport(f"{place}?speed=3")


@pytest.mark.parametrize("address", ["tcp://host:0", "tcp://host:70000", "tcp://host:x", "tcp://host:²"])
def test_a_port_number_must_be_one(address):
    with pytest.raises(AddressError, match="port"):
        open_transport(address)


@pytest.mark.parametrize("address", ["bt://", "bt://0016530A1B2C", "bt://00:16:53:0A:1B:2G"])
def test_a_bluetooth_address_has_six_bytes_and_colons(address):
    with pytest.raises(AddressError, match="00:16:53"):
        open_transport(address)


def test_without_bluetooth_the_remedy_names_another_way(mocker):
    mocker.patch("socket.socket", side_effect=OSError(errno.EAFNOSUPPORT, "Address family not supported"))
    with pytest.raises(LinkError, match="usb://"):
        open_transport("bt://00:16:53:0A:1B:2C")


@pytest.mark.parametrize(
    ("number", "error"),
    [(errno.EBUSY, LinkBusy), (errno.EHOSTDOWN, BrickNotFound), (errno.EACCES, PermissionDenied)],
)
def test_a_bluetooth_brick_that_does_not_let_us_in(mocker, number, error):
    mocker.patch("socket.socket")
    library = mocker.patch("ctypes.CDLL").return_value
    library.connect.return_value = -1
    mocker.patch("ctypes.get_errno", return_value=number)
    with pytest.raises(error, match="00:16:53:0A:1B:2C"):
        open_transport("bt://00:16:53:0A:1B:2C")


@pytest.mark.parametrize(("timeout_s", "waited_s"), [(1.0, 10.0), (20.0, 20.0)])
@pytest.mark.parametrize(("answer", "error"), [(None, BrickNotFound), (errno.EACCES, PermissionDenied), (0, None)])
def test_a_bluetooth_brick_has_ten_seconds_to_answer(mocker, timeout_s, waited_s, answer, error):
    connection = mocker.patch("socket.socket").return_value
    connection.getsockopt.return_value = answer
    mocker.patch("ctypes.CDLL").return_value.connect.return_value = -1
    mocker.patch("ctypes.get_errno", return_value=errno.EINPROGRESS)
    wait = mocker.patch("select.select", return_value=([], [] if answer is None else [connection], []))
    with pytest.raises(error) if error else contextlib.nullcontext():
        open_transport("bt://00:16:53:0A:1B:2C", timeout_s=timeout_s)
    connection.setblocking.assert_called_with(False)
    assert wait.call_args.args[3] == waited_s
    assert connection.close.called == (error is not None)


def test_ctrl_c_while_a_bluetooth_brick_is_awaited_closes_the_socket(mocker):
    connection = mocker.patch("socket.socket").return_value
    mocker.patch("ctypes.CDLL").return_value.connect.return_value = -1
    mocker.patch("ctypes.get_errno", return_value=errno.EINPROGRESS)
    mocker.patch("select.select", side_effect=KeyboardInterrupt)
    with pytest.raises(KeyboardInterrupt):
        open_transport("bt://00:16:53:0A:1B:2C")
    connection.close.assert_called_once()


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="elsewhere Python's own connect is called")
def test_what_the_system_says_of_a_bluetooth_connection_is_the_error(mocker):
    ours, theirs = socket.socketpair()
    mocker.patch("socket.socket", return_value=ours)
    with theirs, pytest.raises(BrickNotFound, match="does not answer"):
        open_transport("bt://00:16:53:0A:1B:2C")


def test_a_bluetooth_brick_is_asked_for_by_its_bytes_in_reverse(mocker):
    mocker.patch("socket.socket")
    library = mocker.patch("ctypes.CDLL").return_value
    library.connect.return_value = 0
    mocker.patch("ctypes.get_errno", return_value=errno.EBUSY)  # of an earlier call
    transport = open_transport("bt://00:16:53:0a:1b:2c")
    assert isinstance(transport, BluetoothTransport)
    target = library.connect.call_args.args[1]._obj
    assert bytes(target) == bytes.fromhex("1f00 2c1b0a531600 01 00")


@pytest.fixture
def on_windows(monkeypatch, mocker):
    """Returns what `socket.socket` makes where Python has Bluetooth of its own, as on Windows."""
    monkeypatch.setattr(sys, "platform", "win32")
    monkeypatch.setattr(socket, "AF_BLUETOOTH", 32, raising=False)
    monkeypatch.setattr(socket, "BTPROTO_RFCOMM", 3, raising=False)
    return mocker.patch("socket.socket")


def test_on_windows_python_s_own_bluetooth_is_used(on_windows):
    transport = open_transport("bt://00:16:53:0a:1b:2c")
    on_windows.assert_called_once_with(32, socket.SOCK_STREAM, 3)
    on_windows.return_value.settimeout.assert_any_call(10.0)
    on_windows.return_value.connect.assert_called_once_with(("00:16:53:0A:1B:2C", 1))
    on_windows.return_value.send.side_effect = len
    transport.send(b"\x00\x0b")
    on_windows.return_value.send.assert_called_once_with(b"\x02\x00\x00\x0b")


@pytest.mark.parametrize(
    "error", [TimeoutError("timed out"), OSError(10064, "A socket operation failed because the destination was down")]
)
def test_on_windows_an_absent_brick_is_paired_in_the_settings(on_windows, error):
    on_windows.return_value.connect.side_effect = error
    with pytest.raises(BrickNotFound, match=r"00:16:53:0A:1B:2C does not answer.*in the Bluetooth settings"):
        open_transport("bt://00:16:53:0A:1B:2C")
    on_windows.return_value.close.assert_called_once()


@pytest.mark.parametrize("platform", ["darwin", "win32"])
def test_where_python_has_no_bluetooth_the_serial_port_is_the_way(monkeypatch, platform):
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.delattr(socket, "AF_BLUETOOTH", raising=False)
    with pytest.raises(LinkError, match=r"serial://COM5 or serial:///dev/cu\.NXT"):
        open_transport("bt://00:16:53:0A:1B:2C")


@pytest.mark.parametrize(
    ("answer", "error", "said"),
    [
        (b"", LinkLost, "the other end closed the connection. Is the server still running?"),
        (b"\x02\x00", RemoteProtocolError, "this is not an nxt-server"),
    ],
)
def test_another_server_is_not_taken_for_an_nxt_server(answer, error, said):
    with socket.create_server(("127.0.0.1", 0)) as server, ThreadPoolExecutor(1) as other:

        def serve():
            with server.accept()[0] as connection:
                connection.recv(1)
                connection.sendall(answer)

        served = other.submit(serve)
        with pytest.raises(error, match=re.escape(said)):
            open_transport(f"nxt-server://127.0.0.1:{server.getsockname()[1]}", timeout_s=10.0)
        served.result()


class Arriving:
    """A connection on which pieces of bytes arrive, one at each read."""

    def __init__(self, *pieces):
        self.pieces = list(pieces)
        self.written = []

    def read(self, timeout_s):
        return self.pieces.pop(0) if self.pieces else b""

    def write(self, data):
        self.written.append(data)


BATTERY = GetBatteryLevel.encode_reply() + b"\x40\x1f"


@pytest.mark.parametrize("at", range(1, len(BATTERY)))
def test_a_reply_of_an_nxt_server_in_two_pieces_is_one(at):
    pieces = Arriving(BATTERY[:at], BATTERY[at:])
    transport = NxtServerTransport("nxt-server://", pieces, 64)
    transport.send(GetBatteryLevel().encode())
    assert transport.receive(0.0) is None
    assert transport.receive(0.0) == BATTERY
    transport.send(GetBatteryLevel().encode())
    assert transport.receive(0.0) is None


def test_a_refusal_of_an_nxt_server_may_be_shorter_than_the_reply():
    transport = NxtServerTransport("nxt-server://", Arriving(b"\x02\x0b\xbe"), 64)
    assert transport.receive(0.0) == b"\x02\x0b\xbe"


def test_the_rest_of_a_map_of_an_nxt_server_is_awaited():
    whole = IOMapRead.encode_reply() + struct.pack("<IH", 1, 5) + b"hello"
    transport = NxtServerTransport("nxt-server://", Arriving(whole[:-2], whole[-2:]), 64)
    assert transport.receive(PATIENCE_S) == whole


def test_a_reply_that_was_not_requested_does_not_end_the_wait_for_another():
    transport = NxtServerTransport("nxt-server://", Arriving(KeepAlive.encode_reply() + bytes(4), BATTERY), 64)
    transport.send(KeepAlive().encode(want_reply=False))
    assert transport.receive(PATIENCE_S) == BATTERY


@pytest.mark.parametrize(("kind", "longest"), [(b"usb", 64), (b"bluetooth", BLUETOOTH_TELEGRAM_LIMIT)])
def test_the_kind_of_a_link_may_come_in_pieces(mocker, kind, longest):
    mocker.patch("nxtdrive.transports.nxt_server.connect")
    mocker.patch("nxtdrive.transports.nxt_server.Connection", return_value=Arriving(*(bytes((each,)) for each in kind)))
    assert open_transport("nxt-server://host").max_telegram == longest


@given(st.lists(st.sampled_from([BATTERY, b"\x02\x0e\x00\x01"])), st.binary(max_size=70))
def test_no_bytes_of_an_nxt_server_are_lost_or_break_it(whole, noise):
    replies, rest = split_replies(b"".join(whole) + noise)
    assert b"".join(replies) + rest == b"".join(whole) + noise
    assert replies[: len(whole) - 1] == whole[:-1]


@given(st.binary(min_size=1, max_size=70))
def test_any_telegram_goes_to_an_nxt_server_and_requests_a_reply(telegram):
    connection = Arriving()
    NxtServerTransport("nxt-server://", connection, 64).send(telegram)
    assert connection.written == [bytes([telegram[0] & 0x7F]) + telegram[1:]]


def test_a_server_with_another_client_does_not_answer():
    with socket.create_server(("127.0.0.1", 0)) as server, pytest.raises(LinkTimeout, match="one program at a time"):
        open_transport(f"nxt-server://127.0.0.1:{server.getsockname()[1]}", timeout_s=0.1)
