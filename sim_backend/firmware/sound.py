"""The sound module: tones and their end. Source: docs/firmware.md section 4 (0x03, 0x0C) and 5.2."""

from __future__ import annotations

from enum import IntEnum, IntFlag
from typing import NamedTuple

from sim_backend.firmware.module import NEVER, Clock

MAX_VOLUME = 4

SHORTEST_MS = 10
"""Shorter tones last as long."""


class SoundFlag(IntFlag):
    """Flags byte of the map."""

    UPDATE = 1
    RUNNING = 2


class SoundState(IntEnum):
    """State byte of the map."""

    IDLE = 0
    FILE = 2
    TONE = 3
    STOP = 4


class SoundMode(IntEnum):
    """Mode byte of the map."""

    ONCE = 0
    LOOP = 1
    TONE = 2


class Tone(NamedTuple):
    """What the loudspeaker was last told."""

    frequency_hz: int
    duration_ms: int
    volume: int


class SoundModule:
    """The loudspeaker.

    Attributes:
        due_ms: See `Module`.
        frequency_hz, duration_ms: Of the tone commanded.
        sample_rate: Of a sound file, per second; 0 takes the file's.
        name: Last sound file; the power-on melody at first.
        flags: See `SoundFlag`.
        state: See `SoundState`.
        mode: See `SoundMode`.
        volume: 0..4.
        tone: Last tone that was started and not stopped, or None.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self.due_ms = NEVER
        self.frequency_hz = self.duration_ms = self.sample_rate = 0
        self.name = b"! Startup.rso".ljust(20, b"\0")
        self.flags = self.state = self.mode = 0
        self.volume = MAX_VOLUME
        self.tone: Tone | None = None
        self._ends_ms = 0

    def play_tone(self, frequency_hz: int, duration_ms: int) -> None:
        """Start a tone in the next pass, in place of what sounds now."""
        self.frequency_hz, self.duration_ms = frequency_hz, duration_ms
        self.mode, self.flags = SoundMode.TONE, self.flags | SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def stop(self) -> None:
        """Fall silent in the next pass."""
        self.state, self.flags = SoundState.STOP, 0
        self.due_ms = self._clock.now_ms + 1

    @property
    def playing(self) -> bool:
        """Whether a tone sounds now."""
        return bool(self.flags & SoundFlag.RUNNING)

    def wake(self) -> None:
        """Look at the flags in the next pass: they were written through the map."""
        self.due_ms = min(self.due_ms, self._clock.now_ms + 1)

    def run(self, now_ms: int) -> None:
        """Start, stop or end what is due."""
        self.due_ms = NEVER
        if self.flags & SoundFlag.UPDATE and self.mode == SoundMode.TONE:
            self.flags, self.state = int(SoundFlag.RUNNING), int(SoundState.TONE)
            self.tone = Tone(self.frequency_hz, self.duration_ms, self.volume)
            self._ends_ms = now_ms + max(self.duration_ms, SHORTEST_MS)
        elif self.state == SoundState.STOP:
            self.tone = None
            self.flags = self.state = 0
        elif now_ms >= self._ends_ms:
            self.flags = self.state = 0
        if self.playing:
            self.due_ms = self._ends_ms
