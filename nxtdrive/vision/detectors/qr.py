"""Find a printed QR code by the text in it: a sheet that says what it is, printed with any QR generator."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from input_files.plain import is_utf_8
from nxtdrive.vision.detection import Detection, Image, box_of, upright_quad_of
from nxtdrive.vision.detectors.spec import DetectorSpec

Gray = NDArray[np.uint8]
Corners = NDArray[np.float32]
"""Of a code in the frame, four in its own order, (4, 2)."""

SEARCH_WIDTH, MAX_ZOOM = 640, 2.0
"""Narrower frames are enlarged towards this width for the search: codes are then found from a tenth farther away."""

SIDE_PX = 300
"""Size to which a code that was found is enlarged to be read."""

SMALLEST_PX = 10
"""Width and height in the frame below which no code can be read: half a pixel a module."""

WHITE = 0.25
"""White around the code that is read with it, as a share of its size."""

SHARP, SHARPER = 1.5, 3.0
"""How much of the difference from the blurred picture is added before a code is read. Found by trying, as was the order
of the trials: together they read all of 198 codes of 2 to 3.5 pixels a module, the first alone 145."""

LONGEST = 500
"""Characters; a code of a longer text has modules too small for a camera across the room."""


class QrDetector:
    """Finds one QR code. It decodes the text, so the score is always 1.

    Args:
        text: The whole text of the code.

    Raises:
        ConfigError: The text is empty, too long or not UTF-8.
    """

    def __init__(self, text: str) -> None:
        if not is_utf_8(text):
            raise ConfigError(f"a QR target's text is not UTF-8: {text!r}.", remedy="Give the text of the code.")
        if not 1 <= len(text) <= LONGEST:
            raise ConfigError(
                f"a QR target needs a text of 1 to {LONGEST} characters, not of {len(text)}.",
                remedy="Give the text that the code contains; a short one is read from farther away.",
            )
        self._text = text
        # the first finds codes of different sizes in one frame; each reads some that the other cannot
        self._finder, other = cv2.QRCodeDetectorAruco(), cv2.QRCodeDetector()
        self._trials = (
            (_upright, SHARP, self._finder),
            (_upright, SHARPER, self._finder),
            (_enlarged, SHARP, other),
            (_upright, SHARP, other),
            (_enlarged, SHARP, self._finder),
        )

    def detect(self, image: Image) -> list[Detection]:
        """Return every copy of the code in the frame, the largest first."""
        quads = [upright_quad_of(corners) for text, corners in self.codes(image) if text == self._text]
        return sorted((Detection(box_of(quad), 1.0, quad) for quad in quads), key=lambda each: -each.box[3])

    def codes(self, image: Image) -> list[tuple[str, Corners]]:
        """Return the text and the corners of every code that can be read, dark on light or light on dark."""
        gray = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), np.uint8)
        return [*self._dark_codes(gray), *self._dark_codes(np.asarray(255 - gray, np.uint8))]

    def _dark_codes(self, gray: Gray) -> Iterator[tuple[str, Corners]]:
        zoom = min(MAX_ZOOM, max(1.0, SEARCH_WIDTH / gray.shape[1]))
        large = gray if zoom == 1 else cv2.resize(gray, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
        found, quads = self._finder.detectMulti(large)
        for corners in [(np.asarray(quad, np.float32) + 0.5) / zoom for quad in quads] if found else []:
            if np.ptp(corners, axis=0).min() >= SMALLEST_PX and (text := self._read(gray, corners)):
                yield text, corners

    def _read(self, gray: Gray, corners: Corners) -> str:
        """Return the text of the code with these corners, empty if it cannot be read."""
        for enlarge, amount, reader in self._trials:
            with suppress(cv2.error):  # raised for modes that it does not support, such as that for hanzi
                _, codes, _, _ = reader.detectAndDecodeBytesMulti(_sharpened(*enlarge(gray, corners), amount))
                texts = [text_of(code) for code in codes]
                if any(texts):
                    return self._text if self._text in texts else next(filter(None, texts))
        return ""


def text_of(code: bytes) -> str:
    """Return the text of a code's bytes as OpenCV returns them: UTF-8, or Shift JIS if it is in the mode for kanji.

    Generators use that mode for Japanese, some also for Chinese and Cyrillic. Other bytes get replaced.
    """
    for encoding in ("utf-8", "shift_jis"):
        with suppress(UnicodeDecodeError):
            return code.decode(encoding)
    return code.decode("utf-8", "replace")


def from_spec(spec: DetectorSpec) -> QrDetector:
    """Make the detector from ``text``."""
    return QrDetector(spec.take("text", str))


def _upright(gray: Gray, corners: Corners) -> tuple[Gray, float]:
    """Return the code as it is seen from the front, with white around it, and how much larger it is."""
    low, high = SIDE_PX * WHITE / (1 + 2 * WHITE), SIDE_PX * (1 + WHITE) / (1 + 2 * WHITE)
    there = np.array([[low, low], [high, low], [high, high], [low, high]], np.float32)
    view = cv2.getPerspectiveTransform(corners, there)
    upright = cv2.warpPerspective(
        gray, view, (SIDE_PX, SIDE_PX), flags=cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE
    )
    return np.asarray(upright, np.uint8), float((high - low) / np.ptp(corners, axis=0).max())


def _enlarged(gray: Gray, corners: Corners) -> tuple[Gray, float]:
    """Return the part of the frame with the code and white around it, and how much larger it is."""
    white = WHITE * np.ptp(corners, axis=0).max() + 2
    left, top = np.maximum(corners.min(axis=0) - white, 0).astype(int)
    right, bottom = (corners.max(axis=0) + white).astype(int) + 1
    part = gray[top:bottom, left:right]
    zoom = SIDE_PX / max(part.shape)
    return np.asarray(cv2.resize(part, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_LANCZOS4), np.uint8), zoom


def _sharpened(gray: Gray, zoom: float, amount: float) -> Gray:
    """Return a picture with sharper edges; `zoom` of its pixels were one in the frame."""
    values = gray.astype(np.float32)
    return np.clip(values + amount * (values - cv2.GaussianBlur(values, (0, 0), zoom)), 0, 255).astype(np.uint8)
