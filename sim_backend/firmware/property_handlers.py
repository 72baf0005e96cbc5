"""What the commands for sound, battery, sleep timer and properties do. Source: docs/firmware.md section 4."""

from __future__ import annotations

from collections.abc import Callable

from firmware_protocol.direct import (
    BatteryLevel,
    GetBatteryLevel,
    GetProperty,
    KeepAlive,
    PlaySoundFile,
    PlayTone,
    PropertyValue,
    SetProperty,
    SleepLimit,
    StopSoundPlayback,
)
from firmware_protocol.enums import Property
from firmware_protocol.status import Status
from sim_backend.firmware.answer import DONE, OUT_OF_RANGE, Answer, Handlers, answer
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.radio import Radio
from sim_backend.firmware.sound import MAX_VOLUME, SoundModule
from sim_backend.firmware.ui import MINUTE_MS, UiModule

_UNKNOWN = Answer(Status.UNKNOWN_OPCODE)


class PropertyHandlers:
    """The commands for what the brick itself is and does, apart from motors, sensors and files."""

    def __init__(self, ui: UiModule, sound: SoundModule, radio: Radio, loader: Loader) -> None:
        self._ui, self._sound, self._radio, self._loader = ui, sound, radio, loader
        self._setters: dict[int, Callable[[bytes], Answer]] = {
            Property.BLUETOOTH: self._set_bluetooth,
            Property.VOLUME: self._set_volume,
            Property.SLEEP_TIME: self._set_sleep_time,
        }

    @property
    def table(self) -> Handlers:
        """Command class to handler."""
        return {
            PlaySoundFile: self.play_sound_file,
            PlayTone: self.play_tone,
            StopSoundPlayback: self.stop_sound,
            GetBatteryLevel: self.battery_level,
            KeepAlive: self.keep_alive,
            SetProperty: self.set_property,
            GetProperty: self.get_property,
        }

    def play_sound_file(self, command: PlaySoundFile) -> Answer:
        """Start a sound file; only its existence is checked."""
        if not self._loader.exists(command.name):
            return OUT_OF_RANGE
        self._sound.play_file(command.name, loop=bool(command.loop))
        return DONE

    def play_tone(self, command: PlayTone) -> Answer:
        """Start a tone; its range is not checked."""
        self._sound.play_tone(command.frequency_hz, command.duration_ms)
        return DONE

    def stop_sound(self, _: StopSoundPlayback) -> Answer:
        """Stop whatever sounds."""
        self._sound.stop()
        return DONE

    def battery_level(self, _: GetBatteryLevel) -> Answer:
        """The last sample."""
        return answer(BatteryLevel(self._ui.battery_mv))

    def keep_alive(self, _: KeepAlive) -> Answer:
        """Restart the sleep timer and tell its limit."""
        self._ui.stay_awake()
        return answer(SleepLimit(self._ui.sleep_ms))

    def set_property(self, command: SetProperty) -> Answer:
        """Change a setting."""
        setter = self._setters.get(command.property)
        return setter(command.value) if setter else _UNKNOWN

    def get_property(self, command: GetProperty) -> Answer:
        """Read a setting."""
        values = {
            Property.BLUETOOTH: bytes([self._radio.on]),
            Property.VOLUME: bytes([self._sound.volume]),
            Property.SLEEP_TIME: self._ui.sleep_ms.to_bytes(4, "little"),
        }
        value = values.get(command.property)
        return _UNKNOWN if value is None else answer(PropertyValue(value))

    def _set_bluetooth(self, value: bytes) -> Answer:
        self._radio.switch(bool(value[0]))
        return Answer(Status.IN_PROGRESS)

    def _set_volume(self, value: bytes) -> Answer:
        self._sound.volume = min(value[0], MAX_VOLUME)
        return DONE

    def _set_sleep_time(self, value: bytes) -> Answer:
        self._ui.set_sleep_minutes(int.from_bytes(value[:4], "little") // MINUTE_MS & 0xFF)
        return DONE
