"""The bus for pyusb: what pyusb and libusb promise a program holds, over a cable in this process and over a socket."""

import contextlib
import errno
import socket
import threading

import pytest
import usb.core
import usb.util

from firmware_protocol.direct import GetBatteryLevel, GetOutputState
from firmware_protocol.enums import OutputPort
from firmware_protocol.framing import frame
from firmware_protocol.system import IOMapRead
from sim_backend.doors.socket_cable import SocketCable
from sim_backend.doors.usb_backend import UsbBackend
from sim_backend.link import LinkFaults, SimLink
from sim_backend.simulation import Simulation

SERIAL_NUMBER = "001653010203"
GREETING = frame(SERIAL_NUMBER.encode())
GET_BATTERY = GetBatteryLevel().encode()
OUT, IN = 0x01, 0x82
FOR_EVER_MS = 3_600_000


class LinkCable:
    """A cable over a `SimLink` in the same process; simulation time advances only while a program reads."""

    def __init__(self, link):
        self._link = link

    def write(self, packet, timeout_s):
        self._link.send(packet)

    def read(self, timeout_s):
        return self._link.receive(FOR_EVER_MS if timeout_s is None else round(timeout_s * 1000))

    def close(self):
        self._link.close()


@pytest.fixture
def simulation():
    return Simulation("open")


@pytest.fixture
def bus(simulation):
    return UsbBackend(lambda: LinkCable(SimLink(simulation)), SERIAL_NUMBER)


@pytest.fixture
def brick(bus):
    brick = usb.core.find(idVendor=0x0694, idProduct=0x0002, backend=bus)
    yield brick
    usb.util.dispose_resources(brick)


def test_the_descriptors_are_those_of_an_nxt(brick):
    assert (brick.bcdUSB, brick.bDeviceClass, brick.bMaxPacketSize0, brick.speed) == (0x0200, 0, 8, 2)
    assert (brick.manufacturer, brick.product, brick.serial_number) == (None, None, SERIAL_NUMBER)
    (configuration,) = brick
    assert (configuration.bConfigurationValue, configuration.bmAttributes, configuration.bMaxPower) == (1, 0xC0, 0)
    (interface,) = configuration
    assert (interface.bInterfaceClass, interface.bInterfaceSubClass, interface.bInterfaceProtocol) == (255, 255, 255)
    endpoints = [(endpoint.bEndpointAddress, endpoint.bmAttributes, endpoint.wMaxPacketSize) for endpoint in interface]
    assert endpoints == [(OUT, 2, 64), (IN, 2, 64)]


def test_what_programs_do_before_they_talk_works(brick):
    brick.reset()
    brick.set_configuration()
    assert not brick.is_kernel_driver_active(0)
    brick.set_interface_altsetting(0, 0)
    usb.util.claim_interface(brick, 0)
    brick.clear_halt(IN)
    brick.write(OUT, GET_BATTERY)
    assert bytes(brick.read(IN, 64))[:3] == b"\x02\x0b\x00"
    usb.util.release_interface(brick, 0)


def test_simulated_time_passes_while_a_program_reads(brick, simulation):
    with pytest.raises(usb.core.USBTimeoutError) as caught:
        brick.read(IN, 64, 250)
    assert caught.value.errno == errno.ETIMEDOUT
    assert simulation.now_ms == 250


def test_packets_keep_their_boundaries(brick):
    for port in (2, 0, 1):
        brick.write(OUT, GetOutputState(OutputPort(port)).encode())
    assert [brick.read(IN, 64)[3] for _ in range(3)] == [2, 0, 1]


def test_more_than_a_packet_is_several_telegrams(brick):
    brick.write(OUT, GET_BATTERY + bytes(62) + GET_BATTERY)
    assert [brick.read(IN, 64)[1] for _ in range(2)] == [0x0B, 0x0B]


def test_a_full_packet_does_not_end_a_longer_read(brick):
    full = IOMapRead(0x000A0001, 119, 55).encode()
    brick.write(OUT, full)
    brick.write(OUT, GET_BATTERY)
    assert len(brick.read(IN, 128)) == 64 + 5
    brick.write(OUT, full)
    assert len(brick.read(IN, 128, 50)) == 64


def test_a_buffer_too_small_is_an_overflow(brick):
    brick.write(OUT, GET_BATTERY)
    with pytest.raises(usb.core.USBError) as caught:
        brick.read(IN, 3)
    assert caught.value.errno == errno.EOVERFLOW


def test_other_strings_and_requests_stall(brick):
    with pytest.raises(usb.core.USBError) as caught:
        usb.util.get_string(brick, 5)
    assert caught.value.errno == errno.EPIPE
    with pytest.raises(usb.core.USBError) as caught:
        brick.ctrl_transfer(0xC0, 0x42, 0, 0, 8)
    assert caught.value.errno == errno.EPIPE


def test_a_pulled_cable_leaves_no_device(simulation):
    faults = LinkFaults(unplugged_ms=((5, 50),))
    bus = UsbBackend(lambda: LinkCable(SimLink(simulation, faults=faults)), SERIAL_NUMBER)
    brick = usb.core.find(backend=bus)
    for _ in range(2):
        with pytest.raises(usb.core.USBError) as caught:
            brick.read(IN, 64, 1000)
        assert caught.value.errno == errno.ENODEV
    usb.util.dispose_resources(brick)
    with pytest.raises(usb.core.USBError) as caught:
        brick.write(OUT, GET_BATTERY)
    assert caught.value.errno == errno.ENODEV
    simulation.advance(50)
    brick = usb.core.find(backend=bus)
    brick.write(OUT, GET_BATTERY)
    assert brick.read(IN, 64)[1] == 0x0B
    usb.util.dispose_resources(brick)


@pytest.fixture
def far_end():
    """What a `SocketCable` is plugged into, after the greeting."""
    with contextlib.ExitStack() as stack:
        listener = stack.enter_context(socket.create_server(("127.0.0.1", 0)))

        def plug_in(greeting=GREETING):
            listener.settimeout(10)
            accepted = []

            def greet():
                connection = stack.enter_context(listener.accept()[0])
                connection.sendall(greeting)
                accepted.append(connection)
                if not greeting:
                    connection.close()

            thread = threading.Thread(target=greet)
            thread.start()
            try:
                cable = SocketCable("127.0.0.1", listener.getsockname()[1])
                stack.callback(cable.close)
            finally:
                thread.join()
            return cable, accepted[0]

        yield plug_in


def test_a_packet_may_come_in_pieces_and_several_at_once(far_end):
    cable, end = far_end()
    end.sendall(frame(b"one")[:3])
    assert cable.read(0.01) is None
    end.sendall(frame(b"one")[3:] + frame(b"two") + frame(b"three"))
    assert [cable.read(10) for _ in range(3)] == [b"one", b"two", b"three"]


def test_a_packet_goes_out_with_its_length(far_end):
    cable, end = far_end()
    cable.write(GET_BATTERY, 10)
    assert end.recv(100) == frame(GET_BATTERY)


def test_a_brick_that_takes_nothing_is_a_timeout(far_end):
    cable, _ = far_end()

    def fill():
        for _ in range(1_000_000):
            cable.write(bytes(64), 0.0)

    with pytest.raises(TimeoutError):
        fill()


def test_a_far_end_that_hangs_up_is_a_lost_connection(far_end):
    cable, end = far_end()
    end.close()
    with pytest.raises(ConnectionError):
        cable.read(10)


def test_a_client_without_a_greeting_finds_the_brick_in_use(far_end):
    with pytest.raises(BlockingIOError):
        far_end(greeting=b"")


def test_one_program_has_the_cable_and_the_next_gets_it_afterwards(house):
    door = house.add("usb")
    first = house.connect(door)
    assert house.receive(first, 14) == GREETING
    second = house.connect(door)
    assert house.receive(second) == b""
    first.sendall(frame(GET_BATTERY))
    assert house.receive(first, 7)[2:5] == b"\x02\x0b\x00"
    first.close()
    assert house.receive(house.connect(door), 14) == GREETING


def test_a_client_that_comes_just_before_the_other_has_left_is_let_in(house):
    door = house.add("usb")
    first = house.connect(door)
    assert house.receive(first, 14)
    second = house.connect(door)
    house.turn(5)
    first.sendall(frame(GET_BATTERY))
    first.close()
    assert house.receive(second, 14) == GREETING
