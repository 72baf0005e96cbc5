"""How far the floor is free, in one frame: floor is what has the colours of the floor that is known to be free.

The method is that of Ulrich and Nourbakhsh, "Appearance-based obstacle detection with monocular color vision" (AAAI
2000): the colours are learned from the lower edge of frames in which the floor ahead is free; from there upwards, a
column of a frame shows floor until its pixels have other colours. Whether it was free may be known only later, once the
robot has driven there, so the lower edges of recent frames are kept. `docs/ranges.md` section 3 has what it is worth.
"""

from __future__ import annotations

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Image

WIDTH_PX = 320
"""Frames are brought to this width; pixels are theirs."""
COLUMNS = 24
"""Directions in which it looks, spread evenly over the frame."""
SAMPLE_HEIGHT, SAMPLE_WIDTH = 0.14, 0.45
"""The colours are learned from these shares of a frame's height, at its lower edge, and of its width, in the middle: 15
degrees to either side, as far as the sonar's beam."""
BINS = 32
"""Steps of each of lightness, green to red, and blue to yellow (CIELAB)."""
CHROMA_STEP = 3
"""Width of a step of the latter two; of lightness it is 256 / `BINS`."""
LIGHT_BINS = 4
"""A colour of the floor makes those within this many steps of its lightness likely, for shade."""
CHROMA_BINS = 1
"""The same for the other two."""
KEPT_SHARE = 0.97
"""Share that a further frame leaves of what was learned before."""
LEARN_EVERY_S = 0.2
"""At most one frame is kept in this time; so what was learned fades in ten to forty seconds."""
KEPT_S = 20.0
"""A frame is kept for this long."""
RARE_SHARE = 0.004
"""Colours with less than this share of the commonest one's count are not the floor's."""
RUN_PX = 5
"""The floor ends where this many pixels in a column have other colours."""
GRAIN_PX = 5
"""Specks up to this size are ignored."""
FAMILIAR_SHARE = 0.8
"""Where less than this share of the sample has the floor's colours, the exposure may have changed."""
GAIN_RANGE = (0.4, 2.5)
"""Changes of exposure up to these factors are undone."""

Mask = NDArray[np.bool_]


class FreeFloorDetector:
    """Finds where the floor ends, once it has learned what the floor looks like."""

    def __init__(self) -> None:
        self._counts: NDArray[np.float64] | None = None
        self._likely: Mask = np.zeros(BINS**3, bool)
        self._samples: dict[float, Image] = {}
        self._kept_s = -math.inf
        self._light = 0.0

    @property
    def ready(self) -> bool:
        """Whether it has learned what the floor looks like."""
        return self._counts is not None

    def keep(self, image: Image, time_s: float) -> None:
        """Keep the part of a frame, (height, width, 3) BGR, that shows the floor right ahead, for `KEPT_S`.

        Args:
            image: The frame.
            time_s: When it was taken, in seconds on any clock; later than the frames before.
        """
        if time_s - self._kept_s < LEARN_EVERY_S:
            return
        self._kept_s = time_s
        self._samples = {then_s: sample for then_s, sample in self._samples.items() if time_s - then_s <= KEPT_S}
        self._samples[time_s] = _sample(_reduced(image)).copy()

    def learn(self, time_s: float) -> None:
        """Learn from the kept frame of exactly this time, if there is one: the floor right ahead was free in it."""
        sample = self._samples.pop(time_s, None)
        if sample is None:
            return
        bins, light = _bins(sample), _light(sample)
        counts = np.bincount(bins.ravel(), minlength=BINS**3) / bins.size
        if self._counts is not None:
            counts = KEPT_SHARE * self._counts + (1.0 - KEPT_SHARE) * counts
            light = KEPT_SHARE * self._light + (1.0 - KEPT_SHARE) * light
        self._counts, self._light = counts, light
        cube = counts.reshape(BINS, BINS, BINS)
        for axis, reach in enumerate((LIGHT_BINS, CHROMA_BINS, CHROMA_BINS)):
            cube = _spread(cube, axis, reach)
        self._likely = np.asarray(cube > RARE_SHARE * cube.max()).ravel()

    def ends(self, image: Image) -> NDArray[np.float64]:
        """Return the pixels, (n, 2) columns and rows of the frame, at which the floor ends; lowest where it does first.

        The row is 0 where everything up to the upper edge looks like floor. Columns whose lowest pixels are not floor
        are left out.
        """
        scale = image.shape[1] / WIDTH_PX
        small = _reduced(image)
        height, width = small.shape[:2]
        if height < RUN_PX:
            return np.empty((0, 2))
        floor = cv2.medianBlur(self._likely[_bins(self._exposure_matched(small))].astype(np.uint8), GRAIN_PX)
        columns = ((np.arange(COLUMNS) + 0.5) * width / COLUMNS).astype(np.int64)
        upwards = np.cumsum(floor[::-1, columns] == 0, axis=0)
        in_run = upwards.copy()
        in_run[RUN_PX:] -= upwards[:-RUN_PX]
        full = in_run[RUN_PX - 1 :] == RUN_PX
        begins = np.where(full.any(axis=0), full.argmax(axis=0), height)
        known = begins > 0
        ends = np.stack([columns[known] + 0.5, height - begins[known]], axis=1)
        return np.asarray(ends * scale, np.float64)

    def _exposure_matched(self, small: Image) -> Image:
        """Return a frame in the light in which the floor was learned, if more of the sample is then known."""
        known = self._known(small)
        if known >= FAMILIAR_SHARE or not self.ready:
            return small
        gain = min(max(self._light / max(_light(_sample(small)), 1.0), GAIN_RANGE[0]), GAIN_RANGE[1])
        matched = np.asarray(cv2.convertScaleAbs(small, alpha=gain), np.uint8)
        return matched if self._known(matched) > max(known, 0.5) else small

    def _known(self, small: Image) -> float:
        """Return which share of a frame's sample has the floor's colours."""
        return float(self._likely[_bins(_sample(small))].mean())


def _sample(small: Image) -> Image:
    """Return the part of a frame that shows free floor if there is no near echo."""
    height, width = small.shape[:2]
    top, aside = int(height * (1.0 - SAMPLE_HEIGHT)), round(width * (1.0 - SAMPLE_WIDTH) / 2)
    return small[top:, aside : width - aside]


def _light(sample: Image) -> float:
    """Return the brightness of a part of a frame."""
    return float(np.median(cv2.cvtColor(sample, cv2.COLOR_BGR2GRAY)))


def _reduced(image: Image) -> Image:
    """Return a frame of the detector's width."""
    height, width = image.shape[:2]
    if width == WIDTH_PX:
        return image
    size = (WIDTH_PX, max(1, round(height * WIDTH_PX / width)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), np.uint8)


def _bins(image: Image) -> NDArray[np.int64]:
    """Return the number of each pixel's colour, (height, width)."""
    lab = cv2.cvtColor(cv2.GaussianBlur(image, (3, 3), 0), cv2.COLOR_BGR2LAB).astype(np.int64)
    light = lab[..., 0] * BINS // 256
    a, b = (np.clip((lab[..., i] - 128) // CHROMA_STEP + BINS // 2, 0, BINS - 1) for i in (1, 2))
    return np.asarray((light * BINS + a) * BINS + b)


def _spread(cube: NDArray[np.float64], axis: int, reach: int) -> NDArray[np.float64]:
    """Return counts that include those of the neighbours along an axis, up to `reach` steps away."""
    padded = np.pad(cube, [(reach, reach) if each == axis else (0, 0) for each in range(cube.ndim)])
    size = cube.shape[axis]
    return np.asarray(sum(np.take(padded, range(i, i + size), axis) for i in range(2 * reach + 1)), np.float64)
