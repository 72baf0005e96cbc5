"""The marker sheet: its contents, how it is printed, and where it is found in a frame."""

from __future__ import annotations

import io
import math
from dataclasses import dataclass
from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image as Pictures
from PIL import ImageDraw

from firmware_protocol.errors import ConfigError
from nxtdrive.drawing.fonts import BUNDLED, font
from nxtdrive.vision.detection import Image

SHEET_MM = (297.0, 210.0)
"""A4 across. Source: ISO 216."""
MARKER_MM, PITCH_MM = 80.0, 95.0
COLUMNS, ROWS = 3, 2
FIRST_ID = 40
"""The last ids of the dictionary; missions rarely use those."""
RULE_MM = 100.0
"""A line of this length shows whether the sheet was printed at its true size."""
COARSE_PX = 500
"""In frames narrower than this, far markers are too small to be found as they are."""
ENLARGEMENT, MARGIN_PX = 3, 12
"""The part of a frame with markers, with a margin, is enlarged and searched again: there, fits of the edges find the
corners of small markers to a tenth of a pixel."""
LARGEST_PX = 1920
"""Longest side of what is searched: larger frames are reduced, and large parts enlarged less. The search takes time in
proportion to the area, and the robot moves on meanwhile."""
DPI = 254
"""Ten pixels a millimetre, so that markers have their exact size."""
MM_PER_INCH = 25.4

Points = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Seen:
    """Corners of markers in one frame.

    Attributes:
        on_sheet_mm: Of each corner, right and down from the middle of the sheet, (n, 2).
        in_frame_px: Of each, right and down from the frame's upper left corner, (n, 2).
    """

    on_sheet_mm: Points
    in_frame_px: Points

    @property
    def markers(self) -> int:
        """Number of markers seen."""
        return len(self.on_sheet_mm) // 4


NOTHING = Seen(np.empty((0, 2)), np.empty((0, 2)))


def marker_centres() -> dict[int, tuple[float, float]]:
    """Return where the middle of each marker is, right and down from the middle of the sheet, by its id."""
    return {
        FIRST_ID + row * COLUMNS + column: (
            (column - (COLUMNS - 1) / 2) * PITCH_MM,
            (row - (ROWS - 1) / 2) * PITCH_MM,
        )
        for row in range(ROWS)
        for column in range(COLUMNS)
    }


def find_sheet(image: Image) -> Seen:
    """Find the sheet's markers in a frame, BGR."""
    grey = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
    if (reduction := math.ceil(max(grey.shape) / LARGEST_PX)) > 1:
        grey = np.asarray(
            cv2.resize(grey, None, fx=1 / reduction, fy=1 / reduction, interpolation=cv2.INTER_AREA), np.uint8
        )
    height, width = grey.shape
    finer = 2 if width < COARSE_PX else 1
    rough, ids, _ = _detector(cv2.aruco.CORNER_REFINE_NONE).detectMarkers(_larger(grey, finer))
    if ids is None:
        return NOTHING
    (left, top), (right, bottom) = (each(np.concatenate(rough), axis=(0, 1)) / finer for each in (np.min, np.max))
    x0, y0 = max(0, int(left) - MARGIN_PX), max(0, int(top) - MARGIN_PX)
    part = grey[y0 : min(height, int(bottom) + MARGIN_PX), x0 : min(width, int(right) + MARGIN_PX)]
    enlargement = max(1, min(ENLARGEMENT, LARGEST_PX // max(part.shape)))
    corners, ids, _ = _detector(cv2.aruco.CORNER_REFINE_APRILTAG).detectMarkers(_larger(part, enlargement))
    on_sheet, in_frame, centres = [], [], marker_centres()
    half = MARKER_MM / 2
    for quad, number in zip(corners, () if ids is None else ids.ravel(), strict=True):
        centre = centres.get(int(number))
        if centre is None:
            continue
        x, y = centre
        on_sheet += [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
        # this refinement counts from the corner of the first pixel
        in_frame += [(float(u) / enlargement + x0, float(v) / enlargement + y0) for u, v in quad[0]]
    return Seen(np.array(on_sheet).reshape(-1, 2), np.array(in_frame).reshape(-1, 2) * reduction)


def draw_sheet() -> Pictures.Image:
    """Return the picture of the sheet, grey."""
    per_mm = DPI / MM_PER_INCH
    width, height = (round(each * per_mm) for each in SHEET_MM)
    sheet = Pictures.new("L", (width, height), 255)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    size = round(MARKER_MM * per_mm)
    for number, (x, y) in marker_centres().items():
        marker = Pictures.fromarray(cv2.aruco.generateImageMarker(dictionary, number, size))
        sheet.paste(marker, (round(width / 2 + x * per_mm - size / 2), round(height / 2 + y * per_mm - size / 2)))
    _caption(ImageDraw.Draw(sheet), per_mm)
    return sheet


def sheet_bytes(suffix: str) -> bytes:
    """Return the file of the sheet, which prints at its true size.

    Args:
        suffix: ``.pdf`` or ``.png``.

    Raises:
        ConfigError: It is another one.
    """
    kind = {".pdf": "PDF", ".png": "PNG"}.get(suffix.lower())
    if kind is None:
        raise ConfigError(
            f"the sheet cannot be written as {suffix or 'a file without a suffix'}.", remedy="Use .pdf or .png."
        )
    file = io.BytesIO()
    draw_sheet().save(file, kind, dpi=(DPI, DPI))
    return file.getvalue()


def _caption(draw: ImageDraw.ImageDraw, per_mm: float) -> None:
    """Draw the line of known length and what to do with the sheet below the markers."""
    left, top = (SHEET_MM[0] / 2 - PITCH_MM - MARKER_MM / 2) * per_mm, (SHEET_MM[1] - 11) * per_mm
    right, tick = left + RULE_MM * per_mm, 2 * per_mm
    line = max(1, round(0.3 * per_mm))
    draw.line([(left, top), (right, top)], 0, line)
    for x in (left, right):
        draw.line([(x, top - tick), (x, top + tick)], 0, line)
    words = f"This line is {RULE_MM:g} mm long: print at 100 %. Hang it flat on a wall, its middle as high as the lens."
    draw.text((right + 4 * per_mm, top), words, 0, font(BUNDLED, round(3.2 * per_mm)), anchor="lm")


def _larger(grey: NDArray[np.uint8], times: int) -> NDArray[np.uint8]:
    return np.asarray(cv2.resize(grey, None, fx=times, fy=times, interpolation=cv2.INTER_CUBIC), np.uint8)


@cache
def _detector(refinement: int) -> cv2.aruco.ArucoDetector:
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    return cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), parameters)
