"""Draw detections and the sighting on a copy of the frame, for recordings and for ``detect try``."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from PIL import Image as Drawing
from PIL import ImageDraw

from behaviors.ports import Sighting
from nxtdrive.drawing.fonts import parts, width_px
from nxtdrive.vision.detection import Detection, Image

CONFIRMED = (60, 220, 60)
UNCONFIRMED = (0, 190, 255)
TEXT = (255, 255, 255)
SHADE = (0, 0, 0)
TEXT_PX, RIM_PX, LINE_PX = 13, 1, 2
SHOWN_PX = 1000
"""Longer side of the largest image with these sizes: larger ones are looked at smaller, so theirs are multiples."""


def annotate(image: Image, sighting: Sighting | None, detections: Sequence[Detection] = (), state: str = "") -> Image:
    """Return a copy of the BGR `image` with the detections drawn into it.

    Args:
        image: Not modified.
        sighting: Drawn in green with name, bearing (R right, L left) and distance.
        detections: All but the sighting are drawn in orange with their scores.
        state: Written along the lower edge.
    """
    drawn = image.copy()
    for detection in detections:
        if sighting is None or detection.box != sighting.box:
            _outline(drawn, detection, UNCONFIRMED)
            _write(drawn, f"{detection.score:.2f}", detection.box[0], detection.box[1] - 4)
    if sighting is not None:
        confirmed = next((one for one in detections if one.box == sighting.box), Detection(sighting.box, 1.0))
        _outline(drawn, confirmed, CONFIRMED)
        _write(drawn, caption(sighting), sighting.box[0], sighting.box[1] - 4)
    if state:
        _write(drawn, state, 4, drawn.shape[0] - 5)
    return drawn


def caption(sighting: Sighting) -> str:
    """Format a sighting, e.g. ``lena R 12° 1.43 m``, or ``≤ 0.4 m`` where its size is not in view."""
    side = "R" if sighting.bearing_deg >= 0 else "L"
    at_most = "≤ " if sighting.bound else ""
    return f"{sighting.target} {side} {abs(sighting.bearing_deg):.0f}° {at_most}{sighting.distance_mm / 1000:.2f} m"


def _outline(image: Image, detection: Detection, color: tuple[int, int, int]) -> None:
    left, top, width, height = detection.box
    corners = detection.quad or ((left, top), (left + width, top), (left + width, top + height), (left, top + height))
    whole = np.rint(np.array(corners)).astype(np.int32)
    cv2.polylines(image, [whole], True, color, LINE_PX * _magnification(image), cv2.LINE_AA)


def _write(image: Image, text: str, x: int, y: int) -> None:
    """Write white text with a black outline from (x, y), the left end of its base line; kept inside the image."""
    height, width = image.shape[:2]
    text_px, rim_px = (size * _magnification(image) for size in (TEXT_PX, RIM_PX))
    left = max(min(float(x), width - width_px(text, text_px) - 2), 2.0)
    base = min(max(y, text_px + rim_px), height - 2)
    top, bottom = max(base - text_px - rim_px, 0), min(base + text_px // 2, height)
    band = Drawing.fromarray(np.ascontiguousarray(image[top:bottom]))
    draw = ImageDraw.Draw(band)
    for part, font in parts(text, text_px):
        draw.text((left, base - top), part, TEXT, font, anchor="ls", stroke_width=rim_px, stroke_fill=SHADE)
        left += font.getlength(part)
    image[top:bottom] = np.asarray(band)


def _magnification(image: Image) -> int:
    longer_px: int = max(image.shape[:2])
    return max(1, round(longer_px / SHOWN_PX))
