"""What a first mission looks for: a red box, a photographed thing, or a sheet to print with a marker or a QR code."""

from __future__ import annotations

import io
import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.mission.robot import FRAME_ASPECT
from nxtdrive.mission.checking import RIM

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

LENS_HEIGHT_MM = 200.0
USUAL_STOP_MM = 420.0
FARTHEST_STOP_MM = 2000.0
"""Largest ``arrive_mm`` of a mission."""
HALF_VIEW = math.tan(math.radians(30.0))
"""Half the width of a frame, as a share of the distance; at 60 degrees of view."""
HALF_VIEW_UP = FRAME_ASPECT * HALF_VIEW

MARKER_MODULES, MARKER_MARGIN = 6, 1
"""Squares along an edge of a 4x4 marker with its black border, and of the white that it needs around it."""
QR_MARGIN = 3
"""White modules around a code; the paper that it is printed on adds more. Source: four in all by ISO/IEC 18004."""
ENCODER_MARGIN = 2
"""White modules that OpenCV's encoder adds."""
QR_RANGE = 5.0
"""Heights from which a code of a short text is read in frames of 320x240. Source: docs/ranges.md."""
LONGEST_NAME = 30
"""Characters of a code's text that name its target and its files."""
MODULE_PX = 40
MM_PER_INCH = 25.4


@dataclass(frozen=True, slots=True)
class TemplateTarget:
    """The target of a first mission.

    Attributes:
        name: In mission and world.
        height_mm: Its real height.
        width_mm: Its real width.
        options: Its detector with its options, as in a mission file; without picture and height.
        picture: The image file that hangs in its room; None for the red box.
        sheet: Content of that file if it is ours to write.
        margin_mm: White around the target in the picture.
        range_heights: How far away its detector finds it for certain, in heights.
    """

    name: str
    height_mm: float
    width_mm: float
    options: Mapping[str, object] = field(default_factory=lambda: {"detector": "color", "color": "red"})
    picture: Path | None = None
    sheet: bytes | None = None
    margin_mm: float = 0.0
    range_heights: float = 7.0

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the picture."""
        return self.width_mm + 2 * self.margin_mm, self.height_mm + 2 * self.margin_mm

    @property
    def centre_mm(self) -> float:
        """Height of its middle above the floor: a picture is level with the camera, if it is not too high for that."""
        half_mm = self.size_mm[1] / 2
        return half_mm if self.picture is None else max(LENS_HEIGHT_MM, half_mm)

    @property
    def top_mm(self) -> float:
        """Upper edge above the floor."""
        return self.centre_mm + self.size_mm[1] / 2

    @property
    def whole_mm(self) -> float:
        """Smallest distance from which the whole target is in view."""
        width_mm, height_mm = self.size_mm
        wide_mm = width_mm / 2 / HALF_VIEW
        high_mm = max(self.top_mm - LENS_HEIGHT_MM, min(LENS_HEIGHT_MM, height_mm / 2)) / HALF_VIEW_UP
        return 10 * math.ceil(RIM * max(wide_mm, high_mm) / 10)

    @property
    def stop_mm(self) -> float:
        """Distance at which the robot has arrived: as usual, or so far away that the whole target is in view."""
        return max(USUAL_STOP_MM, self.whole_mm)

    @property
    def distance_mm(self) -> float:
        """Distance of the target from the lens at the start, well within a detector's range."""
        return max(self.stop_mm + 300.0, min(1800.0, self.range_heights * self.height_mm))


RED_BOX = TemplateTarget("box", height_mm=100.0, width_mm=200.0)
"""What a new mission looks for when nothing else is named."""


def marker_target(number: int, height_mm: float, folder: Path) -> TemplateTarget:
    """Return a target that is an ArUco marker of the dictionary 4x4_50, with the sheet to print.

    Args:
        number: 0 to 49.
        height_mm: Of the marker with its black border.
        folder: Where its sheet will lie.
    """
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    modules = cv2.aruco.generateImageMarker(dictionary, number, MARKER_MODULES)
    options = {"detector": "marker", "id": number}
    return _printed(f"marker-{number}", modules, MARKER_MARGIN, height_mm, options, folder)


def qr_target(text: str, height_mm: float, folder: Path) -> TemplateTarget:
    """Return a target that is a QR code, with the sheet to print.

    Args:
        text: 1 to 500 characters.
        height_mm: Of the code, without the white around it.
        folder: Where its sheet will lie.
    """
    import cv2

    inner = slice(ENCODER_MARGIN, -ENCODER_MARGIN)
    modules = cv2.QRCodeEncoder.create().encode(text)[inner, inner]
    name, options = plain_name(text, "code"), {"detector": "qr", "text": text}
    if len(name) > LONGEST_NAME:  # both ends, as texts of several sheets often differ in the last word only
        name = f"{name[: LONGEST_NAME // 2].strip('-')}-{name[-LONGEST_NAME // 2 :].strip('-')}"
    return replace(_printed(f"qr-{name}", modules, QR_MARGIN, height_mm, options, folder), range_heights=QR_RANGE)


def plain_name(text: str, otherwise: str) -> str:
    """Return a text as a target's name, without accents and with dashes for spaces; `otherwise` if nothing is left."""
    letters = unicodedata.normalize("NFKD", text.replace("ß", "ss"))
    plain = "".join(letter for letter in letters if not unicodedata.combining(letter))
    return re.sub(r"[^A-Za-z0-9_-]+", "-", plain).strip("-") or otherwise


def _printed(
    name: str,
    modules: npt.ArrayLike,
    margin: int,
    height_mm: float,
    options: Mapping[str, object],
    folder: Path,
) -> TemplateTarget:
    """Return a target of black and white modules on a sheet that prints at its true size."""
    import numpy as np

    squares = np.asarray(modules, np.uint8)
    module_mm = height_mm / len(squares)
    enlarged = np.kron(np.pad(squares, margin, constant_values=255), np.ones((MODULE_PX, MODULE_PX), np.uint8))
    sheet = np.asarray(enlarged, np.uint8)
    data = _png(sheet, MODULE_PX / module_mm * MM_PER_INCH)
    picture = folder / f"{name}.png"
    return TemplateTarget(name, height_mm, height_mm, options, picture, data, margin * module_mm)


def _png(image: npt.NDArray[np.uint8], dpi: float) -> bytes:
    from PIL import Image

    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG", dpi=(dpi, dpi))
    return file.getvalue()
