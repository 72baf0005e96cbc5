"""Textures of the simulated world: procedural walls, floors, boxes and clothes, and pictures.

Procedural textures are generated from a seed, so that two runs see the same world. None of them resembles the pictures
a robot searches for: no face, no animal, no print.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from input_files.picture import read_picture
from input_files.plain import InputFileError
from sim_backend.bundled import PICTURES, picture_names

Image = NDArray[np.uint8]
Color = tuple[int, int, int]


@dataclass(frozen=True, eq=False)
class Texture:
    """Pixels of a surface, with mipmaps.

    Attributes:
        pixels: (height, width, 3) blue, green, red.
        tile_mm: Width after which the texture repeats; None stretches it over the whole panel. Vertically it always
            stretches over the panel.
    """

    pixels: Image
    tile_mm: float | None = None

    @property
    def width(self) -> int:
        """Width in texels."""
        return int(self.pixels.shape[1])

    @property
    def height(self) -> int:
        """Height in texels."""
        return int(self.pixels.shape[0])

    @cached_property
    def mips(self) -> tuple[Image, ...]:
        """The pixels, and copies of 1/2, 1/4, ... of the size, down to 4 texels."""
        mips = [self.pixels]
        while min(mips[-1].shape[:2]) >= 8:
            height, width = mips[-1].shape[:2]
            mips.append(
                np.asarray(cv2.resize(mips[-1], (width // 2, height // 2), interpolation=cv2.INTER_AREA), np.uint8)
            )
        return tuple(mips)

    def levels(self, texels_per_pixel: NDArray[np.floating[Any]]) -> NDArray[np.intp]:
        """Return indices into `mips` with about one texel per pixel."""
        levels = np.floor(np.log2(np.maximum(texels_per_pixel, 1e-6)) + 0.5)
        return np.asarray(np.clip(levels, 0, len(self.mips) - 1), np.intp)

    def repeats(self, width_mm: float) -> int:
        """Return the number of repetitions across a panel of `width_mm`."""
        return 1 if self.tile_mm is None else max(1, round(width_mm / self.tile_mm))


class TextureLibrary:
    """Textures by name: procedural ones, bundled pictures, and image files by their path.

    Args:
        seed: Seed of the procedural textures.
    """

    def __init__(self, seed: int = 0) -> None:
        self._seed = seed
        self._cache: dict[str, Texture] = {}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all bundled textures."""
        return (*SURFACES, *picture_names())

    def __getitem__(self, name: str) -> Texture:
        """Return the texture called `name`.

        Raises:
            ConfigError: No such texture, or the file cannot be read as an image.
        """
        if name not in self._cache:
            self._cache[name] = self._load(name)
        return self._cache[name]

    def _load(self, name: str) -> Texture:
        if name in SURFACES:
            # a separate random stream for each texture: adding one does not change the others
            rng = np.random.default_rng([self._seed, *name.encode()])
            return SURFACES[name](rng)
        path = Path(name) if Path(name).suffix else PICTURES / f"{name}.png"
        try:
            return Texture(read_picture(path))
        except InputFileError as error:
            if path.is_file():
                raise ConfigError(str(error)) from None
            known = f"Textures are {', '.join(self.names)}, or the path of a PNG or JPEG file."
            raise ConfigError(f"no texture {name!r}: {error}", remedy=known) from None


def _speckle(shape: tuple[int, int], rng: np.random.Generator, coarse: float, fine: float) -> NDArray[np.float64]:
    """Smooth stains plus grain, as a brightness offset that tiles without a seam."""
    height, width = shape
    knots = np.pad(rng.normal(0.0, coarse, (4, 4)), 2, mode="wrap")
    stains = cv2.resize(knots, (2 * width, 2 * height), interpolation=cv2.INTER_CUBIC)
    stains = stains[height // 2 : height // 2 + height, width // 2 : width // 2 + width]
    return np.asarray(stains + rng.normal(0.0, fine, shape), np.float64)


def _plain(color: Color, shape: tuple[int, int], rng: np.random.Generator, coarse: float, fine: float) -> Image:
    """Draw one colour with stains and grain."""
    return _clip(np.array(color, np.float64) + _speckle(shape, rng, coarse, fine)[:, :, None])


def _clip(values: NDArray[np.float64]) -> Image:
    return np.clip(values, 0, 255).astype(np.uint8)


def _wall(rng: np.random.Generator) -> Texture:
    """Draw cream plaster with a skirting board and, every two metres, a socket."""
    pixels = _plain((196, 214, 222), (384, 512), rng, 3.0, 2.5)
    pixels[-26:] = _plain((120, 140, 152), (26, 512), rng, 2.0, 3.0)
    pixels[-28:-26] = (90, 104, 112)
    cv2.rectangle(pixels, (300, 306), (322, 328), (232, 236, 236), -1)
    cv2.rectangle(pixels, (300, 306), (322, 328), (168, 174, 176), 1)
    cv2.circle(pixels, (311, 317), 6, (190, 196, 198), -1)
    return Texture(pixels, tile_mm=2000.0)


def _wallpaper(rng: np.random.Generator) -> Texture:
    """Draw broad stripes in two greens."""
    pixels = _plain((178, 200, 186), (256, 256), rng, 2.0, 3.0)
    pixels[:, 96:160] = _plain((160, 188, 170), (256, 64), rng, 2.0, 3.0)
    pixels[:, 94:96] = pixels[:, 160:162] = (140, 170, 150)
    return Texture(pixels, tile_mm=600.0)


def _bricks(rng: np.random.Generator) -> Texture:
    """Draw red bricks in mortar."""
    pixels = _plain((168, 176, 180), (256, 256), rng, 2.0, 5.0)
    for row, top in enumerate(range(0, 256, 16)):
        for left in range(0, 256, 64):
            start = left + (32 if row % 2 else 0)
            tone = rng.normal(0.0, 9.0)
            brick = _plain((74 + int(tone), 92 + int(tone), 158 + int(1.4 * tone)), (13, 61), rng, 4.0, 6.0)
            pixels[top : top + 13, np.arange(start, start + 61) % 256] = brick
    return Texture(pixels, tile_mm=900.0)


def _planks(rng: np.random.Generator, color: Color, count: int) -> Image:
    """Draw boards side by side with a grain along them, 512 x 512."""
    pixels = np.empty((512, 512, 3), np.uint8)
    width = 512 // count
    for board in range(count):
        left, right = board * width, (board + 1) * width if board < count - 1 else 512
        grain = cv2.resize(
            rng.normal(0.0, 7.0, (24, right - left)), (right - left, 512), interpolation=cv2.INTER_LINEAR
        )
        tone = rng.normal(0.0, 9.0)
        pixels[:, left:right] = _clip(np.array(color, np.float64) + (grain + tone)[:, :, None])
        pixels[:, left : left + 2] = tuple(channel // 2 for channel in color)
        joint = int(rng.integers(0, 512))
        pixels[joint : joint + 2, left:right] = tuple(channel // 2 for channel in color)
    return pixels


def _floor(rng: np.random.Generator) -> Texture:
    """Draw oak floorboards."""
    return Texture(_planks(rng, (104, 144, 176), 8), tile_mm=1200.0)


def _carpet(rng: np.random.Generator) -> Texture:
    """Draw grey-blue carpet."""
    return Texture(_plain((132, 118, 110), (512, 512), rng, 3.0, 12.0), tile_mm=1200.0)


def _wood(rng: np.random.Generator) -> Texture:
    """Draw a furniture front: a few broad boards."""
    return Texture(_planks(rng, (72, 112, 150), 3))


def _cardboard(rng: np.random.Generator) -> Texture:
    """Draw plain cardboard."""
    return Texture(_plain((118, 160, 190), (256, 256), rng, 4.0, 4.0))


def _carton(rng: np.random.Generator) -> Texture:
    """Draw a parcel: cardboard, tape along the middle, a paper label."""
    pixels = _plain((104, 148, 180), (256, 256), rng, 4.0, 4.0)
    pixels[:, 116:140] = _plain((130, 176, 204), (256, 24), rng, 1.0, 2.0)
    cv2.rectangle(pixels, (166, 150), (232, 196), (226, 230, 232), -1)
    for row in range(160, 192, 8):
        cv2.line(pixels, (172, row), (172 + int(rng.integers(20, 54)), row), (110, 110, 112), 2)
    return Texture(pixels)


def _painted(color: Color) -> Callable[[np.random.Generator], Texture]:
    """Draw a painted box with a lighter rim."""

    def draw(rng: np.random.Generator) -> Texture:
        pixels = _plain(color, (256, 256), rng, 4.0, 3.0)
        rim = tuple(min(255, channel + 36) for channel in color)
        cv2.rectangle(pixels, (6, 6), (249, 249), rim, 6)
        return Texture(pixels)

    return draw


def _crate(rng: np.random.Generator) -> Texture:
    """Draw a wooden crate: boards, a frame and a diagonal."""
    pixels = cv2.resize(cv2.rotate(_planks(rng, (92, 136, 172), 6), cv2.ROTATE_90_CLOCKWISE), (256, 256))
    for start, end in (((0, 12), (255, 12)), ((0, 243), (255, 243)), ((12, 0), (12, 255)), ((243, 0), (243, 255))):
        cv2.line(pixels, start, end, (70, 108, 142), 24)
    cv2.line(pixels, (24, 231), (231, 24), (78, 118, 152), 20)
    return Texture(np.asarray(pixels, np.uint8))


def _clothes(shirt: Color, trousers: Color) -> Callable[[np.random.Generator], Texture]:
    """Draw a standing person without a face: from top to bottom hair, shirt, trousers, shoes."""

    def draw(rng: np.random.Generator) -> Texture:
        pixels = np.empty((512, 128, 3), np.uint8)
        bands = ((0, 70, (48, 62, 78)), (70, 260, shirt), (260, 484, trousers), (484, 512, (44, 44, 48)))
        for top, bottom, color in bands:
            pixels[top:bottom] = _plain(color, (bottom - top, 128), rng, 7.0, 4.0)
        cv2.line(pixels, (64, 300), (64, 512), tuple(channel // 2 for channel in trousers), 4)
        return Texture(pixels)

    return draw


SURFACES: dict[str, Callable[[np.random.Generator], Texture]] = {
    "wall": _wall,
    "wallpaper": _wallpaper,
    "bricks": _bricks,
    "floor": _floor,
    "carpet": _carpet,
    "wood": _wood,
    "cardboard": _cardboard,
    "carton": _carton,
    "crate": _crate,
    "red_box": _painted((62, 58, 172)),
    "blue_box": _painted((160, 104, 52)),
    "green_box": _painted((84, 140, 76)),
    "yellow_box": _painted((70, 186, 214)),
    "person_blue": _clothes((150, 96, 60), (92, 70, 58)),
    "person_green": _clothes((92, 128, 78), (70, 84, 104)),
}
"""Generator of each procedural texture."""
