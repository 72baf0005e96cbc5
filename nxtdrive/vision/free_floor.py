"""How far the floor is free, in one frame: floor is what has the colours of the floor that is known to be free.

The method is that of Ulrich and Nourbakhsh, "Appearance-based obstacle detection with monocular color vision" (AAAI
2000): the colours are learned from the lower edge of frames in which the floor ahead is free; from there upwards, a
column of a frame shows floor until its pixels have other colours. Whether it was free may be known only later, once the
robot has driven there, so the lower edges of recent frames are kept. `docs/vision.md` section 3 has what it is worth.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image


@dataclass(frozen=True, slots=True)
class FreeFloorTuning:
    """Tuning constants of the detector; pixels are those of a frame `width_px` wide.

    Attributes:
        width_px: Frames are brought to this width.
        columns: Directions in which it looks, spread evenly over the frame.
        sample_height: The colours are learned from this share of a frame's height, at its lower edge,
        sample_width: and this share of its width, in the middle: 15 degrees to either side, of the beam of the sonar.
        bins: Steps of each of lightness, green to red, and blue to yellow (CIELAB).
        chroma_step: Width of a step of the latter two; of lightness it is 256 / `bins`.
        light_bins: A colour of the floor makes those within this many steps of its lightness likely, for shade.
        chroma_bins: The same for the other two.
        keeps: Share that a further frame leaves of what was learned before.
        learn_every_s: At most one frame is kept in this time; so what was learned fades in ten to forty seconds.
        kept_s: A frame is kept for this long.
        rare: Colours with less than this share of the commonest one's count are not the floor's.
        run_px: The floor ends where this many pixels in a column have other colours.
        grain_px: Specks up to this size are ignored.
        familiar: Where less than this share of the sample has the floor's colours, the exposure may have changed.
        gain: Changes of exposure up to these factors are undone.
    """

    width_px: int = 320
    columns: int = 24
    sample_height: float = 0.14
    sample_width: float = 0.45
    bins: int = 32
    chroma_step: int = 3
    light_bins: int = 4
    chroma_bins: int = 1
    keeps: float = 0.97
    learn_every_s: float = 0.2
    kept_s: float = 20.0
    rare: float = 0.004
    run_px: int = 5
    grain_px: int = 5
    familiar: float = 0.8
    gain: tuple[float, float] = (0.4, 2.5)


TUNING = FreeFloorTuning()

Mask = NDArray[np.bool_]


class FreeFloorDetector:
    """Finds where the floor ends, once it has learned what the floor looks like."""

    def __init__(self) -> None:
        self._counts: NDArray[np.float64] | None = None
        self._likely: Mask = np.zeros(TUNING.bins**3, bool)
        self._samples: dict[float, Image] = {}
        self._kept_s = -math.inf
        self._light = 0.0

    @property
    def ready(self) -> bool:
        """Whether it has learned what the floor looks like."""
        return self._counts is not None

    def keep(self, image: Image, time_s: float) -> None:
        """Keep the part of a frame, (height, width, 3) BGR, that shows the floor right ahead, for `TUNING.kept_s`.

        Args:
            image: The frame.
            time_s: When it was taken, in seconds on any clock; later than the frames before.
        """
        if time_s - self._kept_s < TUNING.learn_every_s:
            return
        self._kept_s = time_s
        self._samples = {then_s: sample for then_s, sample in self._samples.items() if time_s - then_s <= TUNING.kept_s}
        self._samples[time_s] = _sample(_reduced(image)).copy()

    def learn(self, time_s: float) -> None:
        """Learn from the kept frame of exactly this time, if there is one: the floor right ahead was free in it."""
        sample = self._samples.pop(time_s, None)
        if sample is None:
            return
        bins, light = _bins(sample), _light(sample)
        counts = np.bincount(bins.ravel(), minlength=TUNING.bins**3) / bins.size
        if self._counts is not None:
            counts = TUNING.keeps * self._counts + (1.0 - TUNING.keeps) * counts
            light = TUNING.keeps * self._light + (1.0 - TUNING.keeps) * light
        self._counts, self._light = counts, light
        cube = counts.reshape(TUNING.bins, TUNING.bins, TUNING.bins)
        for axis, reach in enumerate((TUNING.light_bins, TUNING.chroma_bins, TUNING.chroma_bins)):
            cube = _spread(cube, axis, reach)
        self._likely = np.asarray(cube > TUNING.rare * cube.max()).ravel()

    def ends(self, image: Image) -> NDArray[np.float64]:
        """Return the pixels, (n, 2) columns and rows of the frame, at which the floor ends; lowest where it does first.

        The row is 0 where everything up to the upper edge looks like floor. Columns whose lowest pixels are not floor
        are left out.
        """
        scale = image.shape[1] / TUNING.width_px
        small = _reduced(image)
        height, width = small.shape[:2]
        if height < TUNING.run_px:
            return np.empty((0, 2))
        floor = cv2.medianBlur(self._likely[_bins(self._exposure_matched(small))].astype(np.uint8), TUNING.grain_px)
        columns = ((np.arange(TUNING.columns) + 0.5) * width / TUNING.columns).astype(np.int64)
        upwards = np.cumsum(floor[::-1, columns] == 0, axis=0)
        in_run = upwards.copy()
        in_run[TUNING.run_px :] -= upwards[: -TUNING.run_px]
        full = in_run[TUNING.run_px - 1 :] == TUNING.run_px
        begins = np.where(full.any(axis=0), full.argmax(axis=0), height)
        known = begins > 0
        ends = np.stack([columns[known] + 0.5, height - begins[known]], axis=1)
        return np.asarray(ends * scale, np.float64)

    def _exposure_matched(self, small: Image) -> Image:
        """Return a frame in the light in which the floor was learned, if more of the sample is then known."""
        known = self._known(small)
        if known >= TUNING.familiar or not self.ready:
            return small
        gain = min(max(self._light / max(_light(_sample(small)), 1.0), TUNING.gain[0]), TUNING.gain[1])
        matched = np.asarray(cv2.convertScaleAbs(small, alpha=gain), np.uint8)
        return matched if self._known(matched) > max(known, 0.5) else small

    def _known(self, small: Image) -> float:
        """Return which share of a frame's sample has the floor's colours."""
        return float(self._likely[_bins(_sample(small))].mean())


def _sample(small: Image) -> Image:
    """Return the part of a frame that shows free floor if there is no near echo."""
    height, width = small.shape[:2]
    top, aside = int(height * (1.0 - TUNING.sample_height)), round(width * (1.0 - TUNING.sample_width) / 2)
    return small[top:, aside : width - aside]


def _light(sample: Image) -> float:
    """Return the brightness of a part of a frame."""
    return float(np.median(cv2.cvtColor(sample, cv2.COLOR_BGR2GRAY)))


def _reduced(image: Image) -> Image:
    """Return a frame of the detector's width."""
    height, width = image.shape[:2]
    if width == TUNING.width_px:
        return image
    size = (TUNING.width_px, max(1, round(height * TUNING.width_px / width)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _bins(image: Image) -> NDArray[np.int64]:
    """Return the number of each pixel's colour, (height, width)."""
    lab = cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0), cv2.COLOR_BGR2LAB).astype(np.int64)
    light = lab[..., 0] * TUNING.bins // 256
    a, b = (np.clip((lab[..., i] - 128) // TUNING.chroma_step + TUNING.bins // 2, 0, TUNING.bins - 1) for i in (1, 2))
    return np.asarray((light * TUNING.bins + a) * TUNING.bins + b)


def _spread(cube: NDArray[np.float64], axis: int, reach: int) -> NDArray[np.float64]:
    """Return counts that include those of the neighbours along an axis, up to `reach` steps away."""
    padded = np.pad(cube, [(reach, reach) if each == axis else (0, 0) for each in range(cube.ndim)])
    size = cube.shape[axis]
    return np.asarray(sum(np.take(padded, range(i, i + size), axis) for i in range(2 * reach + 1)), np.float64)
