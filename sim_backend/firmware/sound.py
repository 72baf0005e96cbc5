"""The sound module: tones, sound files and their end. Source: docs/firmware.md section 4 (0x02, 0x03, 0x0C) and 5.2."""

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from math import ceil
from typing import NamedTuple

from firmware_protocol.iomap import SoundState
from sim_backend.firmware.loader import Loader
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.names import pack_name, unpack_name

MAX_VOLUME = 4

_CLOCK_HZ = 48_054_850
_WAVE_CLOCKS, _SAMPLE_CLOCKS = 1024, 512
"""Clocks per wave of a tone and per sample of a file, times the divider of the clock."""

_LOWEST_HZ, _HIGHEST_HZ, _REST_HZ = 220, 14_080, 1000
"""Range of tones, and the frequency of a rest (0 Hz)."""

_SHORTEST_MS = 10
_SLOWEST, _FASTEST = 2000, 16_000
"""Range of sample rates."""

_BUFFER = 64
"""Bytes of a file that are read at once; a rest of fewer is not played."""

_QUEUED = 2
"""Buffers or waves that still play when the last one was handed over, which is the end for the firmware."""

CLICK, ATTENTION = b"! Click.rso\0", b"! Attention.rso\0"
"""Sounds of the user interface."""

_HEADER = struct.Struct(">HHHH")
_NOTE = struct.Struct(">HH")
_SOUND, _COMPRESSED, _MELODY = 0x0100, 0x0101, 0x0600
"""Header of a sound file: format, samples, samples per second, play mode; its formats."""


class SoundFlag(IntFlag):
    """Flags byte of the map."""

    UPDATE = 1
    RUNNING = 2


class SoundMode(IntEnum):
    """Mode byte of the map."""

    ONCE = 0
    LOOP = 1
    TONE = 2
    TONE_LOOP = 3


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
        sample_rate: Samples per second of the next sound file; 0 uses the file's own rate.
        name: Last sound file; the power-on melody at first.
        flags: See `SoundFlag`.
        state: See `firmware_protocol.iomap.SoundState`.
        mode: See `SoundMode`.
        volume: 0..4.
        tone: The last tone that was started by a command and not stopped, or None.
        from_file: Whether a sampled file was started after it.
    """

    def __init__(self, clock: Clock, loader: Loader) -> None:
        self._clock, self._loader = clock, loader
        self._handle: int | None = 0  # so the first sound or stop closes handle 0, whatever it belongs to
        self.due_ms = NEVER
        self.frequency_hz = self.duration_ms = self.sample_rate = 0
        self.name = pack_name("! Startup.rso")
        self.flags = self.state = self.mode = 0
        self.volume = MAX_VOLUME
        self.tone: Tone | None = None
        self.from_file = False
        self._ends_ms: int = 0
        self._piece_ms = 0.0
        self._handed: list[float] = []
        self._pieces = 0
        self._wave_ms = self._waves_begin_ms = self._waves_end_ms = 0.0
        self._sample_ms = 0.0
        self._unfinished = False
        self._queue: list[float] = []
        self._notes: list[tuple[int, int]] = []
        self._next_note = 0

    def play_tone(self, frequency_hz: int, duration_ms: int, *, loop: bool = False) -> None:
        """Start a tone in the next pass; it replaces the current sound."""
        self.frequency_hz, self.duration_ms = frequency_hz, duration_ms
        self.mode, self.flags = SoundMode.TONE_LOOP if loop else SoundMode.TONE, self.flags | SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def stop(self) -> None:
        """Stop the sound in the next pass."""
        self.state = int(SoundState.STOP)
        self.flags &= ~int(SoundFlag.UPDATE | SoundFlag.RUNNING)
        self.due_ms = self._clock.now_ms + 1

    def end_program(self, volume: int) -> None:
        """Stop the sound of a program that has ended, and take back the volume of the menu."""
        self.state, self.volume = int(SoundState.STOP), volume
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

    def play_own(self, name: bytes, volume: int) -> None:
        """Play a sound of the user interface in the next pass, if its file exists."""
        self.volume, before = volume, self.name
        self.play_file(unpack_name(before), loop=False)
        self.name = name + before[len(name) :]

    def run(self, now_ms: int) -> None:
        """Start, continue, stop or end a sound."""
        if self.flags & SoundFlag.UPDATE:
            self._update(now_ms)
        if self.state == SoundState.STOP:
            self.tone, self.from_file, self._unfinished, self._queue = None, False, False, []
            self._silence()
        elif self.state in (SoundState.TONE, SoundState.FILE):
            self.flags |= SoundFlag.RUNNING
            if self.state == SoundState.FILE and self._handle is None:  # a program or telegram has written the state
                self._silence()
            elif now_ms >= self._ends_ms:
                self._continue(now_ms)
        self.due_ms = self._ends_ms if self.state in (SoundState.TONE, SoundState.FILE) else NEVER

    def _update(self, now_ms: int) -> None:
        self.flags &= ~int(SoundFlag.UPDATE)
        if self.mode & SoundMode.TONE:
            self._silence()
            self._begin(SoundState.TONE)
            self.tone, self.from_file = Tone(self.frequency_hz, self.duration_ms, self.volume), False
            self._play_waves(self.frequency_hz, self.duration_ms, now_ms)
            return
        status, handle, _ = self._loader.open_read(unpack_name(self.name), keep=True)
        if not status:
            self._loader.close(handle)
            self._close_file()
            _, handle, size = self._loader.open_read(unpack_name(self.name), keep=True)
            self._start_file(handle, size - _HEADER.size, now_ms)

    def _begin(self, state: SoundState) -> None:
        self.flags, self.state = self.flags | SoundFlag.RUNNING, int(state)

    def _start_file(self, handle: int, size: int, now_ms: int) -> None:
        """Play an open file; one that is not a sound file stays silent.

        A file that was replaced before its end leaves a buffer: the next file is one longer, a melody never ends.
        """
        self._silence()
        self._handle, self._notes = handle, []
        kind, _, rate, _ = _HEADER.unpack(self._loader.read(handle, _HEADER.size)[1].ljust(_HEADER.size, b"\0"))
        rate, self.sample_rate = self.sample_rate or rate, 0
        if kind == _MELODY:
            notes = self._loader.read(handle, max(size, 0))[1]
            self._notes = list(_NOTE.iter_unpack(notes[: len(notes) // _NOTE.size * _NOTE.size]))
        if self._notes:
            self._begin(SoundState.FILE)
            self.tone, self.from_file, self._next_note = None, False, 0
            self._play_note(now_ms)
            if self._unfinished:
                self._ends_ms, self._unfinished = NEVER, False
        elif kind >> 8 == _SOUND >> 8 and size > 0:
            self._play_samples(kind, rate, size, now_ms)
        if not self.state:
            self._silence()

    def _play_samples(self, kind: int, rate: int, size: int, now_ms: int) -> None:
        """Queue the buffers of a file; the firmware takes the hand-over of the last one for the end."""
        sample_ms = _period_ms(_SAMPLE_CLOCKS, min(max(rate, _SLOWEST), _FASTEST))
        buffers = max(size // _BUFFER, 1)
        buffer_ms = min(size, _BUFFER) * (2 if kind == _COMPRESSED else 1) * sample_ms
        queue = [] if self._unfinished else [end_ms for end_ms in self._queue if end_ms > now_ms]
        places = _QUEUED - self._unfinished
        handed = [float(now_ms)]
        for _ in range(buffers):
            handed.append(handed[-1] if len(queue) < places else queue[-places])
            queue.append(max(handed[-1], queue[-1] if queue else now_ms) + buffer_ms)
        del handed[0]
        if handed[-1] <= now_ms and not self._unfinished and self.mode != SoundMode.LOOP and buffers < _QUEUED:
            return
        self._begin(SoundState.FILE)
        self.from_file, self._piece_ms, self._sample_ms = True, buffer_ms, sample_ms
        if kind not in (_SOUND, _COMPRESSED):
            self._ends_ms = NEVER
            return
        self._queue, self._unfinished = queue[-_QUEUED:], True
        self._handed, self._pieces = handed, 0
        self._read_piece()
        more = self._next_piece_ms > now_ms or self._read_piece()
        self._ends_ms = max(now_ms + 1, self._next_piece_ms) if more else now_ms + 1

    @property
    def _next_piece_ms(self) -> int:
        """When the next piece is read: as the last one but one is handed over."""
        late = max(self._pieces - len(self._handed), 0)
        handed_ms = self._handed[self._pieces - late - 1] + late * self._piece_ms
        return ceil(handed_ms - _QUEUED * self._sample_ms)

    def _read_piece(self) -> bool:
        """Read the next piece of the file; at its end, or if its handle was closed, a loop opens it again."""
        self._pieces += 1
        if self._handle is None or not self._loader.read(self._handle, _BUFFER)[0]:
            return self._handle is not None
        if self.mode != SoundMode.LOOP:
            return False
        self._loader.close(self._handle)
        status, handle, _ = self._loader.open_read(unpack_name(self.name), keep=True)
        self._handle = None if status else handle
        self._loader.read(handle, _HEADER.size + _BUFFER)
        return True

    def _continue(self, now_ms: int) -> None:
        """The last buffer was handed over: play the next note or the sound anew, or end."""
        if self.state == SoundState.TONE:
            if self.mode & SoundMode.LOOP:
                self._ends_ms = NEVER
            else:
                self._silence()
        elif self._notes and (self._next_note < len(self._notes) or self.mode == SoundMode.LOOP):
            self._play_note(now_ms)
        elif not self._notes and self._read_piece():
            self._ends_ms = max(now_ms + 1, self._next_piece_ms)
        else:
            self._silence()
            self._unfinished = False

    def _play_note(self, now_ms: int) -> None:
        frequency_hz, duration_ms = self._notes[self._next_note % len(self._notes)]
        self._next_note = self._next_note % len(self._notes) + 1
        self._play_waves(frequency_hz, duration_ms, now_ms)

    def _play_waves(self, frequency_hz: int, duration_ms: int, now_ms: int) -> None:
        """Play a tone; it begins when the wave that is on the loudspeaker ends.

        Tones of more than a hundred waves or so are longer than commanded, as the divider of the clock is rounded up.
        """
        hertz = min(max(frequency_hz, _LOWEST_HZ), _HIGHEST_HZ) if frequency_hz else _REST_HZ
        waits_ms = 0.0
        if now_ms < self._waves_end_ms:
            waits_ms = self._wave_ms - (now_ms - self._waves_begin_ms) % self._wave_ms
        waves = hertz * max(duration_ms, _SHORTEST_MS) // 1000 - _QUEUED - _QUEUED * hertz // 1000
        self._wave_ms = _period_ms(_WAVE_CLOCKS, hertz)
        self._waves_begin_ms = now_ms + waits_ms
        self._waves_end_ms = self._waves_begin_ms + (waves + 1) * self._wave_ms
        self._ends_ms = max(now_ms + 1, ceil(self._waves_end_ms - self._wave_ms))

    def _silence(self) -> None:
        """End the sound for the firmware; waves that were handed over still play."""
        if self.state in (SoundState.STOP, SoundState.FILE) and not self._notes:
            self._waves_end_ms = 0.0
        self.flags, self.state, self._ends_ms = self.flags & ~int(SoundFlag.RUNNING), 0, 0
        self._close_file()

    def _close_file(self) -> None:
        if self._handle is not None:
            self._loader.close(self._handle)
            self._handle = None


def _period_ms(clocks: int, hertz: int) -> float:
    """Milliseconds of a wave or sample; the divider of the clock is an integer, rounded up."""
    return ceil(_CLOCK_HZ / clocks / hertz) * clocks * 1000 / _CLOCK_HZ
