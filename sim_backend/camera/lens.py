"""Webcam imperfections: exposure, softness, motion blur, noise, compression.

These effects decide whether a detector still finds its target (`docs/ranges.md` section 1.4). Lens distortion and
rolling shutter are in `sim_backend.camera.optics`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from sim_backend.camera.textures import Image

_NOISE_MARGIN = 64
FOG_BLUR_PX, FOG_SHARE, FOG_LEVEL = 12.0, 0.7, 170.0
"""A fogged lens: standard deviation of its blur, and the share of each pixel that is fog, of this brightness. A
guess."""
MAX_SMEAR_DEG = 80.0
"""Largest turn during an exposure: near 90 degrees the image plane has no place for what was in its middle."""


@dataclass(frozen=True, slots=True)
class LensEffects:
    """Strength of the webcam's imperfections.

    Attributes:
        softness_px: Standard deviation of the lens blur in pixels.
        noise: Standard deviation of the sensor noise in brightness levels of 255.
        shutter_s: Shutter time; a turning camera smears the frame by the turn rate times this.
        jpeg_quality: 1..100; None leaves the frame uncompressed.
    """

    softness_px: float = 0.6
    noise: float = 4.0
    shutter_s: float = 0.02
    jpeg_quality: int | None = None


PERFECT = LensEffects(softness_px=0.0, noise=0.0, shutter_s=0.0)
"""No effects: the rendered frame unchanged."""


class Lens:
    """Applies the effects to successive frames; the same seed and frames give the same output.

    Args:
        effects: Strength of the effects.
        size: Width and height of the frames.
        focal_px: Focal length in pixels; converts degrees of motion to pixels of motion blur.
        seed: Seed of the sensor noise.
    """

    def __init__(self, effects: LensEffects, size: tuple[int, int], focal_px: float, seed: int = 0) -> None:
        self._effects = effects
        self._size = size
        self._focal_px = focal_px
        self._rng = np.random.default_rng(seed)
        self._brighter, self._darker = self._noise_bank()

    def expose(self, image: Image, turn_rate_deg_s: float = 0.0, brightness: float = 1.0) -> Image:
        """Return the frame as the webcam delivers it.

        Args:
            image: The rendered frame, (height, width, 3), left unchanged.
            turn_rate_deg_s: Turn rate during the exposure.
            brightness: Factor on the brightness of this frame; 1.0 keeps the scene's colours.
        """
        frame = self._blur(image, turn_rate_deg_s)
        if brightness != 1.0:
            frame = np.asarray(cv2.convertScaleAbs(frame, alpha=brightness), np.uint8)
        if self._effects.noise:
            frame = self._add_noise(frame)
        if self._effects.jpeg_quality is not None:
            frame = _compress(frame, self._effects.jpeg_quality)
        return frame

    def _blur(self, image: Image, turn_rate_deg_s: float) -> Image:
        blur = motion_blur_px(self._focal_px, turn_rate_deg_s, self._effects.shutter_s)
        frame = image
        if blur > 0.5:
            frame = np.asarray(
                cv2.filter2D(frame, -1, motion_blur_kernel(blur), borderType=cv2.BORDER_REPLICATE), np.uint8
            )
        if self._effects.softness_px:
            frame = np.asarray(cv2.GaussianBlur(frame, (5, 5), self._effects.softness_px), np.uint8)
        return frame

    def _noise_bank(self) -> tuple[Image, Image]:
        """Return noise larger than a frame, its positive and negative parts: two fast saturating sums apply it."""
        width, height = self._size
        shape = (height + _NOISE_MARGIN, width + _NOISE_MARGIN, 3)
        noise = np.rint(self._rng.normal(0.0, self._effects.noise, shape))
        return np.maximum(noise, 0).astype(np.uint8), np.maximum(-noise, 0).astype(np.uint8)

    def _add_noise(self, frame: Image) -> Image:
        """Add a random window of the noise bank."""
        width, height = self._size
        left, top = (int(offset) for offset in self._rng.integers(0, _NOISE_MARGIN, 2))
        window = (slice(top, top + height), slice(left, left + width))
        return np.asarray(cv2.subtract(cv2.add(frame, self._brighter[window]), self._darker[window]), np.uint8)


def fogged(image: Image) -> Image:
    """Return a frame as a fogged lens shows it."""
    blurred = cv2.GaussianBlur(image, (0, 0), FOG_BLUR_PX)
    return np.asarray(cv2.convertScaleAbs(blurred, alpha=1.0 - FOG_SHARE, beta=FOG_SHARE * FOG_LEVEL), np.uint8)


def motion_blur_px(focal_px: float, turn_rate_deg_s: float, shutter_s: float) -> float:
    """Return the length of the motion blur at the centre of a frame."""
    return focal_px * math.tan(math.radians(min(MAX_SMEAR_DEG, abs(turn_rate_deg_s) * shutter_s)))


def motion_blur_kernel(length_px: float) -> NDArray[np.float32]:
    """Return a horizontal box kernel of `length_px`; its ends are weighted by their coverage of the pixel."""
    reach = math.ceil((length_px - 1.0) / 2.0)
    kernel = np.ones((1, 2 * reach + 1), np.float32)
    kernel[0, 0] = kernel[0, -1] = (length_px - (2 * reach - 1)) / 2.0
    return np.asarray(kernel / kernel.sum(), np.float32)


def _compress(frame: Image, quality: int) -> Image:
    """Return the frame after JPEG compression and decompression."""
    _, coded = cv2.imencode(".jpg", frame, [cv2.IMWRITE_JPEG_QUALITY, quality])
    return np.asarray(cv2.imdecode(coded, cv2.IMREAD_COLOR), np.uint8)
