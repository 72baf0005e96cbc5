"""What the commands about the brick itself and its radio do. Source: docs/firmware.md sections 4 and 5."""

from __future__ import annotations

from firmware_protocol.direct import (
    BluetoothCount,
    BluetoothName,
    GetBluetoothConnectionCount,
    GetBluetoothConnectionName,
    GetBluetoothContactCount,
    GetBluetoothContactName,
)
from firmware_protocol.status import Status
from firmware_protocol.system import (
    BOOT_TEXT,
    BluetoothAddress,
    BluetoothFactoryReset,
    Boot,
    BootAnswer,
    DeviceInfo,
    GetBluetoothAddress,
    GetDeviceInfo,
    GetVersions,
    Poll,
    PollData,
    PollLength,
    PollReady,
    SetBrickName,
    Versions,
)
from sim_backend.firmware.answer import DONE, Answer, Handlers, answer, refuse_with_zeros
from sim_backend.firmware.high_speed import HighSpeed
from sim_backend.firmware.io_control import BOOT, IoControl
from sim_backend.firmware.limits import Channel
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.radio import Radio

_PROTOCOL = (124, 1)
_CONTACTS, _CONNECTIONS = 30, 4
_NO_LINKS = bytes(4)


class IdentityHandlers:
    """Versions, name and address, Bluetooth tables, poll buffers, boot."""

    def __init__(
        self,
        firmware: str,
        radio: Radio,
        loader: Loader,
        high_speed: HighSpeed,
        io_control: IoControl,
        channel: Channel,
    ) -> None:
        major, minor = (int(part) for part in firmware.split("."))
        self._versions = Versions(*_PROTOCOL, minor, major)
        self._radio, self._loader = radio, loader
        self._high_speed, self._io_control, self._channel = high_speed, io_control, channel

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            GetVersions: lambda _: answer(self._versions),
            GetDeviceInfo: self.device_info,
            GetBluetoothAddress: lambda _: answer(BluetoothAddress(self._radio.address)),
            SetBrickName: self.set_brick_name,
            BluetoothFactoryReset: self.factory_reset,
            GetBluetoothContactCount: lambda _: answer(BluetoothCount(_CONTACTS)),
            GetBluetoothContactName: lambda _: answer(BluetoothName(0, "")),
            GetBluetoothConnectionCount: lambda _: answer(BluetoothCount(_CONNECTIONS)),
            GetBluetoothConnectionName: lambda _: answer(BluetoothName(0, "")),
            PollLength: self.poll_length,
            Poll: self.poll,
            Boot: self.boot,
        }

    def device_info(self, _: GetDeviceInfo) -> Answer:
        """Who the brick is and how much memory is free."""
        radio = self._radio
        name = radio.name.split(b"\0")[0].decode("latin-1")
        return answer(DeviceInfo(name, radio.address, _NO_LINKS, self._loader.free_flash))

    def set_brick_name(self, command: SetBrickName) -> Answer:
        """Rename the brick, unless the radio is at work."""
        if self._radio.busy:
            return Answer(Status.BLUETOOTH_BUSY)
        self._radio.rename(command.name.encode("latin-1"))
        return DONE

    def factory_reset(self, _: BluetoothFactoryReset) -> Answer:
        """Reset the radio, unless it is at work or carries the request."""
        if self._radio.busy or self._channel.limits.streams:
            return Answer(Status.UNDEFINED_ERROR)
        self._radio.reset()
        return DONE

    def poll_length(self, command: PollLength) -> Answer:
        """How much waits; the USB buffer is always empty."""
        return answer(PollReady(command.buffer, self._high_speed.waiting if command.buffer else 0))

    def poll(self, command: Poll) -> Answer:
        """Fetch what waits, padded to the length asked for."""
        if command.size > self._channel.limits.poll:
            return answer(PollData(command.buffer, 0, b""), Status.UNDEFINED_ERROR)
        data = self._high_speed.fetch(command.size) if command.buffer else b""
        return answer(PollData(command.buffer, len(data), data.ljust(command.size, b"\0")))

    def boot(self, command: Boot) -> Answer:
        """Go into the boot loader, if the text is right and came over USB."""
        if command.text != BOOT_TEXT or self._channel.limits.streams:
            return refuse_with_zeros(Boot, Status.UNDEFINED_ERROR)
        self._io_control.shut_down(BOOT)
        return answer(BootAnswer("Yes"))
