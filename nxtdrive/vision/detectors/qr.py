"""Finds a printed QR code by the text in it: a sheet that says what it is, printed with any QR generator."""

from __future__ import annotations

import cv2
import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image, Quad, box_of, quad_of
from nxtdrive.vision.detectors.spec import DetectorSpec

READ_WIDTH, MOST_ZOOM = 640, 2.0
"""Narrower frames are enlarged towards this width: OpenCV then reads a code from a fifth farther away."""

LONGEST = 500
"""Characters; a code of a longer text has modules too small for a camera across the room."""


class QrDetector:
    """Finds one QR code. It decodes the text, so the score is always 1.

    Args:
        text: The whole text of the code.

    Raises:
        ConfigError: The text is empty or too long.
    """

    def __init__(self, text: str) -> None:
        if not 1 <= len(text) <= LONGEST:
            raise ConfigError(
                f"a QR target needs a text of 1 to {LONGEST} characters, not of {len(text)}.",
                remedy="Give the text that the code contains; a short one is read from farther away.",
            )
        self._text = text
        # Only the first reads codes of very different sizes in one frame; the second reads from farther away.
        self._readers = (cv2.QRCodeDetectorAruco(), 1.0), (cv2.QRCodeDetector(), MOST_ZOOM)

    def detect(self, image: Image) -> list[Detection]:
        """Return every copy of the code in the frame, the largest first."""
        gray = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
        for reader, most_zoom in self._readers:
            zoom = min(most_zoom, max(1.0, READ_WIDTH / image.shape[1]))
            large = gray if zoom == 1 else cv2.resize(gray, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC)
            read, texts, corners, _ = reader.detectAndDecodeMulti(large)
            codes = zip(texts, corners, strict=True) if read else ()
            quads = [_quad((one + 0.5) / zoom) for text, one in codes if text == self._text]
            if quads:
                found = [Detection(box_of(quad), 1.0, quad) for quad in quads]
                return sorted(found, key=lambda detection: -detection.box[3])
        return []


def from_spec(spec: DetectorSpec) -> QrDetector:
    """Make the detector from ``text``."""
    return QrDetector(spec.take("text", str))


def _quad(corners: cv2.typing.MatLike) -> Quad:
    """Return the corners with the one first that is at the top left in the frame: a sheet may hang turned."""
    start = int(np.argmin(corners.sum(axis=1)))
    return quad_of(np.roll(corners, -start, axis=0))
