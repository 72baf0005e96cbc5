"""Pictures, scenes and a clock for the tests of vision."""

import math
from dataclasses import dataclass, field

import cv2
import numpy as np
import pytest
from skimage import data

A4_MM = 297.0
HFOV_DEG = 60.0


class ManualClock:
    """A clock that advances only while a thread sleeps."""

    def __init__(self):
        self.time_s = 0.0

    def now(self):
        return self.time_s

    def sleep(self, duration_s):
        self.time_s += duration_s


@dataclass
class Scene:
    """A wall with an A4 print on it, as a level camera sees it; the print's middle is on the optical axis's height."""

    picture: np.ndarray
    background: np.ndarray
    rng: np.random.Generator = field(default_factory=lambda: np.random.default_rng(5))
    noise: float = 4.0

    def corners(self, distance_mm, bearing_deg=0.0, slant_deg=0.0, roll_deg=0.0):
        """Where the print's corners appear, in pixels from the corner of the frame."""
        height, width = self.background.shape[:2]
        focal = width / 2 / math.tan(math.radians(HFOV_DEG / 2))
        half_h, half_w = A4_MM / 2, A4_MM / 2 * self.picture.shape[1] / self.picture.shape[0]
        middle = distance_mm * math.tan(math.radians(bearing_deg))
        slant, roll = math.radians(slant_deg), math.radians(roll_deg)
        found = []
        for x, y in ((-half_w, -half_h), (half_w, -half_h), (half_w, half_h), (-half_w, half_h)):
            x, y = x * math.cos(roll) - y * math.sin(roll), x * math.sin(roll) + y * math.cos(roll)
            depth = distance_mm + x * math.sin(slant)
            found.append((width / 2 + focal * (middle + x * math.cos(slant)) / depth, height / 2 + focal * y / depth))
        return np.array(found, np.float32)

    def render(self, distance_mm, bearing_deg=0.0, slant_deg=0.0, roll_deg=0.0, finer=3):
        """The frame: drawn finer, averaged, then sensor noise."""
        height, width = self.background.shape[:2]
        corners = self.corners(distance_mm, bearing_deg, slant_deg, roll_deg)
        shrink = min(1.0, 1.2 * finer * np.ptp(corners[:, 1]) / self.picture.shape[0])
        picture = cv2.resize(self.picture, None, fx=shrink, fy=shrink, interpolation=cv2.INTER_AREA)
        h, w = picture.shape[:2]
        source = np.array([(0, 0), (w, 0), (w, h), (0, h)], np.float32) - 0.5
        transform = cv2.getPerspectiveTransform(source, corners * finer - 0.5)
        large = cv2.resize(self.background, (width * finer, height * finer))
        cv2.warpPerspective(picture, transform, large.shape[1::-1], dst=large, borderMode=cv2.BORDER_TRANSPARENT)
        frame = cv2.resize(large, (width, height), interpolation=cv2.INTER_AREA)
        return (frame + self.rng.normal(0, self.noise, frame.shape)).clip(0, 255).astype(np.uint8)


def photograph(name):
    """One of scikit-image's pictures as BGR."""
    image = getattr(data, name)()
    return cv2.cvtColor(image, cv2.COLOR_RGB2BGR if image.ndim == 3 else cv2.COLOR_GRAY2BGR)


@pytest.fixture
def clock():
    return ManualClock()


@pytest.fixture(scope="session")
def astronaut():
    """A portrait of a real face, of the shape of an A4 sheet. NASA, public domain."""
    return np.ascontiguousarray(photograph("astronaut")[0:300, 118:330])


@pytest.fixture(scope="session")
def distractors():
    """Other real pictures, 320x240."""
    names = ("coffee", "chelsea", "camera", "coins", "page", "text", "moon", "brick", "grass", "gravel", "rocket")
    return {name: cv2.resize(photograph(name), (320, 240), interpolation=cv2.INTER_AREA) for name in names}


@pytest.fixture
def scene(astronaut, distractors):
    """The astronaut's portrait on a picture of a cup of coffee, 320x240."""
    return Scene(astronaut, distractors["coffee"])


@pytest.fixture(scope="session")
def make_scene():
    return Scene
