"""Run a native program with the simulated brick on its USB, through umockdev, which replaces the kernel for libusb.

``nxtdrive sim exec --native`` starts it: ``native.py HOST PORT SERIAL-NUMBER COMMAND...``, in whatever interpreter has
umockdev's bindings (Debian: python3-gi and gir1.2-umockdev-1.0). Only those and the standard library are needed.
The program, linked with libusb 0.1 or 1.0, opens a device node that is a file, and each of its ioctls arrives here.
"""

from __future__ import annotations

import errno
import os
import runpy
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import gi

gi.require_version("UMockdev", "1.0")
from gi.repository import GLib, UMockdev  # noqa: E402 - the version comes first

DOORS = Path(__file__).resolve().parents[1]
SocketCable = runpy.run_path(str(DOORS / "socket_cable.py"))["SocketCable"]
NXT = runpy.run_path(str(DOORS / "nxt_descriptors.py"))

NODE = "bus/usb/001/002"
PRELOAD = "libumockdev-preload.so.0"

ENDPOINT_IN, PACKET_SIZE = NXT["ENDPOINT_IN"], NXT["PACKET_SIZE"]
ENGLISH = b"\x04\x03\x09\x04"
DEVICE_TO_HOST, GET_DESCRIPTOR, GET_CONFIGURATION = 0x80, 0x06, 0x08
STRING = 3

CONTROL, SUBMIT, DISCARD, REAP, REAP_NO_DELAY = 0x00, 0x0A, 0x0B, 0x0C, 0x0D
CLAIM, RELEASE = 0x0F, 0x10
HARMLESS = (0x03, 0x04, 0x05, 0x14, 0x15)
"""Numbers of usbdevfs ioctls, see Linux's usbdevice_fs.h; harmless ones: reset endpoint, set interface, set
configuration, reset, clear halt."""

HANDOVER_MS = 200

SETUP_SIZE, SETUP_LENGTH = 8, 6
CONTROL_SIZE, CONTROL_DATA = 24, 16
URB_CONTROL = 2
URB_SIZE, URB_STATUS, URB_BUFFER, URB_LENGTH, URB_ACTUAL = 56, 4, 16, 24, 28
"""`struct usb_ctrlrequest`, `struct usbdevfs_ctrltransfer` and `struct usbdevfs_urb` on 64 bits."""

Answer = tuple[int, int]
DONE: Answer = (0, 0)


class Bus(UMockdev.IoctlBase):  # type: ignore[misc] # no types
    """Handles the ioctls on the brick's device node."""

    def __init__(self, host: str, port: int, serial_number: str) -> None:
        super().__init__()
        text = serial_number.encode("utf-16-le")
        self._standard = {
            (DEVICE_TO_HOST, GET_DESCRIPTOR, 1 << 8): NXT["DEVICE"],
            (DEVICE_TO_HOST, GET_DESCRIPTOR, 2 << 8): NXT["WHOLE_CONFIGURATION"],
            (DEVICE_TO_HOST, GET_DESCRIPTOR, STRING << 8): ENGLISH,
            (DEVICE_TO_HOST, GET_DESCRIPTOR, STRING << 8 | 1): bytes((len(text) + 2, STRING)) + text,
            (DEVICE_TO_HOST, GET_CONFIGURATION, 0): b"\x01",
        }
        self._address = host, port
        self._cable: Any = None
        self._owner: Any = None
        self._reading: dict[bytes, Any] = {}
        self._finished: list[Any] = []

    def do_handle_ioctl(self, client: Any) -> bool:  # noqa: ANN401 - the bindings have no types, here and below
        """Handle one ioctl; called by umockdev."""
        if client.get_request() & 0xFF == CLAIM and self._in_use(client):
            # the end of the previous program may not have been noticed yet
            GLib.timeout_add(HANDOVER_MS, self._complete, client)
        else:
            self._complete(client)
        return True

    def _complete(self, client: Any) -> bool:  # noqa: ANN401
        try:
            result, error = self._answer(client, client.get_request() & 0xFF, client.get_arg())
        except OSError as refused:
            result, error = _refuse(refused.errno or errno.ENODEV)
        client.complete(result, error)
        return False  # do not repeat

    def _answer(self, client: Any, number: int, argument: Any) -> Answer:  # noqa: ANN401
        if number in HARMLESS:
            return DONE
        if number == CLAIM:
            return self._claim(client)
        if number == RELEASE:
            return self._release(client)
        if number == CONTROL:
            return self._control(argument.resolve(0, CONTROL_SIZE))
        if number == SUBMIT:
            return self._submit(bytes(argument.retrieve()), argument.resolve(0, URB_SIZE))
        if number == DISCARD:
            return self._discard(bytes(argument.retrieve()))
        if number in (REAP, REAP_NO_DELAY):
            return self._reap(argument)
        return _refuse(errno.ENOTTY)

    def _in_use(self, client: Any) -> bool:  # noqa: ANN401
        """Return whether another program has the brick, and has neither closed the node nor ended."""
        return self._owner is not None and self._owner is not client and self._owner.get_connected()

    def _claim(self, client: Any) -> Answer:  # noqa: ANN401
        """Give the brick to one program."""
        if self._in_use(client):
            return _refuse(errno.EBUSY)
        if self._owner is not client:
            self._release(self._owner)
        self._cable = self._cable or SocketCable(*self._address)
        self._owner = client
        return DONE

    def _release(self, client: Any) -> Answer:  # noqa: ANN401
        """Take the brick back."""
        if self._owner is client and self._cable is not None:
            self._cable.close()
            self._cable = self._owner = None
            self._reading.clear()
            self._finished.clear()
        return DONE

    def _control(self, transfer: Any) -> Answer:  # noqa: ANN401
        """Answer a control transfer as libusb 0.1 requests it."""
        setup = bytes(transfer.retrieve())[:SETUP_SIZE]
        answer = self._standard_reply(setup)
        if answer is None:
            return _refuse(errno.EPIPE)
        transfer.resolve(CONTROL_DATA, _length(setup, SETUP_LENGTH, 2)).update(0, answer)
        return len(answer), 0

    def _standard_reply(self, setup: bytes) -> bytes | None:
        """Reply to a standard request; None where the brick stalls."""
        answer = self._standard.get((setup[0], setup[1], setup[2] | setup[3] << 8))
        return None if answer is None else answer[: _length(setup, SETUP_LENGTH, 2)]

    def _submit(self, pointer: bytes, urb: Any) -> Answer:  # noqa: ANN401
        """Accept a request: packets to the brick are sent at once, packets from it are read when reaped."""
        head = bytes(urb.retrieve())
        length = _length(head, URB_LENGTH)
        if head[0] == URB_CONTROL:
            self._submit_control(urb, urb.resolve(URB_BUFFER, length))
            return DONE
        if self._cable is None:
            return _refuse(errno.ENODEV)
        if head[1] == ENDPOINT_IN:
            self._reading[pointer] = urb
            return DONE
        data = bytes(urb.resolve(URB_BUFFER, length).retrieve())
        for start in range(0, length, PACKET_SIZE):
            self._cable.write(data[start : start + PACKET_SIZE], None)
        self._finish(urb, length)
        return DONE

    def _submit_control(self, urb: Any, buffer: Any) -> None:  # noqa: ANN401
        """Answer a control transfer as libusb 1.0 requests it: the setup packet comes first in the buffer."""
        answer = self._standard_reply(bytes(buffer.retrieve())[:SETUP_SIZE])
        if answer is None:
            self._finish(urb, 0, -errno.EPIPE)
            return
        buffer.update(SETUP_SIZE, answer)
        self._finish(urb, len(answer))

    def _discard(self, pointer: bytes) -> Answer:
        urb = self._reading.pop(pointer, None)
        if urb is None:
            return _refuse(errno.EINVAL)
        self._finish(urb, 0, -errno.ENOENT)
        return DONE

    def _reap(self, argument: Any) -> Answer:  # noqa: ANN401
        """Return a finished request."""
        if self._reading and not self._finished:
            self._read()
        if not self._finished:
            return _refuse(errno.EAGAIN)
        argument.resolve(0, 8).set_ptr(0, self._finished.pop(0))
        return DONE

    def _read(self) -> None:
        packet = self._cable.read(0.0) if self._cable is not None else None
        if packet is not None:
            urb = self._reading.pop(next(iter(self._reading)))
            length = _length(bytes(urb.retrieve()), URB_LENGTH)
            urb.resolve(URB_BUFFER, length).update(0, packet[:length])
            self._finish(urb, len(packet[:length]))

    def _finish(self, urb: Any, actual: int, status: int = 0) -> None:  # noqa: ANN401
        urb.update(URB_STATUS, status.to_bytes(4, "little", signed=True))
        urb.update(URB_ACTUAL, actual.to_bytes(4, "little"))
        self._finished.append(urb)


def _length(data: bytes, start: int, size: int = 4) -> int:
    return int.from_bytes(data[start : start + size], "little")


def _refuse(number: int) -> Answer:
    return -1, number


def _testbed() -> UMockdev.Testbed:
    testbed = UMockdev.Testbed.new()
    descriptors = (NXT["DEVICE"] + NXT["WHOLE_CONFIGURATION"]).hex().upper()
    testbed.add_from_string(
        f"P: /devices/pci0000:00/usb1/1-1\nN: {NODE}={descriptors}\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\n"
        f"E: DEVNAME=/dev/{NODE}\nE: BUSNUM=001\nE: DEVNUM=002\nA: busnum=1\\n\nA: devnum=2\\n\nA: speed=12\\n\n"
        f"A: bConfigurationValue=1\\n\nH: descriptors={descriptors}\n"
    )
    return testbed


def main(host: str, port: str, serial_number: str, *program: str) -> int:
    """Run the program; returns its exit code, 128 plus the number of a signal that ended it."""
    testbed, bus = _testbed(), Bus(host, int(port), serial_number)
    testbed.attach_ioctl(f"/dev/{NODE}", bus)
    preload = ":".join(filter(None, [PRELOAD, os.environ.get("LD_PRELOAD")]))
    environ = {**os.environ, "LD_PRELOAD": preload, "UMOCKDEV_DIR": testbed.get_root_dir()}
    loop, ended = GLib.MainLoop(), []

    def end(_: int, status: int) -> None:
        ended.append(os.waitstatus_to_exitcode(status))
        loop.quit()

    child = subprocess.Popen(program, env=environ)  # noqa: S603 - what the user asked for
    GLib.child_watch_add(GLib.PRIORITY_DEFAULT, child.pid, end)

    def pass_on(number: int) -> bool:
        child.send_signal(number)
        return True  # keep the handler

    for number in (signal.SIGTERM, signal.SIGHUP):
        GLib.unix_signal_add(GLib.PRIORITY_DEFAULT, number, pass_on, number)
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the terminal's Ctrl-C reaches the program directly
    loop.run()
    testbed.detach_ioctl(f"/dev/{NODE}")
    return ended[0] if ended[0] >= 0 else 128 - ended[0]


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
