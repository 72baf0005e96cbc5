"""Runs in the guest as its first process: runs commands for the host, plugs devices in. Only the standard library.

Each connection has one request, a line of JSON, and gets lines of JSON:

- ``{"run": "shell command", "timeout_s": 60, "user": 65534}``: ``{"out": "text"}`` or ``{"err": "text"}`` as they come,
  then ``{"code": 0}``; a command that takes too long is interrupted as by Ctrl-C, then killed.
- ``{"plug": 3240, "port": 0}``: plugs the USB/IP device at the host's port 3240 into the kernel's port 0;
  ``{"code": 0}``.
- ``{"adapter": 3242}``: makes the Bluetooth adapter at the host's port the kernel's; ``{"code": 0}``.
- ``{"halt": true}``: switches the guest off.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
import select
import selectors
import signal
import socket
import socketserver
import struct
import subprocess
import threading
import time
from pathlib import Path

PORT = 2222
HOST = "10.0.2.100"
"""The host, as QEMU shows it to the guest."""

VHCI = Path("/sys/devices/platform/vhci_hcd.0/attach")
IMPORT = struct.pack(">HHI32s", 0x0111, 0x8003, 0, b"1-1")
REPLY = struct.Struct(">HHI256s32sIII")
REPLY_SIZE = 8 + 312
ADAPTER = Path("/sys/class/bluetooth/hci0")
AF_BLUETOOTH, BTPROTO_HCI, HCI_DEVICE_UP = 31, 1, 0x400448C9
"""Linux's; a Python built without BlueZ's headers does not name them. Without bluetoothd the kernel switches an adapter
off again after two seconds."""

VENDOR_PACKET = 0xFF
"""Makes /dev/vhci create an adapter, and returns its number."""

GRACE_S = 10.0


class Handler(socketserver.StreamRequestHandler):
    """Handles one request."""

    def handle(self) -> None:
        """Answer the request."""
        request = json.loads(self.rfile.readline())
        if "run" in request:
            self._run(request)
        elif "plug" in request:
            self._say(code=plug(request["plug"], request["port"]))
        elif "adapter" in request:
            plug_adapter(request["adapter"])
            self._say(code=0)
        elif "halt" in request:
            self._say(code=0)
            os.sync()
            subprocess.run(["/usr/bin/busybox", "poweroff", "-f"], check=False)

    def _say(self, **values: object) -> None:
        self.wfile.write(json.dumps(values).encode() + b"\n")
        self.wfile.flush()

    def _run(self, request: dict) -> None:  # type: ignore[type-arg]
        process = subprocess.Popen(
            ["/bin/bash", "-c", request["run"]],
            cwd="/run/tmp",
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            start_new_session=True,
            user=request.get("user"),
            group=request.get("user"),
            extra_groups=request.get("groups", []),
        )
        until = time.monotonic() + request.get("timeout_s", 60.0)
        signals = [signal.SIGINT, signal.SIGKILL]
        with selectors.DefaultSelector() as selector:
            for name, pipe in (("out", process.stdout), ("err", process.stderr)):
                if pipe is not None:
                    selector.register(pipe, selectors.EVENT_READ, name)
            while selector.get_map():
                for key, _ in selector.select(max(0.0, until - time.monotonic())):
                    data = os.read(key.fd, 65536)
                    if data:
                        self._say(**{key.data: data.decode(errors="replace")})
                    else:
                        selector.unregister(key.fileobj)
                if time.monotonic() > until and signals:
                    os.killpg(process.pid, signals.pop(0))
                    until = time.monotonic() + GRACE_S
        self._say(code=process.wait())


def plug(host_port: int, kernel_port: int) -> int:
    """Attach a device as ``usbip attach`` does; returns the status of the import, 0 for success."""
    with socket.create_connection((HOST, host_port), timeout=10) as cable:
        cable.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        cable.sendall(IMPORT)
        reply = b""
        while len(reply) < REPLY_SIZE:
            data = cable.recv(REPLY_SIZE - len(reply))
            if not data:
                break
            reply += data
        status = struct.unpack_from(">I", reply, 4)[0] if len(reply) >= 8 else -1
        if status == 0:
            bus, device, speed = REPLY.unpack_from(reply)[5:]
            cable.settimeout(None)
            VHCI.write_text(f"{kernel_port} {cable.fileno()} {bus << 16 | device} {speed}")
    return int(status)


def plug_adapter(host_port: int) -> None:
    """Give the kernel the adapter behind the host's port, and switch it on."""
    cable = socket.create_connection((HOST, host_port), timeout=10)
    cable.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    adapter = os.open("/dev/vhci", os.O_RDWR)
    os.write(adapter, bytes((VENDOR_PACKET, 0)))
    threading.Thread(target=_relay, args=(cable, adapter), daemon=True).start()
    while not ADAPTER.exists():
        time.sleep(0.05)
    with socket.socket(AF_BLUETOOTH, socket.SOCK_RAW, BTPROTO_HCI) as control, contextlib.suppress(OSError):
        fcntl.ioctl(control, HCI_DEVICE_UP, 0)  # EALREADY: it is on


def _relay(cable: socket.socket, adapter: int) -> None:
    """Carry HCI packets between the kernel and the host until the host ends; then the kernel loses the adapter."""
    packets = cable.makefile("rb", buffering=0)
    with cable, contextlib.closing(packets), contextlib.suppress(OSError, ValueError):
        while True:
            ready, _, _ = select.select([cable.fileno(), adapter], [], [])
            if adapter in ready and (packet := os.read(adapter, 4096))[0] != VENDOR_PACKET:
                cable.sendall(len(packet).to_bytes(2, "little") + packet)
            if cable.fileno() in ready:
                length = int.from_bytes(_read(packets, 2), "little")
                os.write(adapter, _read(packets, length))
    os.close(adapter)


def _read(stream: socket.SocketIO, size: int) -> bytes:
    """Read exactly `size` bytes; ConnectionError at the end."""
    data = b""
    while len(data) < size:
        more = stream.read(size - len(data))
        if not more:
            raise ConnectionError
        data += more
    return data


class Server(socketserver.ThreadingTCPServer):
    """Serves requests side by side."""

    allow_reuse_address = True
    daemon_threads = True


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with Server(("", PORT), Handler) as server:
        print(f"rig: guest up after {time.clock_gettime(time.CLOCK_BOOTTIME):.1f} s", flush=True)
        server.serve_forever()
