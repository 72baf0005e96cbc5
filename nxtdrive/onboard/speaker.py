"""The brick's loudspeaker. Facts are those of docs/firmware.md section 1."""

from __future__ import annotations

from firmware_protocol.direct import GetProperty, PlaySoundFile, PlayTone, SetProperty, StopSoundPlayback
from firmware_protocol.enums import Property
from nxtdrive.link.link import Link
from nxtdrive.onboard.files import Files
from nxtdrive.ports import in_range, whole_number

TONE_HZ = (220, 14080)
"""Range of tones. Source: docs/firmware.md section 4, 0x03."""
LOUDEST = 4
"""Highest volume. Source: docs/firmware.md section 4, property 1."""


class Speaker:
    """Tones, sound files and their volume. Sounds wait for file operations, whose handle they would close (fact 21).

    Args:
        link: The link to the brick.
        files: The files on the brick.
    """

    def __init__(self, link: Link, files: Files) -> None:
        self._link = link
        self._files = files

    def tone(self, frequency_hz: int, duration_ms: int) -> None:
        """Play a tone, 220..14080 Hz, 10..65535 ms; returns while it sounds."""
        in_range("frequency_hz", frequency_hz, *TONE_HZ)
        in_range("duration_ms", duration_ms, 10, 0xFFFF)
        with self._files.exclusive():
            self._link.request(PlayTone(frequency_hz, duration_ms))

    def play(self, name: str, *, loop: bool = False) -> None:
        """Play a sound file on the brick, such as ``Hello.rso``; returns while it sounds."""
        with self._files.exclusive():
            self._link.request(PlaySoundFile(loop, name))

    def stop(self) -> None:
        """Stop the sound."""
        with self._files.exclusive():
            self._link.request(StopSoundPlayback())

    @property
    def volume(self) -> int:
        """Volume, 0..4, until the brick is switched off; may be set. Needs firmware 1.28 or later."""
        return self._link.request(GetProperty(Property.VOLUME)).number

    @volume.setter
    def volume(self, level: int) -> None:
        self._link.request(SetProperty.volume(whole_number("volume", level, 0, LOUDEST)))
