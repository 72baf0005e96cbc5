"""Handlers of the commands for sound, battery, sleep timer and properties. Source: docs/firmware.md section 4."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol import direct
from firmware_protocol.enums import Property
from firmware_protocol.status import Status
from sim_backend.firmware.comm.handler_result import DONE, OUT_OF_RANGE, HandlerResult, handles, reply_with
from sim_backend.firmware.command import CommandModule
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.sound import MAX_VOLUME, SoundModule
from sim_backend.firmware.ui.sleep_timer import MINUTE_MS
from sim_backend.firmware.ui.ui_module import UiModule

_UNKNOWN = HandlerResult(Status.UNKNOWN_OPCODE)


class PropertyHandlers:
    """The commands for sound, battery, sleep timer and properties."""

    def __init__(self, ui: UiModule, sound: SoundModule, radio: Radio, loader: Loader, command: CommandModule) -> None:
        self._ui, self._sound, self._radio, self._loader, self._command = ui, sound, radio, loader, command
        self._setters: dict[int, Callable[[bytes], HandlerResult]] = {
            Property.BLUETOOTH: self._set_bluetooth,
            Property.VOLUME: self._set_volume,
            Property.SLEEP_TIME: self._set_sleep_time,
        }
        if command.has_breakpoints:
            self._setters[Property.DEBUGGING] = self._set_pause

    @handles(direct.PlaySoundFile)
    def play_sound_file(self, command: direct.PlaySoundFile) -> HandlerResult:
        """Start a sound file; only its existence is checked."""
        if not self._loader.look_up(command.name):
            return OUT_OF_RANGE
        self._sound.play_file(command.name, loop=bool(command.loop))
        return DONE

    @handles(direct.PlayTone)
    def play_tone(self, command: direct.PlayTone) -> HandlerResult:
        """Start a tone; its range is not checked."""
        self._sound.play_tone(command.frequency_hz, command.duration_ms)
        return DONE

    @handles(direct.StopSoundPlayback)
    def stop_sound(self, _: direct.StopSoundPlayback) -> HandlerResult:
        """Stop the sound."""
        self._sound.stop()
        return DONE

    @handles(direct.GetBatteryLevel)
    def battery_level(self, _: direct.GetBatteryLevel) -> HandlerResult:
        """Return the last sample of the voltage."""
        return reply_with(direct.BatteryLevel(self._ui.battery.millivolts))

    @handles(direct.KeepAlive)
    def keep_alive(self, _: direct.KeepAlive) -> HandlerResult:
        """Restart the sleep timer and return its limit."""
        self._ui.stay_awake()
        return reply_with(direct.SleepLimit(self._ui.sleep_timer.limit_ms))

    @handles(direct.SetProperty)
    def set_property(self, command: direct.SetProperty) -> HandlerResult:
        """Change a setting."""
        setter = self._setters.get(command.property)
        return setter(command.value) if setter else _UNKNOWN

    @handles(direct.GetProperty)
    def get_property(self, command: direct.GetProperty) -> HandlerResult:
        """Read a setting."""
        values = {
            Property.BLUETOOTH: bytes([not self._radio.shows_off]),
            Property.VOLUME: bytes([self._sound.volume]),
            Property.SLEEP_TIME: self._ui.sleep_timer.limit_ms.to_bytes(4, "little"),
            Property.DEBUGGING: self._command.pause,
        }
        known = command.property in self._setters
        return reply_with(direct.PropertyValue(values[command.property])) if known else _UNKNOWN

    def _set_bluetooth(self, value: bytes) -> HandlerResult:
        return HandlerResult(Status.IN_PROGRESS if self._radio.switch(bool(value[0])) else Status.OK)

    def _set_volume(self, value: bytes) -> HandlerResult:
        self._ui.registers.volume = self._sound.volume = min(value[0], MAX_VOLUME)
        return DONE

    def _set_sleep_time(self, value: bytes) -> HandlerResult:
        self._ui.set_sleep_minutes(int.from_bytes(value[:4], "little") // MINUTE_MS)
        return DONE

    def _set_pause(self, value: bytes) -> HandlerResult:
        self._command.pause = value[: len(self._command.pause)]
        return DONE
