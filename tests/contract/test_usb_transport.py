"""Failures that only USB has. The bus is in conftest.py; pyusb above it is real."""

import ctypes
import errno
import sys
from types import SimpleNamespace

import pytest
import usb.backend.libusb1
import usb.core

from firmware_protocol.direct import GetBatteryLevel
from firmware_protocol.errors import (
    AddressError,
    BrickNotFound,
    LinkBusy,
    LinkError,
    LinkLost,
    LinkTimeout,
    LocalProtocolError,
    PermissionDenied,
)
from firmware_protocol.iomap import COMMAND
from nxtdrive.brick import Brick
from nxtdrive.transports import usb_port
from nxtdrive.transports.address import Address
from nxtdrive.transports.usb_context import UsbContext
from nxtdrive.transports.usb_port import UsbTransport, lego_devices

BATTERY = GetBatteryLevel().encode()


def open_usb(bus, address="usb://"):
    return UsbTransport.open(Address.parse(address), backend=bus)


@pytest.mark.parametrize("address", ["usb://001653010203", "usb://00:16:53:01:02:03", "usb://"])
def test_the_brick_is_found_by_its_id_or_as_the_only_one(usb_bus, address):
    transport = open_usb(usb_bus(), address)
    assert transport.address == "usb://001653010203"
    transport.close()


def test_an_id_may_be_written_in_lower_case(usb_bus):
    for reported, wanted in (("0016530A1B2C", "0016530a1b2c"), ("0016530a1b2c", "0016530A1B2C")):
        transport = open_usb(usb_bus(serial_number=reported), f"usb://{wanted}")
        assert transport.address == "usb://0016530A1B2C"
        transport.close()


def test_another_id_is_not_found_and_the_message_lists_what_is_there(usb_bus):
    with pytest.raises(BrickNotFound, match="001653010203"):
        open_usb(usb_bus(), "usb://001653FFFFFF")


def test_an_empty_bus_has_no_brick(usb_bus):
    bus = usb_bus()
    bus.plugged = False
    with pytest.raises(BrickNotFound, match="Plug the brick in"):
        open_usb(bus)
    assert UsbTransport.discover(bus) == []


@pytest.mark.parametrize("address", ["usb://12345", "usb://zz1653010203", "usb://001653010203?speed=3"])
def test_anything_that_is_not_a_usb_address_is_refused_before_anything_is_opened(usb_bus, address):
    with pytest.raises(AddressError):
        open_usb(usb_bus(), address)


@pytest.mark.parametrize(
    ("operation", "number", "error", "says"),
    [
        ("open_device", errno.EACCES, PermissionDenied, "may not open"),
        ("set_configuration", errno.EBUSY, LinkBusy, "other program"),
        ("claim_interface", errno.EBUSY, LinkBusy, "other program"),
        ("claim_interface", errno.ENODEV, LinkLost, "Plug"),
        ("claim_interface", errno.EOVERFLOW, LinkError, "plug it in again"),
    ],
)
def test_errors_of_the_operating_system_become_ours(usb_bus, operation, number, error, says):
    bus = usb_bus()
    bus.failures[operation] = number
    with pytest.raises(error, match=says) as caught:
        open_usb(bus)
    assert type(caught.value) is error


def test_a_brick_that_may_not_be_opened_is_listed_without_its_id(usb_bus):
    bus = usb_bus()
    bus.failures["open_device"] = errno.EACCES
    assert UsbTransport.discover(bus) == ["usb://"]
    with pytest.raises(PermissionDenied, match="may not open"):
        open_usb(bus, "usb://001653010203")


def test_another_driver_than_libusb_s_is_named_with_the_remedy(usb_bus, monkeypatch):
    """As on Windows while LEGO's own driver has the brick; pyusb has no error of its own for it."""
    bus = usb_bus()

    def open_device(dev):
        raise NotImplementedError("Operation not supported or unimplemented on this platform")

    monkeypatch.setattr(bus, "open_device", open_device)
    with pytest.raises(LinkError, match=r"another driver has the brick.*Zadig"):
        open_usb(bus)
    with pytest.raises(PermissionDenied):
        open_usb(bus, "usb://001653010203")
    assert UsbTransport.discover(bus) == ["usb://"]
    assert lego_devices(bus) == [(0x0694, 0x0002, "")]


def test_what_a_dead_program_left_unread_is_not_an_answer(usb_bus):
    bus = usb_bus()
    bus.waiting = [b"\x02\x0b\x00\x00\x00"] * 3
    transport = open_usb(bus)
    transport.send(BATTERY)
    assert GetBatteryLevel.decode_reply(transport.receive(1.0)).voltage_mv > 1000
    transport.close()


def test_a_brick_that_fails_once_it_is_claimed_is_released(usb_bus):
    bus = usb_bus()
    bus.failures["bulk_read"] = errno.EIO
    with pytest.raises(LinkLost):  # keeps the traceback, and so the device
        open_usb(bus)
    assert not bus.claimed
    assert bus.opened == 0


def test_a_halted_endpoint_recovers(usb_bus):
    bus = usb_bus()
    transport = open_usb(bus)
    transport.send(BATTERY)
    bus.failures["bulk_read"] = errno.EPIPE
    assert transport.receive(0.1) is None
    assert transport.receive(0.1) is not None
    transport.close()


def test_a_halted_way_to_the_brick_is_cleared_and_the_telegram_sent_again(usb_bus):
    bus = usb_bus()
    transport = open_usb(bus)
    bus.failures["bulk_write"] = errno.EPIPE
    transport.send(BATTERY)
    assert transport.receive(0.1) is not None
    transport.close()


def test_a_way_to_the_brick_that_stays_halted_is_a_lost_link(usb_bus):
    bus = usb_bus()
    transport = open_usb(bus)
    bus.stays_halted = True
    bus.failures["bulk_write"] = errno.EPIPE
    with pytest.raises(LinkLost):
        transport.send(BATTERY)
    transport.close()


@pytest.mark.parametrize("number", [errno.ENODEV, errno.EIO, errno.ENOENT, errno.ESHUTDOWN, errno.EPROTO])
@pytest.mark.parametrize("operation", ["bulk_read", "bulk_write"])
def test_a_cable_that_is_pulled_out_is_a_lost_link(usb_bus, operation, number):
    bus = usb_bus()
    transport = open_usb(bus)
    bus.failures[operation] = number
    with pytest.raises(LinkLost, match=r"is unplugged: [^\[]*$"):
        transport.send(BATTERY) if operation == "bulk_write" else transport.receive(0.1)
    transport.close()


@pytest.mark.parametrize(
    ("write", "says"),
    [
        ({"return_value": len(BATTERY) - 1}, "took only part of a telegram"),
        ({"side_effect": usb.core.USBTimeoutError("Operation timed out", -7, errno.ETIMEDOUT)}, "accepts no more"),
    ],
)
def test_a_telegram_that_the_brick_does_not_take_is_a_timeout(usb_bus, mocker, write, says):
    bus = usb_bus()
    transport = open_usb(bus)
    mocker.patch.object(bus, "bulk_write", **write)
    with pytest.raises(LinkTimeout, match=says):
        transport.send(BATTERY)
    transport.close()


def test_an_endpoint_that_a_dead_program_left_halted_is_cleared(usb_bus):
    bus = usb_bus()
    bus.failures["bulk_read"] = errno.EPIPE
    transport = open_usb(bus)
    transport.send(BATTERY)
    assert transport.receive(0.1) is not None
    transport.close()


def test_an_endpoint_that_cannot_be_cleared_causes_no_endless_loop(usb_bus):
    bus = usb_bus()
    bus.stays_halted = True
    bus.failures["bulk_read"] = errno.EPIPE
    transport = open_usb(bus)
    for _ in range(3):
        assert transport.receive(0.01) is None
    transport.close()


def test_a_reply_that_arrives_twice_is_found_at_the_next_look(usb_bus, fault, monkeypatch):
    monkeypatch.setattr(usb_port, "LOOK_EVERY_S", 0.0)
    bus = usb_bus({0: fault.TWICE})
    tick = COMMAND.field("Tick")
    with Brick(open_usb(bus)) as brick:
        ticks = [tick.decode(brick.request(tick.read()).data) for _ in range(4)]
        assert ticks == sorted(set(ticks))


def test_the_look_for_surplus_packets_is_rare(usb_bus, mocker):
    bus = usb_bus()
    transport = open_usb(bus)
    reads = mocker.spy(bus, "bulk_read")
    for _ in range(100):
        assert not transport.waiting()
    assert reads.call_count <= 1
    transport.close()


def test_a_telegram_too_long_for_a_packet_is_not_sent(usb_bus):
    transport = open_usb(usb_bus())
    with pytest.raises(LocalProtocolError, match="64"):
        transport.send(bytes(65))
    transport.close()


@pytest.mark.skipif(usb.backend.libusb1.get_backend() is None, reason="libusb 1.0 is not installed here")
def test_every_search_has_a_libusb_context_of_its_own(mocker):
    """One that was made before the brick was plugged in again may never see it."""
    find = mocker.patch("usb.core.find", return_value=[])
    with pytest.raises(BrickNotFound):
        open_usb(None)
    assert UsbTransport.discover() == lego_devices() == []
    assert len({call.kwargs["backend"].ctx.value for call in find.call_args_list}) == 3


class Libusb:
    """The library in C, with two devices on the bus; notes what is called, and with what."""

    def __init__(self):
        self.calls = []
        self.devices = (ctypes.c_void_p * 2)(11, 12)

    def libusb_init(self, context):
        context._obj.value = 1
        return 0

    def libusb_get_device_list(self, context, listing):
        listing._obj.contents = ctypes.c_void_p.from_buffer(self.devices)
        return len(self.devices)

    def libusb_ref_device(self, device):
        return device

    def libusb_open(self, device, handle):
        handle._obj.value = device
        return 0

    def __getattr__(self, name):
        return lambda *args: self.calls.append((name.removeprefix("libusb_"), getattr(args[0], "value", args[0]))) or 0


@pytest.fixture
def libusb(monkeypatch):
    """The library in the place of the real one."""
    library = Libusb()
    monkeypatch.setattr(usb.backend.libusb1, "_lib", library)
    return library


def test_a_libusb_context_ends_after_its_handles_and_devices(libusb):
    """libusb crashes otherwise."""
    context = UsbContext(libusb)
    devices = list(context.enumerate_devices())
    assert [name for name, _ in libusb.calls] == ["free_device_list"]
    handles = [context.open_device(device) for device in devices]
    context.finalize()
    ended = libusb.calls[1:]
    assert sorted(ended[:2]) == [("close", 11), ("close", 12)]
    assert sorted(ended[2:4]) == [("unref_device", 11), ("unref_device", 12)]
    assert ended[4:] == [("exit", 1)]
    del devices, handles


def test_a_usb_handle_is_closed_once_and_not_used_afterwards(libusb):
    context = UsbContext(libusb)
    handle = context.open_device(next(context.enumerate_devices()))
    libusb.calls.clear()
    for _ in range(2):
        context.release_interface(handle, 0)
        context.close_device(handle)
    assert libusb.calls == [("release_interface", 11), ("close", 11)]
    context.finalize()
    assert ("close", 11) not in libusb.calls[2:]


def test_lego_s_devices_and_bricks_without_a_firmware_are_listed_and_no_others(usb_bus, mocker):
    find = mocker.patch("usb.core.find", return_value=[])
    find.return_value = [SimpleNamespace(idVendor=0x0694, idProduct=0x0005, product="EV3")]
    assert lego_devices(usb_bus()) == [(0x0694, 0x0005, "EV3")]
    ids = ((0x0694, 0x0002), (0x0694, 0x0005), (0x03EB, 0x6124), (0x03EB, 0x0002), (0x046D, 0x6124))
    listed = [find.call_args.kwargs["custom_match"](SimpleNamespace(idVendor=v, idProduct=p)) for v, p in ids]
    assert listed == [True, True, True, False, False]


def test_closing_gives_the_device_back(usb_bus):
    bus = usb_bus()
    transport = open_usb(bus)
    assert bus.claimed
    transport.close()
    assert not bus.claimed
    assert bus.opened == 0


def test_without_libusb_the_remedy_says_what_to_install(monkeypatch):
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda find_library: None)
    with pytest.raises(BrickNotFound, match="libusb"):
        UsbTransport.open(Address.parse("usb://"))


@pytest.mark.parametrize(
    ("platform", "of_the_system", "used"),
    [("linux", "libusb-1.0.so.0", "libusb-1.0.so.0"), ("linux", None, "packaged"), ("win32", "other.dll", "packaged")],
)
def test_linux_uses_its_own_libusb_and_other_systems_the_packaged_one(
    platform, of_the_system, used, monkeypatch, tmp_path
):
    """The packaged one knows no udev, and cannot start in a container."""
    (tmp_path / "libusb_package.py").write_text("def find_library(name):\n    return 'packaged'\n", encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "libusb_package", raising=False)
    monkeypatch.setattr(sys, "platform", platform)
    monkeypatch.setattr("ctypes.util.find_library", lambda _: of_the_system)
    asked = []
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda find_library: asked.append(find_library("usb-1.0")))
    with pytest.raises(BrickNotFound):
        UsbTransport.open(Address.parse("usb://"))
    assert asked == [used]
    sys.modules.pop("libusb_package", None)
