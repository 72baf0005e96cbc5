"""The sound module: tones, sound files and their end. Source: docs/firmware.md section 4 (0x02, 0x03, 0x0C) and 5.2."""

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from typing import NamedTuple

from firmware_protocol.iomap import SoundState
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.names import pack_name, unpack_name

MAX_VOLUME = 4

SHORTEST_MS = 10
"""Duration of shorter tones."""

_HEADER = struct.Struct(">HHHH")
_UNCOMPRESSED = 0x0100
"""Header of a sound file: format, samples, samples per second, play mode; format of 8-bit samples."""


class SoundFlag(IntFlag):
    """Flags byte of the map."""

    UPDATE = 1
    RUNNING = 2


class SoundMode(IntEnum):
    """Mode byte of the map."""

    ONCE = 0
    LOOP = 1
    TONE = 2


class Tone(NamedTuple):
    """A tone as commanded."""

    frequency_hz: int
    duration_ms: int
    volume: int


class SoundModule:
    """The loudspeaker.

    Attributes:
        due_ms: See `Module`.
        frequency_hz, duration_ms: The commanded tone.
        sample_rate: Samples per second of a sound file; 0 uses the file's own rate.
        name: Last sound file; the power-on melody at first.
        flags: See `SoundFlag`.
        state: See `firmware_protocol.iomap.SoundState`.
        mode: See `SoundMode`.
        volume: 0..4.
        tone: The last tone that was started and not stopped, or None.
    """

    def __init__(self, clock: Clock, loader: Loader) -> None:
        self._clock, self._loader = clock, loader
        self._handle: int | None = 0  # so the first sound or stop closes handle 0, whatever it belongs to
        self._length_ms = 0
        self.due_ms = NEVER
        self.frequency_hz = self.duration_ms = self.sample_rate = 0
        self.name = pack_name("! Startup.rso")
        self.flags = self.state = self.mode = 0
        self.volume = MAX_VOLUME
        self.tone: Tone | None = None
        self._ends_ms = 0

    def play_tone(self, frequency_hz: int, duration_ms: int) -> None:
        """Start a tone in the next pass; it replaces the current sound."""
        self.frequency_hz, self.duration_ms = frequency_hz, duration_ms
        self.mode, self.flags = SoundMode.TONE, self.flags | SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def stop(self) -> None:
        """Stop the sound in the next pass."""
        self.state, self.flags = int(SoundState.STOP), 0
        self.due_ms = self._clock.now_ms + 1

    @property
    def playing(self) -> bool:
        """Whether a tone or file is playing."""
        return bool(self.flags & SoundFlag.RUNNING)

    def wake(self) -> None:
        """Check the flags in the next pass: they were written through the map."""
        self.due_ms = min(self.due_ms, self._clock.now_ms + 1)

    def play_file(self, name: str, *, loop: bool) -> None:
        """Start a sound file in the next pass; it replaces the current sound."""
        self.name = pack_name(name)
        self.mode = int(SoundMode.LOOP if loop else SoundMode.ONCE)
        self.flags |= SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def run(self, now_ms: int) -> None:
        """Start, stop or end a sound."""
        if self.flags & SoundFlag.UPDATE:
            self._silence()
            if self.mode == SoundMode.TONE:
                self._start_tone()
            else:
                self._start_file()
            self._ends_ms = now_ms + self._length_ms
        elif self.state == SoundState.STOP:
            self.tone = None
            self._silence()
        elif now_ms >= self._ends_ms and self.state == SoundState.FILE and self.mode == SoundMode.LOOP:
            self._ends_ms = now_ms + self._length_ms
        elif now_ms >= self._ends_ms:
            self._silence()
        self.due_ms = self._ends_ms if self.playing else NEVER

    def _start_tone(self) -> None:
        self.flags, self.state = int(SoundFlag.RUNNING), int(SoundState.TONE)
        self.tone = Tone(self.frequency_hz, self.duration_ms, self.volume)
        self._length_ms = max(self.duration_ms, SHORTEST_MS)

    def _start_file(self) -> None:
        """Open the file and check its header; a file that is not a sound file stays silent."""
        status, handle, _ = self._loader.open_read(unpack_name(self.name), keep=True)
        if status:
            return
        self._handle = handle
        kind, samples, rate, _ = _HEADER.unpack(self._loader.read(handle, _HEADER.size)[1].ljust(_HEADER.size, b"\0"))
        if kind != _UNCOMPRESSED or not rate:
            self._silence()
            return
        self.flags, self.state = int(SoundFlag.RUNNING), int(SoundState.FILE)
        self._length_ms = max(samples * 1000 // (self.sample_rate or rate), SHORTEST_MS)

    def _silence(self) -> None:
        self.flags = self.state = 0
        if self._handle is not None:
            self._loader.close(self._handle)
            self._handle = None
