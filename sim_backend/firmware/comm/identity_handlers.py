"""Handlers of the commands about the brick itself and its radio. Source: docs/firmware.md sections 4 and 5."""

from __future__ import annotations

from firmware_protocol import direct, system
from firmware_protocol.iomap import COMM
from firmware_protocol.status import Status
from sim_backend.firmware.comm.handler_result import DONE, HandlerResult, handles, refuse_with_zeros, reply_with
from sim_backend.firmware.command_link import CommandLink
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.high_speed import HighSpeed
from sim_backend.firmware.io_control import BOOT, IoControl
from sim_backend.firmware.live_map import LiveMap
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.radio_tables import CONNECTIONS, CONTACTS
from sim_backend.firmware.screen_refresh import ScreenRefresh
from sim_backend.firmware.versions import Version

_PROTOCOL = (124, 1)
_NAME_SIZE, _ENTRY_SIZE = 17, 20
"""Bytes of a name with the first byte of the class after it, and with the whole class."""

_MAJOR_CLASS = 0x1F
_COMPUTER, _PHONE, _TOY = 1, 2, 8
_ROBOT = 4
"""Major and minor device classes of Bluetooth's assigned numbers."""


class IdentityHandlers:
    """Versions, name and address, Bluetooth tables, poll buffers, boot."""

    def __init__(
        self,
        version: Version,
        radio: Radio,
        loader: Loader,
        high_speed: HighSpeed,
        io_control: IoControl,
        screen: ScreenRefresh,
        link: CommandLink,
        comm_map: LiveMap,
    ) -> None:
        self._versions = system.Versions(*_PROTOCOL, version.minor, version.major)
        self._radio, self._loader = radio, loader
        self._high_speed, self._link = high_speed, link
        self._io_control, self._screen = io_control, screen
        self._comm_map = comm_map

    @handles(system.GetVersions)
    def versions(self, _: system.GetVersions) -> HandlerResult:
        """Return the versions of firmware and protocol."""
        return reply_with(self._versions)

    @handles(system.GetBluetoothAddress)
    def bluetooth_address(self, _: system.GetBluetoothAddress) -> HandlerResult:
        """Return the address of the radio."""
        return reply_with(system.BluetoothAddress(self._radio.address))

    @handles(direct.GetBluetoothContactCount)
    def contact_count(self, _: direct.GetBluetoothContactCount) -> HandlerResult:
        """Return the size of the table of contacts."""
        return reply_with(direct.BluetoothCount(CONTACTS))

    @handles(direct.GetBluetoothConnectionCount)
    def connection_count(self, _: direct.GetBluetoothConnectionCount) -> HandlerResult:
        """Return the size of the table of connections."""
        return reply_with(direct.BluetoothCount(CONNECTIONS))

    @handles(direct.GetBluetoothContactName)
    def contact_name(self, command: direct.GetBluetoothContactName) -> HandlerResult:
        """Return a device of the Comm map's table, if its status marks it as known."""
        index = command.index
        known = index in self._radio.tables.devices(known=True)
        return self._bluetooth_name("DeviceName", index) if known else HandlerResult(payload=bytes(1 + _NAME_SIZE))

    @handles(direct.GetBluetoothConnectionName)
    def connection_name(self, command: direct.GetBluetoothConnectionName) -> HandlerResult:
        """Return a connection of the Comm map's table; beyond the table the name has bytes of earlier replies."""
        if command.index >= CONNECTIONS:
            return HandlerResult(payload=b"\0", stale=_NAME_SIZE)
        return self._bluetooth_name("ConnectionName", command.index)

    def _bluetooth_name(self, field: str, index: int) -> HandlerResult:
        """Reply with device type and name, which includes the first byte of the class after it in the table."""
        entry = self._comm_map.read(COMM.field(field, index).offset, _ENTRY_SIZE)
        return HandlerResult(payload=bytes([_device_type(*entry[-2:])]) + entry[:_NAME_SIZE])

    @handles(system.GetDeviceInfo)
    def device_info(self, _: system.GetDeviceInfo) -> HandlerResult:
        """Return name, with the bytes after its end, address, quality of the connections, and free flash."""
        radio, fields = self._radio, (COMM.field("ConnectionQuality", index) for index in range(CONNECTIONS))
        links = b"".join(self._comm_map.read(field.offset, 1) for field in fields)
        info = system.DeviceInfo("", radio.address, links, self._loader.free_flash)
        name = radio.name[:-1]
        return HandlerResult(payload=name + reply_with(info).payload[len(name) :])

    @handles(system.SetBrickName)
    def set_brick_name(self, command: system.SetBrickName) -> HandlerResult:
        """Rename the brick, unless the radio is busy."""
        if self._radio.busy:
            return HandlerResult(Status.BLUETOOTH_BUSY)
        self._radio.rename(command.name.encode("latin-1"))
        return DONE

    @handles(system.BluetoothFactoryReset)
    def factory_reset(self, _: system.BluetoothFactoryReset) -> HandlerResult:
        """Reset the radio, unless it is busy or the request came over it."""
        if self._radio.busy or self._link.limits.streams:
            return HandlerResult(Status.UNDEFINED_ERROR)
        self._radio.reset()
        return DONE

    @handles(system.PollLength)
    def poll_length(self, command: system.PollLength) -> HandlerResult:
        """Return the number of bytes waiting; the USB buffer is always empty."""
        return reply_with(system.PollReady(command.buffer, self._high_speed.waiting if command.buffer else 0))

    @handles(system.Poll)
    def poll(self, command: system.Poll) -> HandlerResult:
        """Fetch the bytes waiting, padded to the requested length."""
        if command.size > self._link.limits.poll:
            return reply_with(system.PollData(command.buffer, 0, b""), Status.UNDEFINED_ERROR)
        data = self._high_speed.fetch(command.size) if command.buffer else b""
        return reply_with(system.PollData(command.buffer, len(data), data.ljust(command.size, b"\0")))

    @handles(system.Boot)
    def boot(self, command: system.Boot) -> HandlerResult:
        """Enter the boot loader if the text is correct and came over USB."""
        if not command.text.startswith(system.BOOT_TEXT) or self._link.limits.streams:
            return refuse_with_zeros(system.Boot, Status.UNDEFINED_ERROR)
        self._screen.shut_down()
        self._io_control.power_word = BOOT
        return reply_with(system.BootAnswer("Yes"))


def _device_type(major: int, minor: int) -> int:
    """Return the type of a device by the end of its class: 1 another NXT, 2 a phone, 3 a computer, else 0."""
    if major & _MAJOR_CLASS == _TOY and minor == _ROBOT:
        return 1
    return {_PHONE: 2, _COMPUTER: 3}.get(major & _MAJOR_CLASS, 0)
