"""The pieces of a sound file between the file and the loudspeaker. Source: docs/firmware.md section 6.2."""

from __future__ import annotations

from sim_backend.firmware.waves import QUEUED, period_ms

_SAMPLE_CLOCKS = 512
"""Clocks per sample of a file, times the divider of the clock."""

_SLOWEST, _FASTEST = 2000, 16_000
"""Range of sample rates."""

_BUFFERS = 3
"""Buffers of the ring. It counts modulo this number, so a third one empties it."""


class SoundRing:
    """The ring of pieces that were read, and the queue of those that the loudspeaker has got as samples.

    Attributes:
        from_ms: The earliest time at which the next piece is played.
        queued_sample_ms: Time of a sample of the last piece in the queue.
    """

    def __init__(self) -> None:
        self._buffers, self._read, self._played = [b""] * _BUFFERS, 0, 0
        self._byte_ms = self._sample_ms = period_ms(_SAMPLE_CLOCKS, _SLOWEST)
        self._ends: list[float] = []
        self._places: list[float] = []
        self.from_ms = self.queued_sample_ms = self._chained_sample_ms = 0.0

    def set_rate(self, samples_per_s: int, samples_per_byte: int) -> None:
        """Set the rate and the format of the samples to come."""
        self._sample_ms = period_ms(_SAMPLE_CLOCKS, min(max(samples_per_s, _SLOWEST), _FASTEST))
        self._byte_ms = self._sample_ms * samples_per_byte

    def store(self, piece: bytes) -> None:
        """Put a piece of the file into the ring."""
        self._buffers[self._read] = piece
        self._read = (self._read + 1) % _BUFFERS

    @property
    def waits(self) -> bool:
        """Whether a piece waits in the ring, as far as it counts them."""
        return self._read != self._played

    @property
    def is_full(self) -> bool:
        """Whether the next piece empties the ring."""
        return (self._read + 1) % _BUFFERS == self._played

    @property
    def piece(self) -> bytes:
        """The piece that is next."""
        return self._buffers[self._played]

    def free(self) -> None:
        """Free the place of that piece."""
        self._played = (self._played + 1) % _BUFFERS

    def clear(self) -> None:
        """Empty the ring."""
        self._read = self._played = 0

    def queue(self, now_ms: int) -> None:
        """Give the next piece to the loudspeaker as samples."""
        slower_ms = self._sample_ms - self.queued_sample_ms  # the last sample has the new rate already
        begins_ms = max([now_ms, self.from_ms, *(end_ms + slower_ms for end_ms in self._ends[-1:])])
        ends_ms = begins_ms + len(self.piece) * self._byte_ms
        if self.outlasts(now_ms):
            self._chained_sample_ms = self._sample_ms
        self._ends, self.queued_sample_ms = [*self._ends, ends_ms][-QUEUED:], self._sample_ms
        self._places = [*self._places, ends_ms - QUEUED * self._sample_ms][-QUEUED:]
        self.free()

    def silence(self, *, after_ms: int | None = None) -> None:
        """Take the samples from the loudspeaker: all, or what ends until some pass."""
        self._ends = [] if after_ms is None else [end_ms for end_ms in self._ends if end_ms > after_ms]

    @property
    def ends_ms(self) -> float:
        """When the last samples end; 0 without any."""
        return self._ends[-1] if self._ends else 0.0

    @property
    def place_ms(self) -> float:
        """When the queue has a place."""
        return self._places[0] if len(self._ends) == QUEUED else 0.0

    def takes(self, now_ms: int) -> bool:
        """Return whether a piece can be queued: not without a place, or in the last sample but one of a lone piece."""
        alone = bool(self._ends) and all(end_ms <= now_ms for end_ms in self._ends[:-1])
        runs_dry = alone and 0.0 <= now_ms - self._places[-1] < self._sample_ms
        return now_ms >= self.place_ms and not runs_dry

    def outlasts(self, now_ms: int) -> bool:
        """Return whether samples are on the loudspeaker until after a pass."""
        return now_ms < self.ends_ms

    def rest_for_note_ms(self, now_ms: int) -> float:
        """Return how long a note waits for samples: one more in the pass in which the last one begins.

        It lasts as long as in the last piece that was queued behind another one; there is none before such a piece.
        """
        last_begins = now_ms < self.ends_ms - self.queued_sample_ms + 1
        return self._chained_sample_ms if last_begins else 0.0

    def rest_of_sample_ms(self, now_ms: int) -> float:
        """Return how long the sample that is on the loudspeaker still takes, a whole one in its last pass."""
        if self.outlasts(now_ms):
            return (self.ends_ms - now_ms) % self._sample_ms
        return self._sample_ms if self.outlasts(now_ms - 1) else 0.0
