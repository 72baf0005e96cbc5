"""Find a printed ArUco or AprilTag marker: the most reliable target, e.g. for classrooms."""

from __future__ import annotations

import cv2
import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image, Quad, box_of, upright_quad_of
from nxtdrive.vision.detectors.spec import DetectorSpec

DEFAULT_FAMILY = "aruco_4x4_50"

FAMILIES = {
    "aruco_4x4_50": (cv2.aruco.DICT_4X4_50, 50),
    "apriltag_36h11": (cv2.aruco.DICT_APRILTAG_36H11, 587),
}
"""OpenCV's dictionary of each family and its number of markers."""


class MarkerDetector:
    """Finds one marker of a family. It decodes the number, so the score is always 1.

    Args:
        number: Number of the marker.
        family: ``aruco_4x4_50`` or ``apriltag_36h11``.

    Raises:
        ConfigError: There is no such family or number.
    """

    def __init__(self, number: int, family: str = DEFAULT_FAMILY) -> None:
        if family not in FAMILIES:
            raise ConfigError(f"there is no marker family {family!r}.", remedy=f"Use one of: {', '.join(FAMILIES)}.")
        dictionary, count = FAMILIES[family]
        if not 0 <= number < count:
            raise ConfigError(f"{family} has no marker {number}.", remedy=f"Its numbers are 0 to {count - 1}.")
        parameters = cv2.aruco.DetectorParameters()
        parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
        self._number = number
        self._detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(dictionary), parameters)

    def detect(self, image: Image) -> list[Detection]:
        """Return every copy of the marker in the frame, the largest first."""
        found = [Detection(box_of(quad), 1.0, quad) for number, quad in self.markers(image) if number == self._number]
        return sorted(found, key=lambda detection: -detection.box[3])

    def markers(self, image: Image) -> list[tuple[int, Quad]]:
        """Return the number and the corners of every marker of the family."""
        corners, ids, _ = self._detector.detectMarkers(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY))
        if ids is None:
            return []
        return [(int(number), _quad(found[0])) for found, number in zip(corners, ids.ravel(), strict=True)]


def from_spec(spec: DetectorSpec) -> MarkerDetector:
    """Make the detector from ``id`` and ``family``."""
    return MarkerDetector(spec.take("id", int), spec.take("family", str, DEFAULT_FAMILY))


def _quad(corners: cv2.typing.MatLike) -> Quad:
    """Convert OpenCV's corners, whose origin is the centre of the first pixel, to the image's corner as origin."""
    return upright_quad_of(np.asarray(corners, np.float64) + 0.5)
