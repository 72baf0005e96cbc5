"""The bundled pictures: faces are faces, and no two look alike."""

import itertools
import math
from pathlib import Path

import cv2
import numpy as np
import pytest

from sim_backend.bundled import PICTURES
from sim_backend.camera.lens import PERFECT
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import SURFACES
from tests.sim_backend.cameras import ORIGIN

NAMES = sorted(path.stem for path in PICTURES.glob("*.png") if path.stem != "calibration-sheet")
"""Pictures to search for; the marker sheet is not one, and its fine patterns blur from afar."""
CASCADES = ("haarcascade_frontalface_default.xml", "haarcascade_frontalface_alt2.xml")
ROOM = [
    Panel(4000.0, -3000.0, 4000.0, 3000.0, 0.0, 2500.0, "wall"),
    Panel(0.0, -3000.0, 4000.0, -3000.0, 0.0, 2500.0, "bricks"),
]
NEAR = [(size, metres) for size in ((320, 240), (640, 480)) for metres in (0.4, 0.7, 1.0, 1.5)]
FAR = [((640, 480), 2.0), ((640, 480), 2.5)]
LOOKS = 4


@pytest.fixture(scope="module", params=CASCADES)
def cascade(request):
    return cv2.CascadeClassifier(str(Path(cv2.data.haarcascades) / request.param))


def frames(name, size, metres):
    """A few noisy frames of a picture in a room, each seen in another direction."""
    camera = SimCamera(size, seed=round(metres * 1000))
    for look in range(LOOKS):
        bearing_deg = (look - 1.5) * 6.0 * min(1.0, metres)
        panel = picture_panel(name, metres * 1000.0, 0.0, 180.0, bottom_mm=60.0)
        lens = Viewpoint(0.0, 0.0, -bearing_deg, 200.0)
        focal = size[0] / 2 / math.tan(math.radians(30.0))
        yield (
            camera.frame([*ROOM, panel], lens),
            size[0] / 2 + focal * math.tan(math.radians(bearing_deg)),
            focal / (metres * 1000.0),
        )


def faces(cascade, frame):
    return cascade.detectMultiScale(cv2.cvtColor(frame, cv2.COLOR_BGR2GRAY), scaleFactor=1.1, minNeighbors=5)


@pytest.mark.slow
@pytest.mark.parametrize(("size", "metres"), NEAR + FAR)
def test_opencv_takes_lena_for_a_face(cascade, size, metres):
    for frame, middle, px_per_mm in frames("lena", size, metres):
        found = faces(cascade, frame)
        assert len(found) == 1
        left, _, width, _ = found[0]
        assert left + width / 2 == pytest.approx(middle, abs=12 * px_per_mm + 2)
        assert 110 * px_per_mm < width < 190 * px_per_mm


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name != "lena"])
@pytest.mark.parametrize(
    ("size", "metres"),
    [
        ((320, 240), 0.5),
        pytest.param((320, 240), 1.2, marks=pytest.mark.nightly),
        pytest.param((640, 480), 0.8, marks=pytest.mark.nightly),
        ((640, 480), 2.0),
    ],
)
def test_opencv_takes_no_other_picture_for_a_face(cascade, name, size, metres):
    assert [len(faces(cascade, frame)) for frame, _, _ in frames(name, size, metres)] == [0] * LOOKS


@pytest.mark.slow
@pytest.mark.parametrize("surface", sorted(SURFACES))
def test_no_surface_is_taken_for_a_face(cascade, surface):
    panel = Panel(1000.0, -300.0, 1000.0, 300.0, 0.0, 700.0, surface)
    frame = SimCamera((640, 480)).frame([*ROOM, panel], ORIGIN)
    assert len(faces(cascade, frame)) == 0


@pytest.mark.parametrize(("one", "other"), list(itertools.combinations(NAMES, 2)))
def test_no_two_pictures_look_alike(one, other):
    """In gray and small, as a template matcher compares them; a picture with itself in a frame gives 0.9 and more."""
    first, second = (small_gray(cv2.imread(str(PICTURES / f"{name}.png"))) for name in (one, other))
    assert abs(np.corrcoef(first, second)[0, 1]) < 0.6


@pytest.mark.parametrize("name", NAMES)
def test_a_rendered_picture_still_correlates_with_its_file(name):
    panel = picture_panel(name, 1500.0, 0.0, 180.0, bottom_mm=51.5)
    frame = SimCamera((320, 240)).frame([*ROOM, panel], ORIGIN)
    height, width = (277.1 * side / 1500.0 for side in (297.0, 210.0))
    top, left = round(120 - height / 2), round(160 - width / 2)
    seen = small_gray(frame[top : top + round(height), left : left + round(width)])
    assert np.corrcoef(seen, small_gray(cv2.imread(str(PICTURES / f"{name}.png"))))[0, 1] > 0.9


def small_gray(image):
    return (
        cv2.resize(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), (28, 40), interpolation=cv2.INTER_AREA)
        .ravel()
        .astype(float)
    )


@pytest.mark.slow
def test_features_distinguish_lena_from_the_bear():
    """SIFT with the ratio test, as the picture detector's second opinion."""
    sift = cv2.SIFT_create()
    views = {
        name: SimCamera((640, 480), lens=PERFECT).frame(
            [picture_panel(name, 700.0, 0.0, 180.0, bottom_mm=60.0)], ORIGIN
        )
        for name in ("lena", "rilakkuma")
    }

    def matches(name, view):
        _, wanted = sift.detectAndCompute(cv2.imread(str(PICTURES / f"{name}.png"), cv2.IMREAD_GRAYSCALE), None)
        _, seen = sift.detectAndCompute(cv2.cvtColor(views[view], cv2.COLOR_BGR2GRAY), None)
        pairs = cv2.BFMatcher().knnMatch(wanted, seen, k=2)
        return sum(best.distance < 0.7 * second.distance for best, second in pairs)

    for name, other in (("lena", "rilakkuma"), ("rilakkuma", "lena")):
        assert matches(name, name) >= 15
        assert matches(name, name) > 4 * matches(other, name)
