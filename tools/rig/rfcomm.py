"""The simulated brick within reach of an emulated Bluetooth adapter, which a Linux kernel uses as its own.

Two controllers of bumble share a link: the adapter, whose host is the kernel behind ``/dev/vhci``, and the brick's
radio with the serial port service on channel 1. The kernel's HCI packets come over TCP, each with its type before it,
as on a UART, and its length in two bytes before that; the rig relays them. Needs the extra ``hil``.
"""

from __future__ import annotations

import asyncio
import contextlib
import queue
import socket
import threading
from collections.abc import Callable, Coroutine
from typing import Any

from bumble import core, hci, rfcomm
from bumble.device import Device
from bumble.host import Host
from bumble.link import LocalLink
from bumble.transport.common import AsyncPipeSink

from sim_backend.doors.door import CHUNK, LOOPBACK, Client
from sim_backend.doors.loop_door import LoopDoor
from sim_backend.doors.sockets import StreamClient

from .bluetooth_radio import Radio

ADAPTER_ADDRESS = "00:11:22:33:44:55"
SERIAL_PORT = core.UUID("00001101-0000-1000-8000-00805F9B34FB")
CHANNEL = 1
SERVICE_RECORD = 0x10001

SUPERVISION_S = 1.0
"""Time after which a link without an answer counts as lost. The specification's default is 20 s; tests need not wait so
long."""


class RfcommDoor(LoopDoor):
    """The brick over Bluetooth.

    Attributes:
        address: Address for programs in the guest.
        bluetooth: See `sim_backend.doors.door.Door`.
        port: TCP port of the adapter.
    """

    bluetooth = True

    def __init__(self, brick: str, port: int = 0, *, now: Callable[[], float]) -> None:
        """Switch adapter and brick on.

        Args:
            brick: The brick's Bluetooth address, with colons.
            port: TCP port of the adapter on the loopback interface; 0 selects a free one.
            now: Returns seconds of a monotonic clock.

        Raises:
            ConfigError: See `LoopDoor`.
        """
        super().__init__("bluetooth", LOOPBACK, port)
        self.address = f"bt://{brick}"
        self._brick, self._now = brick, now
        self._arrived: queue.SimpleQueue[socket.socket] = queue.SimpleQueue()
        self._ready = threading.Event()
        self._cables: set[asyncio.StreamWriter] = set()
        self._air = LocalLink()
        self._thread.start()
        self._ready.wait()

    def accept(self) -> list[Client]:
        """Return the programs that connected since the last call."""
        found: list[Client] = []
        with contextlib.suppress(queue.Empty):
            while True:
                found.append(StreamClient(self._arrived.get_nowait(), "Bluetooth", self._now))
        return found

    def fileno(self) -> int | None:
        """Return None: connections come from another thread."""
        return None

    def leave_range(self) -> None:
        """Take the brick out of range: connections are lost after `SUPERVISION_S`, new ones find no brick."""
        self._call(self._vanish())

    def enter_range(self) -> None:
        """Bring the brick into range again."""
        self._loop.call_soon_threadsafe(self._air.add_controller, self._radio)

    def ask_for_pin(self, pin: str) -> None:
        """Have the brick accept only computers that are paired with it, by this PIN."""
        self._adapter.pin = pin

    def disconnect(self) -> None:
        """Have the brick end its connections, as when its Bluetooth is switched off."""
        self._call(self._disconnect())

    # --- in the thread ---

    def _call(self, task: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(task, self._loop).result()

    async def _serve(self) -> None:
        self._adapter = Radio("adapter", link=self._air, public_address=ADAPTER_ADDRESS)
        self._radio = Radio("brick", link=self._air, public_address=self._brick)
        self._device = Device(
            name="NXT", address=hci.Address(self._brick), host=Host(self._radio, AsyncPipeSink(self._radio))
        )
        self._device.classic_enabled, self._device.le_enabled = True, False
        self._device.classic_ssp_enabled = self._device.classic_sc_enabled = False
        record = rfcomm.make_service_sdp_records(SERVICE_RECORD, CHANNEL, SERIAL_PORT)
        self._device.sdp_service_records = {SERVICE_RECORD: record}
        service = rfcomm.Server(self._device)
        service.listen(self._opened, channel=CHANNEL)
        await self._device.power_on()
        await self._device.set_discoverable(True)
        await self._device.set_connectable(True)
        server = await asyncio.start_server(self._cable, sock=self._listener)
        self._ready.set()
        async with server:
            await self._ended.wait()
            for cable in self._cables:
                cable.close()
            while self._cables:
                await asyncio.sleep(0)

    def _opened(self, dlc: rfcomm.DLC) -> None:
        """Pass the bytes of a program that has connected through a pair of sockets."""
        ours, theirs = socket.socketpair()
        ours.setblocking(False)
        theirs.setblocking(False)
        self._arrived.put(theirs)

        def out() -> None:
            with contextlib.suppress(BlockingIOError):
                try:
                    data = ours.recv(CHUNK)
                except ConnectionError:
                    data = b""
                if data:
                    dlc.write(data)
                else:
                    ended()

        def ended() -> None:
            self._loop.remove_reader(ours)
            ours.close()

        def took(data: bytes) -> None:
            with contextlib.suppress(OSError):
                ours.send(data)

        dlc.sink = took
        dlc.on("close", ended)
        self._loop.add_reader(ours, out)

    async def _cable(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Let one kernel at a time use the adapter."""

        class Kernel:
            def on_packet(self, packet: bytes) -> None:
                writer.write(len(packet).to_bytes(2, "little") + packet)

        self._adapter.set_packet_sink(Kernel())
        self._cables.add(writer)
        try:
            while True:
                length = int.from_bytes(await reader.readexactly(2), "little")
                self._adapter.on_packet(await reader.readexactly(length))
        except (asyncio.IncompleteReadError, ConnectionError):
            self._adapter.set_packet_sink(None)
        finally:
            self._cables.discard(writer)
            writer.close()

    async def _vanish(self) -> None:
        self._air.remove_controller(self._radio)
        await asyncio.sleep(SUPERVISION_S)
        self._adapter.lose()
        self._radio.lose()

    async def _disconnect(self) -> None:
        for connection in list(self._device.connections.values()):
            await connection.disconnect()
