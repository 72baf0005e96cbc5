"""``nxtdrive list``: addresses to copy, whatever is missing on this computer."""

import json
import sys
from types import SimpleNamespace

import pytest
import serial.tools.list_ports
import usb.backend.libusb1
import usb.core
from serial.tools.list_ports_common import ListPortInfo

from nxtdrive.cli.main import DONE, main
from nxtdrive.transports.address import Address

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


def _listed(capsys):
    assert main(["list", "--json"]) == DONE
    return json.loads(capsys.readouterr().out)


class Bus:
    """Stands for libusb."""

    def __init__(self, library):
        pass


def _plug(monkeypatch, *devices):
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda *_, **__: Bus(None))
    monkeypatch.setattr(usb.backend.libusb1, "_LibUSB", Bus)
    monkeypatch.setattr(usb.core, "find", lambda **_: iter(devices))


def test_the_simulated_brick_is_always_there(no_libusb, capsys):
    assert _listed(capsys)["bricks"] == [{"address": "sim://", "what": "the simulated brick"}]


def test_a_missing_libusb_is_a_note(no_libusb, capsys):
    assert "libusb" in _listed(capsys)["notes"][0]
    assert main(["list"]) == DONE
    assert "note: " in capsys.readouterr().out


def test_bricks_on_usb_go_by_their_serial_number(monkeypatch, capsys):
    _plug(monkeypatch, SimpleNamespace(serial_number="0016530a1b2c"), SimpleNamespace(serial_number="001653000001"))
    found = _listed(capsys)
    assert [place["address"] for place in found["bricks"]] == ["usb://0016530A1B2C", "usb://001653000001", "sim://"]
    assert found["notes"] == []


def test_bluetooth_ports_come_before_others_and_say_so(no_libusb, monkeypatch, capsys):
    ports = [
        _port("/dev/ttyUSB0", "FT232R"),
        _port("/dev/rfcomm0"),
        _port("COM5", "Standard Serial over Bluetooth link (COM5)", r"BTHENUM\{00001101}\7&0&0016530A1B2C_C00000000"),
        _port("/dev/tty.NXT-DevB"),
    ]
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: ports)
    places = _listed(capsys)["bricks"]
    marked = [place["address"] for place in places if "Bluetooth" in place["what"]]
    assert sorted(marked) == ["serial:///dev/rfcomm0", "serial:///dev/tty.NXT-DevB", "serial://COM5"]
    assert [place["address"] for place in places[3:]] == ["serial:///dev/ttyUSB0", "sim://"]
    assert "FT232R" in places[3]["what"]


@LINUX
def test_paired_bricks_are_addresses_to_copy(no_libusb, bluetoothctl, capsys):
    bluetoothctl(
        "echo Device 00:16:53:0A:1B:2D; echo Device 11:22:33:44:55:66 NXT; echo Device 00:16:53:0A:1B:2C my NXT"
    )
    assert _listed(capsys)["bricks"][:-1] == [
        {"address": "bt://00:16:53:0A:1B:2C", "what": "paired LEGO brick my NXT"},
        {"address": "bt://00:16:53:0A:1B:2D", "what": "paired LEGO brick"},
    ]


@LINUX
def test_bluetooth_that_cannot_be_asked_is_a_note(no_libusb, bluetoothctl, capsys):
    bluetoothctl("exit 1")
    assert "systemctl start bluetooth" in _listed(capsys)["notes"][1]


def test_every_address_can_be_parsed(no_libusb, monkeypatch, capsys):
    monkeypatch.setattr(serial.tools.list_ports, "comports", lambda: [_port("/dev/rfcomm0"), _port("COM5")])
    for place in _listed(capsys)["bricks"]:
        assert str(Address.parse(place["address"])) == place["address"]
