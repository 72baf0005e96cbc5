"""Every transport, each with a simulated brick at the other end that misbehaves on demand.

A rig opens a transport whose brick does to the n-th telegram what `faults[n]` says. The pseudo-terminal and the TCP
server are real ones of this computer's kernel, served by a thread; pyusb is real down to its backend.
"""

import contextlib
import errno
import os
import select
import socket
import tempfile
import threading
import tty
from concurrent.futures import ThreadPoolExecutor
from enum import Enum, auto
from pathlib import Path

import pytest
import usb.core

from firmware_protocol.framing import FrameReader, frame
from nxtdrive.transports.address import Address
from nxtdrive.transports.bluetooth import BluetoothTransport
from nxtdrive.transports.nxt_server import NxtServerTransport
from nxtdrive.transports.record import RecordTransport
from nxtdrive.transports.serial_port import SerialTransport
from nxtdrive.transports.sim import SimTransport
from nxtdrive.transports.tcp import TcpTransport
from nxtdrive.transports.trace_file import Trace, TraceWriter
from nxtdrive.transports.usb_port import UsbTransport
from sim_backend.doors.usb_backend import ENDPOINT_IN, ENDPOINT_OUT, UsbBackend
from sim_backend.firmware.brick import SimBrick
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

NEVER_MS = 10**9
ROUND_TRIP_MS = 2


class Fault(Enum):
    """What happens to the reply to one telegram."""

    DROP = auto()
    LATE = auto()  # after the driver has given up
    TWICE = auto()
    GARBAGE = auto()  # as many bytes, none of them right
    HALF = auto()  # in pieces only: half of it, then silence
    PIECES = auto()  # in pieces only: byte by byte
    NONSENSE = auto()  # streams only: bytes that are not frames, in front of the reply
    UNPLUG = auto()


class Peer:
    """A simulated brick and what goes wrong with it."""

    def __init__(self, faults):
        self.brick = SimBrick()
        self.faults = dict(faults)
        self.number = 0
        self.held_back = []

    def answer(self, telegram):
        """Replies to hand over now, and the fault to apply to the last of them."""
        fault = self.faults.get(self.number)
        self.number += 1
        reply = self.brick.receive(telegram)
        self.brick.tick()
        replies, self.held_back = self.held_back, []
        if reply is None or fault is Fault.DROP:
            return replies, None
        if fault is Fault.LATE:
            self.held_back = [reply]
            return replies, None
        if fault is Fault.GARBAGE:
            reply = bytes(byte ^ 0xFF for byte in reply)
        return [*replies, *([reply, reply] if fault is Fault.TWICE else [reply])], fault


class StreamServer(threading.Thread):
    """Serves a peer on a stream of bytes until the other end closes it."""

    def __init__(self, peer, read, write, disconnect):
        super().__init__(daemon=True)
        self.peer, self.read, self.write, self.disconnect = peer, read, write, disconnect

    def run(self):
        frames = FrameReader()
        with contextlib.suppress(OSError):
            while data := self.read():
                frames.feed(data)
                while (telegram := frames.next()) is not None:
                    if not self.serve(telegram):
                        return

    def serve(self, telegram):
        replies, fault = self.peer.answer(telegram)
        if fault is Fault.UNPLUG:
            self.disconnect()
            return False
        for reply in replies:
            framed = self.framed(reply)
            if fault is Fault.HALF:
                self.write(framed[: len(framed) // 2])
            elif fault is Fault.PIECES:
                for i in range(len(framed)):
                    self.write(framed[i : i + 1])
            elif fault is Fault.NONSENSE:
                self.write(b"\xff\xff\xff" + framed)
            else:
                self.write(framed)
        return True

    def framed(self, reply):
        return frame(reply)


class Rig:
    """Opens transports and cleans up after them."""

    streams = False
    in_pieces = False
    faulty = True

    def __init__(self, stack):
        self.stack = stack

    def open(self, faults=()):
        """A transport to a fresh brick; `faults` is a dict."""
        transport = self.connect(dict(faults))
        self.stack.callback(transport.close)
        return transport


class SimRig(Rig):
    """``sim://``: faults are those of the simulated link."""

    def connect(self, faults):
        simulation = Simulation("open")

        def numbers(kind):
            return [number for number, fault in faults.items() if fault is kind]

        links = LinkFaults(
            drop_replies=numbers(Fault.DROP),
            duplicate_replies=numbers(Fault.TWICE),
            corrupt_replies=numbers(Fault.GARBAGE),
            delay_replies_ms=dict.fromkeys(numbers(Fault.LATE), 150),
            unplugged_ms=tuple((1 + ROUND_TRIP_MS * number, NEVER_MS) for number in numbers(Fault.UNPLUG)),
        )
        return SimTransport(simulation, latency_ms=ROUND_TRIP_MS, faults=links)


class SerialRig(Rig):
    """A pseudo-terminal: what ``serial://`` sees is a tty of the kernel."""

    streams = in_pieces = True

    def connect(self, faults):
        master, slave = os.openpty()
        tty.setraw(slave)
        wake, closed = os.pipe()
        open_ends = [master, slave]

        def read():
            ready, _, _ = select.select([master, wake], [], [])
            return b"" if wake in ready else os.read(master, 4096)

        def disconnect():
            while open_ends:
                os.close(open_ends.pop())

        server = StreamServer(Peer(faults), read, lambda data: os.write(master, data), disconnect)
        transport = SerialTransport.open(Address.parse(f"serial://{os.ttyname(slave)}"))
        server.start()

        def end():
            os.close(closed)
            server.join()
            os.close(wake)
            disconnect()

        self.stack.callback(end)
        return transport


class SocketRig(Rig):
    """A server on the loopback interface."""

    def listen(self):
        return self.stack.enter_context(socket.create_server(("127.0.0.1", 0)))

    def serve(self, kind, listener, faults):
        """Serve the next program that connects."""
        self.serve_socket(kind, self.stack.enter_context(listener.accept()[0]), faults)

    def serve_socket(self, kind, connection, faults):
        """Serve the program at the other end of this connection."""
        server = kind(Peer(faults), lambda: connection.recv(4096), connection.sendall, connection.close)
        server.start()

        def end():
            with contextlib.suppress(OSError):
                connection.shutdown(socket.SHUT_RDWR)
            server.join()

        self.stack.callback(end)


class TcpRig(SocketRig):
    """Telegrams with their length in front."""

    streams = in_pieces = True

    def connect(self, faults):
        listener = self.listen()
        transport = TcpTransport.open(Address.parse(f"tcp://127.0.0.1:{listener.getsockname()[1]}"))
        self.serve(StreamServer, listener, faults)
        return transport


class BluetoothRig(SocketRig):
    """A connected socket in the place of the kernel's RFCOMM socket; how that is made is tested by itself."""

    streams = in_pieces = True

    def connect(self, faults):
        ours, theirs = socket.socketpair()
        self.serve_socket(StreamServer, self.stack.enter_context(theirs), faults)
        return BluetoothTransport("bt://00:16:53:01:02:03", ours)


class DatagramServer(StreamServer):
    """Serves a peer as nxt-python's server does: whatever is read at once is one telegram."""

    def run(self):
        with contextlib.suppress(OSError):
            while data := self.read():
                if data == b"\x98":
                    self.write(b"usb")
                elif data == b"\x99" or not self.serve(data):
                    return

    def framed(self, reply):
        return reply


class NxtServerRig(SocketRig):
    """nxt-python's server protocol."""

    in_pieces = True

    def connect(self, faults):
        listener = self.listen()
        address = Address.parse(f"nxt-server://127.0.0.1:{listener.getsockname()[1]}")
        with ThreadPoolExecutor(1) as other:
            opening = other.submit(NxtServerTransport.open, address)
            self.serve(DatagramServer, listener, faults)
            return opening.result()


class RecordRig(SimRig):
    """The simulator, recorded."""

    def connect(self, faults):
        path = Path(self.stack.enter_context(tempfile.TemporaryDirectory())) / "talk.nxttrace"
        inner = super().connect(faults)
        header = Trace(inner.address, inner.max_telegram)
        return RecordTransport(inner, TraceWriter(path, header), inner.now())


class SimulatedUsb(UsbBackend):
    """A USB bus with one brick on it that misbehaves; it describes itself as the one for other programs does.

    Attributes:
        failures: Error numbers that operations fail with, by the operation's name.
        claimed: Whether an interface is claimed.
        stays_halted: Whether an endpoint stays halted although that is cleared.
    """

    def __init__(self, faults=(), serial_number="001653010203"):
        super().__init__(None, serial_number)
        self.peer = Peer(faults)
        self.failures = {}
        self.waiting = []
        self.claimed = self.stays_halted = False
        self.plugged = True
        self.opened = 0

    def fail(self, operation):
        number = errno.ENODEV if not self.plugged else self.failures.get(operation)
        if number:
            raise usb.core.USBError(os.strerror(number), None, number)

    def enumerate_devices(self):
        return super().enumerate_devices() if self.plugged else iter([])

    def open_device(self, dev):
        self.fail("open_device")
        self.opened += 1
        return self

    def close_device(self, dev_handle):
        self.opened -= 1

    def set_configuration(self, dev_handle, config_value):
        self.fail("set_configuration")

    def claim_interface(self, dev_handle, intf):
        self.fail("claim_interface")
        self.claimed = True

    def release_interface(self, dev_handle, intf):
        self.claimed = False

    def clear_halt(self, dev_handle, ep):
        if not self.stays_halted:
            self.failures.pop("bulk_read" if ep == ENDPOINT_IN else "bulk_write", None)

    def bulk_write(self, dev_handle, ep, intf, data, timeout):
        assert ep == ENDPOINT_OUT
        self.fail("bulk_write")
        replies, fault = self.peer.answer(bytes(data))
        self.plugged = fault is not Fault.UNPLUG
        self.waiting += replies
        return len(data)

    def bulk_read(self, dev_handle, ep, intf, buff, timeout):
        assert ep == ENDPOINT_IN
        assert timeout > 0, "0 would wait forever"
        self.fail("bulk_read")
        if not self.waiting:
            threading.Event().wait(timeout / 1000)
            raise usb.core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)
        packet = self.waiting.pop(0)
        buff[: len(packet)] = type(buff)("B", packet)
        return len(packet)


class UsbRig(Rig):
    """pyusb with a bus of our own under it."""

    def connect(self, faults):
        return UsbTransport.open(Address.parse("usb://"), backend=SimulatedUsb(faults))


class HardwareRig(Rig):
    """A real brick, named by ``--nxt``; it has no faults to offer."""

    faulty = False
    address = ""

    def connect(self, faults):
        from nxtdrive.transports import open_transport

        return open_transport(self.address)


RIGS = {
    "sim": SimRig,
    "serial": SerialRig,
    "bt": BluetoothRig,
    "tcp": TcpRig,
    "usb": UsbRig,
    "nxt-server": NxtServerRig,
    "record": RecordRig,
}


def pytest_generate_tests(metafunc):
    if "rig" in metafunc.fixturenames:
        hardware = metafunc.config.getoption("--nxt")
        metafunc.parametrize("rig", [hardware] if hardware else list(RIGS), indirect=True)


@pytest.fixture
def rig(request):
    """Opens one kind of transport."""
    with contextlib.ExitStack() as stack:
        made = RIGS.get(request.param, HardwareRig)(stack)
        made.address = request.param
        yield made


@pytest.fixture
def faulty_rig(rig):
    """A rig that can misbehave."""
    if not rig.faulty:
        pytest.skip("a real brick does not misbehave on demand")
    return rig


@pytest.fixture
def stream_rig(faulty_rig):
    """A rig of a transport that frames telegrams in a stream."""
    if not faulty_rig.streams:
        pytest.skip("this transport moves whole packets")
    return faulty_rig


@pytest.fixture
def piecemeal_rig(faulty_rig):
    """A rig of a transport to which a telegram may come in pieces."""
    if not faulty_rig.in_pieces:
        pytest.skip("this transport moves whole packets")
    return faulty_rig


@pytest.fixture
def fault():
    """The faults by name."""
    return Fault


@pytest.fixture
def usb_bus():
    """Makes USB buses with a brick on each."""
    return SimulatedUsb
