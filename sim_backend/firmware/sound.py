"""The sound module: tones, sound files and their end. Source: docs/firmware.md section 4 (0x02, 0x03, 0x0C) and 5.2."""

from __future__ import annotations

import struct
from enum import IntEnum, IntFlag
from math import ceil
from typing import NamedTuple

from firmware_protocol.iomap import SoundState
from firmware_protocol.status import Status
from sim_backend.firmware.files.loader import Loader
from sim_backend.firmware.files.names import pack_name, unpack_name
from sim_backend.firmware.module import NEVER, Clock
from sim_backend.firmware.sound_ring import SoundRing
from sim_backend.firmware.waves import Waves

MAX_VOLUME = 4

_BUFFER = 64
"""Bytes of a file that are read at once; a smaller rest is not played."""

CLICK, ATTENTION, STARTUP = b"! Click.rso\0", b"! Attention.rso\0", b"! Startup.rso\0"
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
        self.name, self._started = pack_name("! Startup.rso"), ""
        self.flags = self.state = self.mode = 0
        self.volume = MAX_VOLUME
        self.tone: Tone | None = None
        self.from_file = self._sounds = False
        self._ends_ms = self._next_ms = 0
        self._waves = Waves()
        self._ring = SoundRing()
        self._sample_rest_ms = 0.0
        self._is_melody = True  # pieces are samples only after the header of a file has declared them so
        self._plays_buffer = self._begins_again = False
        self._notes: list[tuple[int, int]] = []

    def play_tone(self, frequency_hz: int, duration_ms: int, *, loop: bool = False) -> None:
        """Start a tone in the next pass; it replaces the current sound."""
        self.frequency_hz, self.duration_ms = frequency_hz, duration_ms
        self.mode, self.flags = SoundMode.TONE_LOOP if loop else SoundMode.TONE, self.flags | SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def stop(self) -> None:
        """Stop the sound in the next pass, but not one that is about to start."""
        self.state = int(SoundState.STOP)
        self.due_ms = self._clock.now_ms + 1

    def end_program(self, volume: int) -> None:
        """Stop the sound of a program that has ended, and restore the volume of the menu."""
        self.state, self.volume = int(SoundState.STOP), volume
        self.due_ms = self._clock.now_ms + 1

    def cancel(self) -> None:
        """Stop the sound in the next pass, and forget one that is about to start."""
        self.state, self.flags = int(SoundState.STOP), self.flags & ~int(SoundFlag.UPDATE)
        self.due_ms = self._clock.now_ms + 1

    @property
    def audible(self) -> bool:
        """Whether a tone or file is playing: until the pass before its end, or before the last sample of a file."""
        if self.state == (SoundState.FILE if self._is_melody else SoundState.TONE) or not (
            self._ring.ends_ms or self.state == SoundState.FILE
        ):
            return self._sounds and self._clock.now_ms < self._ends_ms - 1
        if not self._ring.ends_ms:
            return self._sounds
        return self._clock.now_ms + 1 < self._ring.ends_ms - self._ring.queued_sample_ms

    def wake(self) -> None:
        """Check the flags in the next pass: they were written through the map."""
        self.due_ms = min(self.due_ms, self._clock.now_ms + 1)

    def play_file(self, name: str, *, loop: bool) -> None:
        """Start a sound file in the next pass; it replaces the current sound."""
        self.name = pack_name(name)
        self.mode = int(SoundMode.LOOP if loop else SoundMode.ONCE)
        self.flags |= SoundFlag.UPDATE
        self.due_ms = self._clock.now_ms + 1

    def play_own(self, name: bytes, volume: int | None = None) -> None:
        """Play a sound of the user interface in the next pass, if its file exists; the name ends with a zero."""
        self.volume, before = self.volume if volume is None else volume, self.name
        self.play_file(unpack_name(before), loop=False)
        self.name = name + before[len(name) :]

    def run(self, now_ms: int) -> None:
        """Start, continue, stop or end a sound."""
        if self.flags & SoundFlag.UPDATE:
            self._update(now_ms)
        if self.state == SoundState.STOP:
            self.tone, self.from_file = None, False
            self._ring.silence()
            self._ring.clear()
            self._notes, self._plays_buffer = [], False
            self._silence()
        elif self.state in (SoundState.TONE, SoundState.FILE):
            self.flags, self._sounds = self.flags | SoundFlag.RUNNING, True
            if self.state == SoundState.TONE:  # the state may have been written while samples are played
                self._ends_ms = max(self._ends_ms, ceil(self._ring.ends_ms))
            if self.state == SoundState.FILE and not self._is_melody and self._ring.waits:
                self.from_file = True  # the loudspeaker gets it now, and plays it after a tone
            nothing = self._handle is None and not self._ring.waits and self.mode != SoundMode.LOOP
            if self.state == SoundState.FILE and nothing:  # a program or telegram has written the state
                if now_ms < self._ends_ms:  # a tone plays on
                    self._end_state()
                else:
                    self._silence()
            elif now_ms >= self._ends_ms:
                self._continue(now_ms)
        self.due_ms = self._ends_ms if self.state in (SoundState.TONE, SoundState.FILE) else NEVER

    def _update(self, now_ms: int) -> None:
        self.flags &= ~int(SoundFlag.UPDATE)
        interrupts = bool(self.flags & SoundFlag.RUNNING)
        if self.mode & SoundMode.TONE:
            rest_ms = self._ring.rest_of_sample_ms(now_ms)
            self._ring.silence()
            self._silence()
            self._begin(SoundState.TONE)
            self._start_tone(now_ms, rest_ms)
            return
        _, search, found = self._loader.find_first(unpack_name(self.name))
        if found is None:
            return
        self._started = found.name
        self._loader.close(search)
        if not found.size:
            self._loader.open_read(found.name)
            self._close_file()
            if interrupts:
                self._interrupt(now_ms)
                self.flags &= ~int(SoundFlag.RUNNING)
                self._sounds, self._ends_ms = False, 0
            return
        self._close_file()
        _, handle, size = self._loader.open_read(found.name)
        ring = self._ring
        self._sample_rest_ms = ring.rest_of_sample_ms(now_ms) if interrupts or not ring.outlasts(now_ms) else 0.0
        ring.silence(after_ms=now_ms)
        if interrupts:
            self._interrupt(now_ms)
        begins_anew = interrupts or ring.is_full
        if begins_anew:
            self._notes, self._plays_buffer = [], False
        self._start_file(handle, size - _HEADER.size, now_ms if begins_anew else max(now_ms, self._next_ms))

    def _interrupt(self, now_ms: int) -> None:
        """Take what plays from the loudspeaker."""
        self._ring.silence()
        self._waves.cut(now_ms)
        self.tone, self.from_file = None, False

    def _start_tone(self, now_ms: int, rest_ms: float = 0.0) -> None:
        """Play the tone of the map, after the rest of a file's sample."""
        self.tone, self.from_file = Tone(self.frequency_hz, self.duration_ms, self.volume), False
        self._play_waves(self.frequency_hz, self.duration_ms, now_ms, rest_ms)

    def _begin(self, state: SoundState) -> None:
        self.flags, self.state, self._sounds = self.flags | SoundFlag.RUNNING, int(state), True

    def _start_file(self, handle: int, size: int, begins_ms: int) -> None:
        """Play an open file from a pass on, after the buffers of a replaced file, as far as the ring counts them."""
        before, melody = SoundState(self.state), self._is_melody
        self._silence()
        self._handle = handle
        kind, _, rate, _ = _HEADER.unpack(self._loader.read(handle, _HEADER.size)[1].ljust(_HEADER.size, b"\0"))
        self._is_melody = kind not in (_SOUND, _COMPRESSED)
        if size < 0 or (kind != _MELODY and kind >> 8 != _SOUND >> 8):
            self._is_melody = melody if size < 0 else True
            self._go_on(before, begins_ms, closes=size >= 0)
            return
        if kind != _MELODY:
            rate, self.sample_rate = self.sample_rate or rate, 0
        self._begin(SoundState.FILE)
        ring = self._ring
        ring.set_rate(rate, 2 if kind == _COMPRESSED else 1)
        ring.store(self._loader.read(handle, _BUFFER)[1])
        rest_ms = max(self._waves.rest_ms(begins_ms), self._sample_rest_ms)
        ring.from_ms = begins_ms + rest_ms if ring.waits else 0.0
        samples_end_ms = ring.ends_ms - ring.queued_sample_ms if self._is_melody else 0.0
        self._ends_ms = max(begins_ms, ceil(samples_end_ms))

    def _go_on(self, before: SoundState, now_ms: int, *, closes: bool) -> None:
        """Continue with the sound before a file that is not a sound file: a tone has ended, the ring is played.

        A file with a whole header is closed, but the next sound or stop closes its number once more. Another
        one stays open until then, or until the ring is empty.
        """
        if closes and self._handle is not None:
            self._loader.close(self._handle)
        if before == SoundState.STOP:
            self.state = int(before)
        elif before in (SoundState.FILE, SoundState.TONE):
            self._begin(before)
            self._ends_ms = now_ms
        if before == SoundState.FILE and not self._is_melody:
            while self._ring.waits:
                self._queue_buffer(now_ms)
            self._silence()

    def _continue(self, now_ms: int) -> None:
        """Continue a tone or a file: play the next note or buffer, and read another buffer, or end."""
        if self.state == SoundState.TONE:
            if self.mode & SoundMode.LOOP:
                self._start_tone(now_ms)
            else:
                self._end()
        elif self._is_melody:
            self._play_note(now_ms)
        else:
            self._hand_over(now_ms)

    def _hand_over(self, now_ms: int) -> None:
        """Queue a buffer, if there is one and a place for it, and read another one if none is left."""
        if self._ring.waits and self._ring.takes(now_ms):
            self._queue_buffer(now_ms)
        if not (self._ring.waits or self._read_buffer()):
            self._silence()
            return
        self._ends_ms = max(now_ms + 1, ceil(self._ring.place_ms))

    def _queue_buffer(self, now_ms: int) -> None:
        self._ring.queue(now_ms)
        self.from_file = True

    def _read_buffer(self) -> bool:
        """Fill a buffer of the ring; at the end of the file, or if its handle was closed, a loop opens it again."""
        status, data = Status.HANDLE_ALREADY_CLOSED, b""
        if self._handle is not None:
            status, data = self._loader.read(self._handle, _BUFFER)
        self._begins_again = bool(status) and self.mode == SoundMode.LOOP
        if self._begins_again:
            data = self._read_again()
            status = Status.OK if data else Status.END_OF_FILE
        if not status:
            self._ring.store(data)
        return not status

    def _read_again(self) -> bytes:
        """Open the file that was started last, and read its first buffer; silence if it is missing or empty.

        The handle of a failed look-up is kept, too: it is closed the next time, whatever it belongs to by then.
        """
        self._close_file()
        _, self._handle, found = self._loader.find_first(self._started)
        if found is None:
            return bytes(_BUFFER)
        self._loader.close(self._handle)
        status, self._handle, _ = self._loader.open_read(found.name)
        if status:
            return bytes(_BUFFER)
        self._loader.read(self._handle, _HEADER.size)
        return self._loader.read(self._handle, _BUFFER)[1]

    def _play_note(self, now_ms: int) -> None:
        """Play the next note of a melody; its buffer stays in the ring until its last note has ended.

        A buffer without a whole note is skipped. A loop that begins again plays its first note in the next pass.
        """
        while not self._notes:
            if self._plays_buffer:
                self._ring.free()
                self._plays_buffer = False
                if self._ring.waits:  # one that waits in the ring begins in the next pass
                    self._ends_ms = now_ms + 1
                    return
            if not self._ring.waits:
                if not self._read_buffer():
                    self._silence()
                    return
                if self._begins_again:
                    self._ends_ms = now_ms + 1
                    return
            self._plays_buffer, data = True, self._ring.piece
            self._notes = list(_NOTE.iter_unpack(data[: len(data) // _NOTE.size * _NOTE.size]))
        frequency_hz, duration_ms = self._notes.pop(0)
        self._play_waves(frequency_hz, duration_ms, now_ms, self._ring.rest_for_note_ms(now_ms))

    def _play_waves(self, frequency_hz: int, duration_ms: int, now_ms: int, rest_ms: float = 0.0) -> None:
        """Play a tone, after the rest of a sample or of another tone's wave."""
        self._ends_ms = self._next_ms = self._waves.begin(frequency_hz, duration_ms, now_ms, rest_ms)

    def _silence(self) -> None:
        """End the sound for the firmware; waves that were handed over still play."""
        if self.state == SoundState.STOP or (self.state == SoundState.FILE and not self._is_melody):
            self._waves.stop()
        self._end()
        self._close_file()

    def _end(self) -> None:
        self._end_state()
        self._sounds, self._ends_ms, self._next_ms = False, 0, 0

    def _end_state(self) -> None:
        """End the sound for the map."""
        self.flags &= ~int(SoundFlag.RUNNING)
        if self.state in (SoundState.FILE, SoundState.TONE, SoundState.STOP):
            self.state = int(SoundState.IDLE)

    def _close_file(self) -> None:
        if self._handle is not None:
            self._loader.close(self._handle)
            self._handle = None
