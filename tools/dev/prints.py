"""Twenty prints that differ: photographs, the built-in drawings, and further drawings, each hard in one way.

Photographs come from scikit-image (of the extra `test`); all are in the public domain or CC0 by its documentation.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np

from sim_backend.bundled import PICTURES
from sim_backend.camera.textures import Image

from .canvas import Canvas, curve, ellipse, polygon, smooth

PHOTOGRAPHS: dict[str, tuple[int, int, int, int]] = {
    "astronaut": (0, 300, 118, 330),
    "chelsea": (0, 300, 60, 400),
    "coffee": (20, 400, 60, 520),
    "camera": (0, 480, 60, 400),
    "coins": (0, 300, 0, 215),
    "moon": (0, 512, 0, 400),
    "hubble_deep_field": (0, 872, 0, 620),
    "retina": (0, 1411, 0, 1411),
}
"""Rows and columns that are printed of each photograph from scikit-image, by name."""

DISTRACTORS = ("brick", "grass", "gravel", "immunohistochemistry", "page", "text", "cell")
"""Photographs that hang in the rooms, but are never the target."""


def photograph(name: str) -> Image:
    """Return one of scikit-image's photographs, BGR."""
    from skimage import data

    image = np.asarray(getattr(data, name)())
    code = cv2.COLOR_RGB2BGR if image.ndim == 3 else cv2.COLOR_GRAY2BGR
    return np.asarray(cv2.cvtColor(image, code), np.uint8)


def draw_cat() -> Image:
    """Draw a black cat in front of a window, few colours."""
    canvas = Canvas((150, 190, 220))
    canvas.fill(polygon((30, 20), (180, 20), (180, 200), (30, 200)), (220, 190, 120))
    canvas.fill(smooth((105, 120), (60, 170), (50, 280), (105, 290), (160, 280), (150, 170)), (40, 36, 34))
    canvas.fill(ellipse(105, 105, 42, 36), (40, 36, 34))
    for side in (-1, 1):
        ear = polygon((105 + side * 10, 75), (105 + side * 42, 45), (105 + side * 40, 95))
        canvas.fill(ear, (40, 36, 34))
        canvas.fill(ellipse(105 + side * 17, 100, 8, 10), (60, 210, 220))
        canvas.fill(ellipse(105 + side * 17, 100, 2.5, 9), (20, 20, 20))
        canvas.stroke(curve((105 + side * 12, 120), (105 + side * 60, 112)), (230, 230, 230), 1.2)
    canvas.fill(ellipse(105, 118, 5, 4), (150, 140, 220))
    canvas.stroke(curve((145, 270), (190, 250), (180, 200), (195, 180)), (40, 36, 34), 11)
    return canvas.picture()


def draw_logo() -> Image:
    """Draw a plain logo: three shapes of strong colour on white."""
    canvas = Canvas((245, 245, 245))
    canvas.fill(ellipse(105, 110, 70, 70), (40, 40, 200))
    canvas.fill(polygon((105, 60), (150, 150), (60, 150)), (245, 245, 245))
    canvas.fill(polygon((30, 215), (180, 215), (180, 245), (30, 245)), (150, 80, 20))
    return canvas.picture()


def draw_book() -> Image:
    """Draw a book's cover: a frame, a title, an emblem."""
    canvas = Canvas((70, 90, 30))
    for inset in (10, 15):
        ring = polygon((inset, inset), (210 - inset, inset), (210 - inset, 297 - inset), (inset, 297 - inset))
        canvas.stroke(np.vstack([ring, ring[:1]]), (110, 200, 230), 1.8)
    picture = canvas.picture()
    for text, y, size in (("THE", 120, 1.2), ("ISLAND", 180, 2.3), ("A NOVEL", 520, 1.1)):
        (width, _), _ = cv2.getTextSize(text, cv2.FONT_HERSHEY_TRIPLEX, size, 4)
        at = ((picture.shape[1] - width) // 2, y)
        cv2.putText(picture, text, at, cv2.FONT_HERSHEY_TRIPLEX, size, (190, 230, 245), 4, cv2.LINE_AA)
    cv2.ellipse(picture, (210, 400), (90, 30), 0, 0, 360, (120, 200, 220), -1, cv2.LINE_AA)
    cv2.rectangle(picture, (204, 270), (216, 400), (60, 110, 160), -1)
    for angle in range(180, 361, 36):
        cv2.ellipse(picture, (210, 270), (70, 22), angle, -20, 20, (90, 190, 110), -1, cv2.LINE_AA)
    return picture


def draw_text() -> Image:
    """Draw a poster with words only."""
    picture = np.full((594, 420, 3), 235, np.uint8)
    words = ("WANTED", "one small", "robot, white,", "answers to", "NXT", "reward:", "5 batteries")
    for row, word in enumerate(words):
        size = 2.6 if row in (0, 4) else 1.5
        cv2.putText(picture, word, (25, 80 + 78 * row), cv2.FONT_HERSHEY_DUPLEX, size, (30, 30, 30), 4, cv2.LINE_AA)
    return picture


def draw_stripes() -> Image:
    """Draw stripes, which look the same along one direction."""
    canvas = Canvas((230, 230, 230))
    for row, color in enumerate(((60, 60, 200), (180, 120, 40), (60, 170, 220), (80, 150, 60), (60, 60, 200))):
        canvas.fill(polygon((0, 60 * row), (210, 60 * row), (210, 60 * row + 34), (0, 60 * row + 34)), color)
    return canvas.picture()


def draw_faint() -> Image:
    """Draw a water-colour of low contrast."""
    canvas = Canvas((215, 222, 226))
    canvas.gradient(polygon((0, 0), (210, 0), (210, 150), (0, 150)), (226, 214, 204), (222, 226, 232))
    canvas.fill(
        smooth((-20, 200), (60, 130), (120, 180), (230, 140), (230, 310), (-20, 310)), (196, 208, 200), soft_mm=4
    )
    canvas.fill(ellipse(150, 70, 26, 26), (204, 220, 236), soft_mm=3)
    canvas.fill(smooth((40, 280), (70, 200), (100, 280)), (184, 196, 190), soft_mm=2)
    return canvas.picture()


def draw_sunset() -> Image:
    """Draw few corners: one disc on a soft sky."""
    canvas = Canvas((60, 60, 120))
    canvas.gradient(polygon((0, 0), (210, 0), (210, 200), (0, 200)), (110, 50, 60), (60, 150, 240))
    canvas.fill(ellipse(105, 170, 45, 45), (120, 220, 250), soft_mm=2)
    canvas.gradient(polygon((0, 200), (210, 200), (210, 297), (0, 297)), (70, 90, 150), (50, 30, 30))
    return canvas.picture()


def draw_map() -> Image:
    """Draw a map: thin lines, fields of similar colours."""
    canvas = Canvas((190, 225, 205))
    canvas.fill(smooth((0, 40), (80, 60), (120, 140), (60, 220), (0, 240)), (225, 190, 140))
    canvas.fill(smooth((130, 180), (190, 170), (200, 260), (140, 270)), (150, 205, 160))
    for points in (
        ((0, 280), (60, 200), (130, 150), (210, 20)),
        ((90, 297), (120, 160), (60, 0)),
        ((0, 20), (210, 240)),
    ):
        canvas.stroke(curve(*points), (70, 110, 220), 3)
        canvas.stroke(curve(*points), (240, 240, 250), 1.2)
    for x, y in ((60, 200), (118, 158), (170, 90), (150, 230)):
        canvas.fill(ellipse(x, y, 6, 6), (40, 40, 170))
    return canvas.picture()


DRAWINGS: dict[str, Callable[[], Image]] = {
    "cat": draw_cat,
    "logo": draw_logo,
    "book": draw_book,
    "text": draw_text,
    "stripes": draw_stripes,
    "faint": draw_faint,
    "sunset": draw_sunset,
    "map": draw_map,
}

BUILT_IN = ("fox", "landscape", "lena", "rilakkuma")


def write_prints(folder: Path) -> dict[str, Path]:
    """Write the twenty prints as files and return them by name, in an order that mixes their kinds."""
    photographs = {
        name: photograph(name)[top:bottom, left:right] for name, (top, bottom, left, right) in PHOTOGRAPHS.items()
    }
    drawings = {name: draw() for name, draw in DRAWINGS.items()}
    files = {name: PICTURES / f"{name}.png" for name in BUILT_IN}
    for name, image in {**photographs, **drawings}.items():
        files[name] = folder / f"{name}.png"
        cv2.imwrite(str(files[name]), image)
    return files


def write_distractors(folder: Path) -> list[str]:
    """Write the photographs that are never the target, as A4 sheets, and return their files."""
    files = []
    for name in DISTRACTORS:
        image = photograph(name)
        height = min(image.shape[0], round(image.shape[1] * 297 / 210))
        file = folder / f"distractor-{name}.png"
        cv2.imwrite(str(file), image[:height, : round(height * 210 / 297)])
        files.append(str(file))
    return files
