"""The robot's camera as a USB webcam of any Linux computer, by USB/IP; ``usbip attach`` plugs it in.

A webcam of the USB Video Class 1.0 (usb.org, "USB Device Class Definition for Video Devices") with one format, MJPEG,
in one size, over a bulk endpoint. As on real webcams, a frame is lost if the host has not read the last one.
"""

from __future__ import annotations

import asyncio
import struct
from enum import IntEnum
from typing import cast

import numpy as np
from numpy.typing import NDArray

from sim_backend.doors.door import LOOPBACK
from sim_backend.doors.loop_door import LoopDoor
from sim_backend.doors.mjpeg import coded
from sim_backend.doors.sockets import BACKLOG, bracketed
from sim_backend.doors.usb_device import Setup, Speed, Stall, UsbDevice
from sim_backend.doors.usbip import REQUEST_S, UsbIpClient, attach_command
from sim_backend.doors.usbip_session import UsbIpSession

ENDPOINT_IN = 0x81
PACKET_SIZE = 512
PAYLOAD_SIZE = 32 * PACKET_SIZE
"""Longest payload, and so the size of the host's reads: Linux's uvcvideo reads at most 32 packets at a time."""

VENDOR, PRODUCT = 0x1D6B, 0x0102
"""Those of Linux's own webcam gadget."""

UNREAD_LIMIT = 1 << 20
"""Unread bytes, beyond the kernel's buffer, at which a computer is disconnected: a dozen reads, for a host has five
under way."""

HUNDRED_NS = 10_000_000
"""Units of a frame interval in a second."""

CONTROL_INTERFACE, STREAMING_INTERFACE = 0, 1
TERMINAL_CAMERA, TERMINAL_USB = 1, 2
GET_AND_SET = 0x03
ERROR_CODE_CONTROL, INVALID_CONTROL = 2, 6
HEADER_SIZE, END_OF_FRAME, END_OF_HEADER = 2, 0x02, 0x80


class VideoRequest(IntEnum):
    """Requests of the class, table A-8."""

    SET_CUR = 0x01
    GET_CUR = 0x81
    GET_MIN = 0x82
    GET_MAX = 0x83
    GET_LEN = 0x85
    GET_INFO = 0x86
    GET_DEF = 0x87


def _block(layout: str, *values: object) -> bytes:
    """Return a descriptor: its length, then the values."""
    body = struct.pack("<" + layout, *values)
    return bytes((len(body) + 1,)) + body


def _configuration(size: tuple[int, int], interval: int) -> bytes:
    """Return the configuration descriptor: an interface for control, one for streaming."""
    width, height = size
    bits_per_s = width * height * 16 * HUNDRED_NS // interval
    camera = _block("BBBHBBHHHB3s", 0x24, 2, TERMINAL_CAMERA, 0x0201, 0, 0, 0, 0, 0, 3, bytes(3))
    output = _block("BBBHBBB", 0x24, 3, TERMINAL_USB, 0x0101, 0, TERMINAL_CAMERA, 0)
    header = _block("BBHHIBB", 0x24, 1, 0x0100, 13 + len(camera) + len(output), 48_000_000, 1, STREAMING_INTERFACE)
    mjpeg = _block("10B", 0x24, 6, 1, 1, 1, 1, 0, 0, 0, 0)
    frame = _block(
        "BBBBHHIIIIBI", 0x24, 7, 1, 0, width, height, bits_per_s, bits_per_s, _frame_limit(size), interval, 1, interval
    )
    formats = mjpeg + frame
    streaming = _block("BBBHBBBBBBBB", 0x24, 1, 1, 14 + len(formats), ENDPOINT_IN, 0, TERMINAL_USB, 0, 0, 0, 1, 0)
    parts = (
        _block("7B", 11, CONTROL_INTERFACE, 2, 14, 3, 0, 0)
        + _block("8B", 4, CONTROL_INTERFACE, 0, 0, 14, 1, 0, 0)
        + header
        + camera
        + output
        + _block("8B", 4, STREAMING_INTERFACE, 0, 1, 14, 2, 0, 0)
        + streaming
        + formats
        + _block("BBBHB", 5, ENDPOINT_IN, 2, PACKET_SIZE, 0)
    )
    return _block("BHBBBBB", 2, 9 + len(parts), 2, 1, 0, 0x80, 250) + parts


def _frame_limit(size: tuple[int, int]) -> int:
    """Return the largest frame in bytes."""
    return size[0] * size[1] * 2


class UvcWebcam(UsbDevice):
    """The webcam on USB."""

    def __init__(self, size: tuple[int, int], fps: float) -> None:
        """Make a webcam that offers frames of `size` (width, height) pixels, `fps` a second."""
        self._interval = round(HUNDRED_NS / fps)
        self._size = size
        descriptor = struct.pack("<BBHBBBBHHHBBBB", 18, 1, 0x0200, 0xEF, 2, 1, 64, VENDOR, PRODUCT, 0x0010, 1, 2, 0, 1)
        super().__init__(
            descriptor,
            _configuration(size, self._interval),
            ["nxtdrive", "Robot camera"],
            speed=Speed.HIGH,
            packet_size=PACKET_SIZE,
            endpoint_in=ENDPOINT_IN,
        )
        self._frame_id = 0

    def show(self, jpeg: bytes, *, wanted: bool) -> None:
        """Give the frame to the host, in payloads that each begin with a header.

        Args:
            jpeg: The frame.
            wanted: Whether the host is reading; otherwise the frame is lost, and what is left of the last one.
        """
        packets = self.outbox[ENDPOINT_IN]
        if not wanted:
            packets.clear()
        if packets or not wanted:
            return
        self._frame_id ^= 1
        step = PAYLOAD_SIZE - HEADER_SIZE
        for at in range(0, len(jpeg), step):
            last = at + step >= len(jpeg)
            flags = END_OF_HEADER | self._frame_id | (END_OF_FRAME if last else 0)
            payload = bytes((HEADER_SIZE, flags)) + jpeg[at : at + step]
            packets.extend(payload[start : start + PACKET_SIZE] for start in range(0, len(payload), PACKET_SIZE))
            if len(payload) % PACKET_SIZE == 0 and len(payload) < PAYLOAD_SIZE:
                packets.append(b"")  # ends the transfer, as a short packet does

    def class_request(self, setup: Setup, data: bytes) -> bytes:  # noqa: ARG002 - only one format can be chosen
        """Negotiate the format, of which there is one."""
        interface, selector = setup.index & 0xFF, setup.value >> 8
        if interface == STREAMING_INTERFACE:
            match setup.request:
                case VideoRequest.SET_CUR:
                    return b""
                case VideoRequest.GET_CUR | VideoRequest.GET_MIN | VideoRequest.GET_MAX | VideoRequest.GET_DEF:
                    return self._probe()
                case VideoRequest.GET_LEN:
                    return struct.pack("<H", len(self._probe()))
                case VideoRequest.GET_INFO:
                    return bytes((GET_AND_SET,))
        if interface == CONTROL_INTERFACE and setup.request == VideoRequest.GET_CUR and selector == ERROR_CODE_CONTROL:
            return bytes((INVALID_CONTROL,))
        raise Stall

    def _probe(self) -> bytes:
        """Probe and commit controls, table 4-47."""
        return struct.pack("<HBBI5HII", 1, 1, 1, self._interval, 0, 0, 0, 0, 0, _frame_limit(self._size), PAYLOAD_SIZE)


class UvcDoor(LoopDoor):
    """A USB/IP server with one device, the webcam; one computer at a time has it.

    One thread serves it; publishing a frame never waits. A connection has a deadline for its request, and a further one
    takes the place of the oldest without a request.

    Attributes:
        port: The actual port.
        address: Scheme, host and port.
        command: How to plug it into this computer.
        covered: Whether something covers the lens: black frames.
    """

    covered = False

    def __init__(self, size: tuple[int, int], fps: float, port: int = 0, *, host: str = LOOPBACK) -> None:
        """Start to listen.

        Args:
            size: Width and height of the frames in pixels.
            fps: Frames per second.
            port: TCP port; 0 selects a free one.
            host: Address of this computer; any other than the loopback interface lets other computers watch.

        Raises:
            ConfigError: See `LoopDoor`.
        """
        super().__init__("webcam", host, port)
        self.address = f"{UsbIpClient.scheme}://{bracketed(host)}:{self.port}"
        self.command = attach_command(host, self.port)
        self._device = UvcWebcam(size, fps)
        self._asking: dict[_Cable, None] = {}
        self._cable: _Cable | None = None
        self._thread.start()

    @property
    def watched(self) -> bool:
        """Whether a computer has the webcam; without one no frame needs to be rendered."""
        return self._cable is not None

    def show(self, image: NDArray[np.uint8]) -> None:
        """Publish the BGR `image`; it is lost if the host has not read the last one."""
        self._loop.call_soon_threadsafe(self._publish, coded(np.zeros_like(image) if self.covered else image))

    def unplug(self) -> None:
        """Pull the cable."""
        self._loop.call_soon_threadsafe(self._pull)

    # --- in the thread ---

    async def _serve(self) -> None:
        server = await self._loop.create_server(lambda: _Cable(self), sock=self._listener)
        await self._ended.wait()
        server.close()  # without waiting for the connections, which would last until their computers end them
        for cable in self._asking:
            cable.abort()
        self._pull()

    def _pull(self) -> None:
        if self._cable is not None:
            self._cable.abort()

    def _publish(self, jpeg: bytes) -> None:
        if self._cable is not None:
            self._device.show(jpeg, wanted=self._cable.reading)
            self._cable.pump()

    def session(self) -> UsbIpSession:
        """Start a session for a new connection."""
        return UsbIpSession(self._device, lambda: self._cable is not None)

    def connected(self, cable: _Cable) -> None:
        """Handle a host that has connected, and may ask for the webcam until its deadline."""
        if len(self._asking) >= BACKLOG:
            self._disconnect(next(iter(self._asking)))
        self._asking[cable] = None
        self._loop.call_later(REQUEST_S, self._disconnect, cable)

    def _disconnect(self, cable: _Cable) -> None:
        """Disconnect a host unless it has imported the webcam, or has gone already."""
        if cable in self._asking:
            del self._asking[cable]
            cable.abort()

    def plugged(self, cable: _Cable) -> None:
        """Handle a host that has imported the webcam."""
        self._asking.pop(cable, None)
        self._cable = cable

    def unplugged(self, cable: _Cable) -> None:
        """Handle a host that has disconnected."""
        self._asking.pop(cable, None)
        if self._cable is cable:
            self._cable = None


class _Cable(asyncio.Protocol):
    """One connection."""

    _transport: asyncio.Transport

    def __init__(self, door: UvcDoor) -> None:
        self._door = door
        self._session = door.session()

    @property
    def reading(self) -> bool:
        """Whether the host waits for frames."""
        return self._session.reading

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast("asyncio.Transport", transport)
        self._transport.set_write_buffer_limits(high=UNREAD_LIMIT)
        self._door.connected(self)

    def pause_writing(self) -> None:
        """Disconnect a host that does not read."""
        self.abort()

    def data_received(self, data: bytes) -> None:
        self._session.feed(data)
        if self._session.imported:
            self._door.plugged(self)
        self._flush()

    def connection_lost(self, exc: Exception | None) -> None:  # noqa: ARG002
        self._door.unplugged(self)

    def pump(self) -> None:
        """Send what the host waits for."""
        self._session.pump()
        self._flush()

    def abort(self) -> None:
        """Pull the cable."""
        self._transport.abort()

    def _flush(self) -> None:
        self._transport.write(bytes(self._session.outgoing))
        self._session.outgoing.clear()
        if self._session.finished and self._session.imported:
            self.abort()
        elif self._session.finished:
            self._transport.close()  # once the answer is sent
