"""``nxtdrive list``: addresses to copy, even if this computer lacks something."""

import sys

import pytest
import serial.tools.list_ports
import usb.backend.libusb1
from serial.tools.list_ports_common import ListPortInfo

from firmware_protocol.system import SetBrickName
from nxtdrive.transports.address import Address
from sim_backend.doors.usb_backend import UsbBackend
from sim_backend.firmware.brick import SimBrick

LINUX = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="bluetoothctl is Linux's")


def _port(device, description="n/a", hwid="n/a"):
    port = ListPortInfo(device, skip_link_detection=True)
    port.description, port.hwid = description, hwid
    return port


@pytest.fixture(autouse=True)
def no_ports(monkeypatch, bluetoothctl):
    bluetoothctl("")
    monkeypatch.setattr(serial.tools.list_ports, "comports", list)


@pytest.fixture
def no_libusb(monkeypatch):
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda *_, **__: None)


class Cable:
    """A cable to a simulated brick; `reason` is why it cannot be used."""

    def __init__(self, brick, reason):
        self._brick, self._replies = brick, []
        if reason:
            raise reason

    def write(self, packet, timeout_s):
        reply = self._brick.receive(packet)
        self._replies += [] if reply is None else [reply]
        self._brick.tick()

    def read(self, timeout_s):
        return self._replies.pop(0) if self._replies else None

    def close(self):
        pass


def _plug(monkeypatch, serial_number, reason=None):
    """Put a bus with one brick below pyusb; returns the brick."""
    brick = SimBrick()
    bus = UsbBackend(lambda: Cable(brick, reason), serial_number)
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda *_, **__: bus)
    return brick


def test_the_simulated_brick_is_always_there(no_libusb, answered):
    assert answered("list")["bricks"] == [{"address": "sim://", "what": "the simulated brick"}]


def test_a_missing_libusb_is_a_note(no_libusb, printed, answered):
    assert "libusb" in answered("list")["notes"][0]
    assert "note: " in printed("list")


def test_a_brick_on_usb_goes_by_its_serial_number_and_says_its_name(monkeypatch, answered):
    brick = _plug(monkeypatch, "0016530a1b2c")
    brick.receive(SetBrickName("Robot 7").encode())
    found = answered("list")
    assert found["bricks"][0] == {"address": "usb://0016530A1B2C", "what": "brick on USB, called Robot 7"}
    assert found["notes"] == []


@pytest.mark.parametrize(("reason", "says"), [(BlockingIOError(), "in use"), (OSError(), "does not answer")])
def test_a_brick_on_usb_that_cannot_be_asked_is_listed_all_the_same(monkeypatch, answered, reason, says):
    _plug(monkeypatch, "0016530a1b2c", reason)
    (place, _) = answered("list")["bricks"]
    assert place["address"] == "usb://0016530A1B2C"
    assert says in place["what"]


def test_bluetooth_ports_come_before_others_and_say_so(no_libusb, monkeypatch, answered):
    ports = [
        _port("/dev/ttyUSB0", "FT232R"),
        _port("/dev/rfcomm0"),
        _port("COM5", "Standard Serial over Bluetooth link (COM5)", r"BTHENUM\{00001101}\7&0&0016530A1B2C_C00000000"),
        _port("/dev/tty.NXT-DevB"),
    ]
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: ports)
    places = answered("list")["bricks"]
    marked = [place["address"] for place in places if "Bluetooth" in place["what"]]
    assert sorted(marked) == ["serial:///dev/rfcomm0", "serial:///dev/tty.NXT-DevB", "serial://COM5"]
    assert [place["address"] for place in places[3:]] == ["serial:///dev/ttyUSB0", "sim://"]
    assert "FT232R" in places[3]["what"]


@LINUX
def test_paired_bricks_are_addresses_to_copy(no_libusb, bluetoothctl, answered):
    bluetoothctl(
        "echo Device 00:16:53:0A:1B:2D; echo Device 11:22:33:44:55:66 NXT; echo Device 00:16:53:0A:1B:2C my NXT"
    )
    assert answered("list")["bricks"][:-1] == [
        {"address": "bt://00:16:53:0A:1B:2C", "what": "paired LEGO brick my NXT"},
        {"address": "bt://00:16:53:0A:1B:2D", "what": "paired LEGO brick"},
    ]


@LINUX
def test_bluetooth_that_cannot_be_asked_is_a_note(no_libusb, bluetoothctl, answered):
    bluetoothctl("exit 1")
    assert "systemctl start bluetooth" in answered("list")["notes"][1]


def test_every_address_can_be_parsed(no_libusb, monkeypatch, answered):
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: [_port("/dev/rfcomm0"), _port("COM5")])
    for place in answered("list")["bricks"]:
        assert str(Address.parse(place["address"])) == place["address"]
