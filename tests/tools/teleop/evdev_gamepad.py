"""Runs a program that finds an Xbox 360 gamepad in /dev/input, through umockdev: ``evdev_gamepad.py FIFO COMMAND...``.

The program's own SDL opens the device node and asks it as it asks the kernel. What the gamepad does is read from the
FIFO, a line each: ``plug``, ``unplug``, ``axis NUMBER VALUE``, ``key NUMBER VALUE``; numbers are those of
linux/input-event-codes.h.
Only umockdev's bindings and the standard library are needed: the system's Python has the former, seldom ours.
"""

import errno
import os
import struct
import subprocess
import sys
import threading
from collections import deque

import gi

gi.require_version("UMockdev", "1.0")
from gi.repository import GLib, UMockdev  # noqa: E402 - the version comes first

FIRST_MINOR = 64
NAME = b"Microsoft X-Box 360 pad\0"
USB, MICROSOFT, XBOX_360, VERSION = 3, 0x045E, 0x028E, 0x0114
SYN, KEY, ABS = 0, 1, 3
KEYS = (0x130, 0x131, 0x133, 0x134, 0x136, 0x137, 0x13A, 0x13B, 0x13C, 0x13D, 0x13E)
STICKS, TRIGGERS, HAT = (0, 1, 3, 4), (2, 5), (16, 17)
"""What Linux's xpad driver offers."""

LETTER = ord("E")
GET_ID, GET_NAME, GET_BITS, GET_KEY_BITS, GET_ABS_BITS, GET_ABS = 0x02, 0x06, 0x20, 0x21, 0x23, 0x40
"""Numbers of evdev's ioctls, see linux/input.h."""
ABS_INFO, EVENT_FORMAT = "6i", "qqHHi"


class Pad(UMockdev.IoctlBase):
    """Answers what SDL asks the device node."""

    def __init__(self):
        super().__init__()
        self.events = deque()
        self.gone = False

    def do_handle_ioctl(self, client):
        request = client.get_request()
        number, size = request & 0xFF, request >> 16 & 0x3FFF
        answer = None if self.gone or request >> 8 & 0xFF != LETTER else _told(number)
        if answer is None:
            client.complete(-1, errno.ENODEV if self.gone else errno.EINVAL)
        else:
            client.get_arg().resolve(0, size).update(0, answer[:size].ljust(size, b"\0"))
            client.complete(min(len(answer), size), 0)
        return True

    def do_handle_read(self, client):
        buffer = client.get_arg()
        room = len(bytes(buffer.retrieve())) // struct.calcsize(EVENT_FORMAT)
        data = b"".join(
            struct.pack(EVENT_FORMAT, 0, 0, *self.events.popleft()) for _ in range(min(room, len(self.events)))
        )
        if self.gone or not data:
            client.complete(-1, errno.ENODEV if self.gone else errno.EAGAIN)
        else:
            buffer.update(0, data)
            client.complete(len(data), 0)
        return True


def _told(number):
    known = {
        GET_ID: struct.pack("4H", USB, MICROSOFT, XBOX_360, VERSION),
        GET_NAME: NAME,
        GET_BITS: _bits(SYN, KEY, ABS),
        GET_KEY_BITS: _bits(*KEYS),
        GET_ABS_BITS: _bits(*STICKS, *TRIGGERS, *HAT),
    }
    if number >= GET_ABS:
        axis = number - GET_ABS
        low, high = (-1, 1) if axis in HAT else (0, 255) if axis in TRIGGERS else (-32768, 32767)
        return struct.pack(ABS_INFO, 0, low, high, 0, 0, 0)
    return known.get(number, b"")


def _bits(*numbers):
    return sum(1 << number for number in numbers).to_bytes(max(numbers) // 8 + 1, "little")


class Socket:
    """Where the gamepad is plugged in."""

    def __init__(self):
        self.testbed = UMockdev.Testbed.new()
        self._pad = None
        self._number = 0

    @property
    def _device(self):
        return f"/devices/virtual/input/input{self._number}/event{self._number}"

    @property
    def _node(self):
        return f"/dev/input/event{self._number}"

    def plug(self):
        self._number += 1  # a testbed makes no node a second time
        self._pad = Pad()
        self.testbed.add_from_string(
            f"P: {self._device}\nN: {self._node.removeprefix('/dev/')}\nE: DEVNAME={self._node}\nE: SUBSYSTEM=input\n"
            f"E: MAJOR=13\nE: MINOR={FIRST_MINOR + self._number}\nE: ID_INPUT=1\nE: ID_INPUT_JOYSTICK=1\n"
        )
        self.testbed.attach_ioctl(self._node, self._pad)
        self.testbed.uevent(f"/sys{self._device}", "add")

    def unplug(self):
        self._pad.gone = True
        self.testbed.uevent(f"/sys{self._device}", "remove")
        self.testbed.detach_ioctl(self._node)
        self.testbed.remove_device(f"/sys{self._device}")

    def obey(self, line):
        match line.split():
            case ["plug"]:
                self.plug()
            case ["unplug"]:
                self.unplug()
            case ["axis" | "key" as kind, number, value]:
                self._pad.events.extend([(ABS if kind == "axis" else KEY, int(number), int(value)), (SYN, 0, 0)])
            case _:
                raise ValueError(line)
        return False  # not again


def main(fifo, *program):
    socket = Socket()
    environ = {**os.environ, "UMOCKDEV_DIR": socket.testbed.get_root_dir()}
    loop = GLib.MainLoop()
    child = subprocess.Popen(program, env=environ)
    GLib.child_watch_add(GLib.PRIORITY_DEFAULT, child.pid, lambda *_: loop.quit())

    def listen():
        with open(fifo) as lines:
            for line in lines:
                GLib.idle_add(socket.obey, line)

    threading.Thread(target=listen, daemon=True).start()
    loop.run()


if __name__ == "__main__":
    main(*sys.argv[1:])
