"""The simulated brick in the air of an emulated Bluetooth adapter, which a Linux kernel takes for its own.

Two controllers of bumble share a link: the adapter, whose host is the kernel behind ``/dev/vhci``, and the brick's
radio with the serial port service on channel 1. The kernel's HCI packets come over TCP, each with its type before it,
as on a UART, and its length in two bytes before that; `tools/rig` relays them. Needs the extra ``hil``.
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
from bumble.controller import Controller
from bumble.device import Device
from bumble.host import Host
from bumble.link import LocalLink
from bumble.transport.common import AsyncPipeSink

from sim_backend.doors.door import CHUNK, LOOPBACK, Client
from sim_backend.doors.sockets import StreamClient, listen

ADAPTER_ADDRESS = "00:11:22:33:44:55"
SERIAL_PORT = core.UUID("00001101-0000-1000-8000-00805F9B34FB")
CHANNEL = 1
SERVICE_RECORD = 0x10001

COMMAND, EVENT = 0x01, 0x04
COMMAND_COMPLETE, COMMAND_STATUS = 0x0E, 0x0F
CONNECTION_COMPLETE, DISCONNECTION_COMPLETE = 0x03, 0x05
READ_REMOTE_VERSION_COMPLETE, READ_CLOCK_OFFSET_COMPLETE = 0x0C, 0x1C
PAGE_TIMEOUT, CONNECTION_TIMEOUT = 0x04, 0x08

CREATE_CONNECTION, CANCEL_CONNECTION = 0x0405, 0x0408
READ_REMOTE_VERSION, READ_CLOCK_OFFSET = 0x041D, 0x041F

PAGE_TIMEOUT_S = 5.12
"""How long an adapter calls a device that is not there: the specification's default."""

SUPERVISION_S = 1.0
"""After what time a link without answer is taken for lost. The specification's default is 20 s; tests need not wait so
long."""

BLUETOOTH_2_0 = 3
"""Version of the brick's BlueCore 4, and so of a kernel's conversation with it; bumble declares a far newer one."""

ANSWERS = {
    0x080F: "00",  # Write Default Link Policy Settings
    0x0C05: "00",  # Set Event Filter
    0x0C0D: "0000000000",  # Read Stored Link Key: none
    0x0C12: "000000",  # Delete Stored Link Key: none
    0x0C16: "00",  # Write Connection Accept Timeout
    0x0C18: "00",  # Write Page Timeout
    0x0C1B: "0000081200",  # Read Page Scan Activity
    0x0C1C: "00",  # Write Page Scan Activity
    0x0C1E: "00",  # Write Inquiry Scan Activity
    0x0C20: "00",  # Write Authentication Enable
    0x0C22: "00",  # Write Encryption Mode
    0x0C25: "006000",  # Read Voice Setting
    0x0C26: "00",  # Write Voice Setting
    0x0C2F: "00",  # Write Synchronous Flow Control Enable
    0x0C31: "00",  # Set Controller To Host Flow Control
    0x0C33: "00",  # Host Buffer Size
    0x0C38: "0001",  # Read Number Of Supported IAC
    0x0C39: "0001338b9e",  # Read Current IAC LAP: the general one
    0x0C3A: "00",  # Write Current IAC LAP
    0x0C45: "00",  # Write Inquiry Mode
    0x0C46: "0000",  # Read Page Scan Type
    0x0C47: "00",  # Write Page Scan Type
    0x0C56: "00",  # Write Simple Pairing Mode
    0x0C58: "0000",  # Read Inquiry Response Transmit Power Level
    0x0C59: "0000",  # Read Default Erroneous Data Reporting
    0x0C5B: "00",  # Write Default Erroneous Data Reporting
}
"""Return parameters, beginning with the status, of commands that a Linux kernel sends and bumble does not know."""


class Radio(Controller):  # type: ignore[misc] # bumble's types are not read
    """A controller of Bluetooth 2.0, as far as Linux's and bumble's hosts need one."""

    hci_version = lmp_version = BLUETOOTH_2_0
    lmp_features = hci.LmpFeatureMask(0x7)
    lmp_features_max_page_number = 0
    acl_data_packet_length, total_num_acl_data_packets = 310, 10

    def on_packet(self, packet: bytes) -> None:
        """Answer a packet of the host."""
        code = int.from_bytes(packet[1:3], "little") if packet[0] == COMMAND else 0
        if not self._answered(code, packet):
            super().on_packet(packet)

    def event(self, code: int, parameters: bytes) -> None:
        """Send an event to the host, after what is being sent."""
        if self.host is not None:
            packet = bytes((EVENT, code, len(parameters))) + parameters
            asyncio.get_running_loop().call_soon(self.host.on_packet, packet)

    def lose(self) -> None:
        """Tell the host that its connections are lost."""
        for connection in list(self.classic_connections.values()):
            handle = connection.handle.to_bytes(2, "little")
            self.event(DISCONNECTION_COMPLETE, b"\0" + handle + bytes((CONNECTION_TIMEOUT,)))
        self.classic_connections.clear()

    def _answered(self, code: int, packet: bytes) -> bool:
        """Answer what bumble does not; returns whether it did."""
        opcode, parameters = packet[1:3], packet[4:]
        if code in ANSWERS:
            self.event(COMMAND_COMPLETE, b"\1" + opcode + bytes.fromhex(ANSWERS[code]))
        elif code == CREATE_CONNECTION and self._absent(parameters[:6]):
            self.event(COMMAND_STATUS, b"\0\1" + opcode)
            failed = bytes((PAGE_TIMEOUT, 0, 0)) + parameters[:6] + b"\1\0"
            asyncio.get_running_loop().call_later(PAGE_TIMEOUT_S, self.event, CONNECTION_COMPLETE, failed)
        elif code == CANCEL_CONNECTION:
            self.event(COMMAND_COMPLETE, b"\1" + opcode + b"\0" + parameters[:6])
        elif code == READ_REMOTE_VERSION:
            self.event(COMMAND_STATUS, b"\0\1" + opcode)
            version = bytes((BLUETOOTH_2_0, 10, 0, 0, 0))
            self.event(READ_REMOTE_VERSION_COMPLETE, b"\0" + parameters[:2] + version)
        elif code == READ_CLOCK_OFFSET:
            self.event(COMMAND_STATUS, b"\0\1" + opcode)
            self.event(READ_CLOCK_OFFSET_COMPLETE, b"\0" + parameters[:2] + b"\0\0")
        else:
            return False
        return True

    def _absent(self, address: bytes) -> bool:
        called = hci.Address(address, hci.Address.PUBLIC_DEVICE_ADDRESS)
        return self.link is None or self.link.find_classic_controller(called) is None

    def on_hci_command(self, command: hci.HCI_Command) -> Any:  # noqa: ANN401, ARG002 - bumble's
        """Accept what neither knows."""
        return hci.HCI_StatusReturnParameters(hci.HCI_ErrorCode.SUCCESS)


class RfcommDoor:
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
            ConfigError: The port is taken or not allowed.
        """
        self._listener = listen(LOOPBACK, port)
        self.port: int = self._listener.getsockname()[1]
        self.address = f"bt://{brick}"
        self._now = now
        self._arrived: queue.SimpleQueue[socket.socket] = queue.SimpleQueue()
        self._runner = asyncio.Runner(loop_factory=asyncio.SelectorEventLoop)
        self._loop = self._runner.get_loop()
        self._ended, self._ready = asyncio.Event(), threading.Event()
        self._air = LocalLink()
        self._thread = threading.Thread(target=self._run, args=(brick,), name="bluetooth")
        self._thread.start()
        self._ready.wait()

    def arrivals(self) -> list[Client]:
        """Return the programs that connected since the last call."""
        found: list[Client] = []
        with contextlib.suppress(queue.Empty):
            while True:
                found.append(StreamClient(self._arrived.get_nowait(), "Bluetooth", self._now))
        return found

    def fileno(self) -> int | None:
        """Nothing to wait on: connections come from another thread."""
        return None

    def close(self) -> None:
        """Switch both off; may be called again."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._ended.set)
            self._thread.join()

    def vanish(self) -> None:
        """Take the brick out of range: connections are lost after `SUPERVISION_S`, new ones find no brick."""
        self._call(self._vanish())

    def come_back(self) -> None:
        """Bring the brick into range again."""
        self._loop.call_soon_threadsafe(self._air.add_controller, self._radio)

    def hang_up(self) -> None:
        """Have the brick end its connections, as when its Bluetooth is switched off."""
        self._call(self._hang_up())

    # --- in the thread ---

    def _call(self, task: Coroutine[Any, Any, None]) -> None:
        asyncio.run_coroutine_threadsafe(task, self._loop).result()

    def _run(self, brick: str) -> None:
        with self._runner:
            self._runner.run(self._serve(brick))

    async def _serve(self, brick: str) -> None:
        self._adapter = Radio("adapter", link=self._air, public_address=ADAPTER_ADDRESS)
        self._radio = Radio("brick", link=self._air, public_address=brick)
        self._device = Device(
            name="NXT", address=hci.Address(brick), host=Host(self._radio, AsyncPipeSink(self._radio))
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

    def _opened(self, dlc: rfcomm.DLC) -> None:
        """A program has connected: pass its bytes through a pair of sockets."""
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
        """One kernel at a time has the adapter."""

        class Kernel:
            def on_packet(self, packet: bytes) -> None:
                writer.write(len(packet).to_bytes(2, "little") + packet)

        self._adapter.set_packet_sink(Kernel())
        with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
            while True:
                length = int.from_bytes(await reader.readexactly(2), "little")
                self._adapter.on_packet(await reader.readexactly(length))
        self._adapter.set_packet_sink(None)
        writer.close()

    async def _vanish(self) -> None:
        self._air.remove_controller(self._radio)
        await asyncio.sleep(SUPERVISION_S)
        self._adapter.lose()
        self._radio.lose()

    async def _hang_up(self) -> None:
        for connection in list(self._device.connections.values()):
            await connection.disconnect()
