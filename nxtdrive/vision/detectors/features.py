"""Find a picture by its features: SIFT keypoints, a homography, and a comparison of the rectified picture.

It finds what correlation misses: a picture turned far in its plane, partly covered, or seen from far to the side. It
needs texture and about 55 pixels of height, and fails in blur and poor light. Measured in docs/ranges.md.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Detection, Image, box_of, quad_of
from nxtdrive.vision.detectors.scaling import at_height, at_most_wide

WORK_WIDTH = 240
"""Keypoints are computed on a copy of the frame at most this wide, at half the cost of 320; smaller pictures are left
to correlation."""

REFERENCE_HEIGHTS = (64, 128, 220)
"""The picture is learnt at these heights in pixels, because keypoints change with size."""

MAX_KEYPOINTS = 400
"""The strongest keypoints of the frame, and of the picture at each height, that are kept."""
RATIO = 0.75
"""A match counts if its distance is below this share of the second best's. Source: Lowe 2004, section 7.1, has 0.8."""
SAME_PLACE = 0.05
"""Keypoints closer than this share of the picture are the same one, learnt at another height; they do not compete."""
NEIGHBOURS = 4
"""Nearest keypoints of the picture among which the second best, at another place, is looked for."""
MIN_INLIERS = 9
"""Matches that must agree on where the picture is."""
REPROJECTION_PX = 2.5
"""A match agrees if it is at most this far off, in pixels of the working copy."""
MIN_HEIGHT_PX = 20
"""Minimum height of either side of the picture in the frame."""
STRAIGHT_HEIGHT = 40
"""Height in pixels at which the rectified picture is compared."""
MIN_COLOR_CORRELATION = 0.4
"""Minimum colour correlation of the rectified picture: low, because a third of it may be covered."""


@dataclass(frozen=True, slots=True)
class Keypoints:
    """Keypoints of a frame: positions (N, 2) in pixels of the working copy and descriptors (N, 128)."""

    points: NDArray[np.float32]
    descriptors: NDArray[np.float32]
    scale: float


def keypoints(image: Image) -> Keypoints:
    """Compute the keypoints of a BGR frame."""
    small, scale = at_most_wide(image, WORK_WIDTH)
    points, descriptors = _sift(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY))
    return Keypoints(points, descriptors, scale)


class FeatureMatcher:
    """Finds one reference picture (BGR) in the keypoints of a frame."""

    def __init__(self, picture: Image) -> None:
        self._ratio = picture.shape[1] / picture.shape[0]
        self._small = at_height(picture, STRAIGHT_HEIGHT)
        found = [_reference(picture, height) for height in REFERENCE_HEIGHTS if height <= 2 * picture.shape[0]]
        self._points = np.concatenate([points for points, _ in found])
        self._descriptors = np.concatenate([descriptors for _, descriptors in found])

    def match(self, image: Image, seen: Keypoints) -> list[Detection]:
        """Find the picture in the BGR `image` with its `keypoints`: at most one detection, with its four corners."""
        frame, reference = self._pairs(seen)
        if len(frame) < MIN_INLIERS:
            return []
        source, target = self._points[reference], seen.points[frame]
        cv2.setRNGSeed(0)
        homography, inliers = cv2.findHomography(source, target, cv2.USAC_MAGSAC, REPROJECTION_PX)
        if homography is None or int(inliers.sum()) < MIN_INLIERS:
            return []
        corners = np.array([[(0, 0), (1, 0), (1, 1), (0, 1)]], np.float32)
        corners = cv2.perspectiveTransform(corners, homography)[0] * seen.scale
        if not _plausible(corners, self._ratio):
            return []
        score = self._resemblance(image, corners)
        if score < MIN_COLOR_CORRELATION:
            return []
        if corners[:2, 1].mean() > corners[2:, 1].mean():  # it hangs upside down
            corners = np.roll(corners, 2, axis=0)
        quad = quad_of(corners)
        return [Detection(box_of(quad), min(1.0, score), quad)]

    def _pairs(self, seen: Keypoints) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the indices in the frame and in the reference of keypoints that match unambiguously.

        A match is unambiguous if it is clearly better than the first one elsewhere on the picture.
        """
        if len(seen.descriptors) == 0 or len(self._descriptors) == 0:
            return np.empty(0, np.intp), np.empty(0, np.intp)
        few = min(NEIGHBOURS, len(self._descriptors))
        distances, columns = cv2.batchDistance(
            seen.descriptors, self._descriptors, cv2.CV_32F, normType=cv2.NORM_L2SQR, K=few
        )
        nearest = columns.astype(np.intp)
        best = nearest[:, 0]
        elsewhere = np.abs(self._points[nearest] - self._points[best][:, None]).max(axis=2) > SAME_PLACE
        rows = np.arange(len(best))
        clear = distances[:, 0] < RATIO**2 * distances[rows, elsewhere.argmax(axis=1)]
        frame = np.flatnonzero(clear | ~elsewhere.any(axis=1))
        return frame, best[frame]

    def _resemblance(self, image: Image, corners: NDArray[np.float32]) -> float:
        """Return the colour correlation of the rectified quad with the picture, -1..1."""
        height, width = self._small.shape[:2]
        straight = np.array([(0, 0), (width, 0), (width, height), (0, height)], np.float32) - 0.5
        transform = cv2.getPerspectiveTransform((corners - 0.5).astype(np.float32), straight.astype(np.float32))
        patch = cv2.warpPerspective(image, transform, (width, height), flags=cv2.INTER_LINEAR)
        return float(cv2.matchTemplate(patch, self._small, cv2.TM_CCOEFF_NORMED)[0, 0])


def _sift(gray: cv2.typing.MatLike) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return positions (origin: the image's corner, not the centre of its first pixel) and descriptors."""
    found, descriptors = cv2.SIFT.create(MAX_KEYPOINTS).detectAndCompute(gray, None)
    if descriptors is None or not found:
        return np.empty((0, 2), np.float32), np.empty((0, 128), np.float32)
    points = np.array([keypoint.pt for keypoint in found], np.float32) + np.float32(0.5)
    return points, descriptors.astype(np.float32)


def _reference(picture: Image, height: int) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return keypoints of the picture at a height; positions are shares 0..1 of its width and height."""
    small = at_height(picture, height)
    points, descriptors = _sift(cv2.cvtColor(small, cv2.COLOR_BGR2GRAY))
    return (points / np.array(small.shape[1::-1])).astype(np.float32), descriptors


def _plausible(corners: NDArray[np.float32], ratio: float) -> bool:
    """Return whether the quad can be the picture, seen from the front or up to about 70 degrees to the side."""
    if not cv2.isContourConvex(corners) or cv2.contourArea(corners, oriented=True) <= 0:
        return False
    top, right, bottom, left = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    if min(left, right) < MIN_HEIGHT_PX or max(left, right) > 2 * min(left, right):
        return False
    return bool(0.3 * ratio < (top + bottom) / (left + right) < 1.4 * ratio and max(top, bottom) < 2 * min(top, bottom))
