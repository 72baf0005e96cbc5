"""Measure each detector's range, cost and false alarms in rendered rooms.

    python -m tools.dev.detector_ranges [--size 320x240] [--frames 20] [--slant 30] [--photo face.jpg ...]

Each frame shows a room of its own: walls, boxes and pictures that are not the target at random places, the target at
the given distance and up to 12 degrees to the side, sensor noise, JPEG. The tables of docs/ranges.md come from here.
"""

from __future__ import annotations

import math
import random
import tempfile
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import fmean, median, pstdev

import cv2
import numpy as np

from nxtdrive.vision.detection import TargetDetector
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.geometry import A4_HEIGHT_MM, Pinhole
from sim_backend.bundled import PICTURES, picture_names
from sim_backend.camera.lens import LensEffects
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel, standing_panels
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import TextureLibrary
from sim_backend.plane import sides_of

from .program import parser

A4_WIDTH_MM = 210.0
DISTANCES_M = (0.3, 0.4, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)
LENS_HEIGHT_MM = 200.0
MARKER_SHARE = 0.75
"""Side of a printed marker's black square as a share of the sheet's width: 158 mm on A4."""

CLUTTER = ("carton", "crate", "red_box", "blue_box", "green_box", "yellow_box", "wood")
WALLS = ("wall", "wallpaper", "bricks", "wood")
SAME_BEARING_DEG = 5.0
SAME_DISTANCE = 1.5
"""A detection within these errors, in degrees and as a ratio, counts as the target."""

WEBCAM = LensEffects(jpeg_quality=80)
FLOORS = ("floor", "carpet")


@dataclass(frozen=True, slots=True)
class Subject:
    """A target to measure.

    Attributes:
        name: For the table.
        texture: The sheet: a built-in picture's name or a file.
        target: The detector, with the height its box stands for.
        hidden: Another sheet that must not hang in the room, because the detector would rightly find it.
    """

    name: str
    texture: str
    target: TargetDetector
    hidden: str = ""


@dataclass(frozen=True, slots=True)
class View:
    """One rendered frame, and where the target is in the room."""

    image: cv2.typing.MatLike
    bearing_deg: float
    distance_mm: float


class Rooms:
    """Render random rooms.

    Args:
        size: Width and height of the frames.
        hfov_deg: Horizontal view.
        seed: The same seed gives the same rooms.
        lens: The webcam's imperfections.
    """

    def __init__(self, size: tuple[int, int], hfov_deg: float, seed: int, lens: LensEffects = WEBCAM) -> None:
        self._rng = random.Random(seed)  # noqa: S311 - a repeatable draw
        self.pinhole = Pinhole.from_hfov(size[0], hfov_deg)
        textures = TextureLibrary(seed)
        self._cameras = [SimCamera(size, hfov_deg, seed=seed, lens=lens, textures=textures, floor=f) for f in FLOORS]

    def view(
        self,
        texture: str | None,
        others: Sequence[str],
        distance_mm: float = 0.0,
        slant_deg: float = 0.0,
        width_mm: float = A4_WIDTH_MM,
    ) -> View:
        """Render a room with the sheet `texture` at `distance_mm` from the lens, turned by `slant_deg` to either side.

        Without `texture` the room shows only the `others`.
        """
        rng = self._rng
        lens = Viewpoint(rng.uniform(-500, 500), rng.uniform(-500, 500), rng.uniform(0, 360), LENS_HEIGHT_MM)
        panels = [*self._walls(distance_mm), *self._clutter(lens, others, distance_mm)]
        bearing_deg = rng.uniform(-12, 12) * min(1.0, distance_mm / 1000)
        if texture is not None:
            x, y = _ahead(lens, distance_mm, bearing_deg)
            facing = lens.heading_deg + 180 + rng.choice((-slant_deg, slant_deg))
            bottom_mm = LENS_HEIGHT_MM - A4_HEIGHT_MM / 2
            panels.append(picture_panel(texture, x, y, facing, width_mm=width_mm, bottom_mm=bottom_mm))
        return View(rng.choice(self._cameras).frame(panels, lens), bearing_deg, distance_mm)

    def _walls(self, clear_mm: float) -> Iterable[Panel]:
        """Return four walls, the nearest of them behind the target."""
        x, y = (max(2500.0, clear_mm + 800) + self._rng.uniform(0, 1500) for _ in range(2))
        corners = ((-x, -y), (x, -y), (x, y), (-x, y))
        texture = self._rng.choice(WALLS)
        for (x0, y0), (x1, y1) in sides_of(corners):
            yield Panel(x0, y0, x1, y1, 0.0, 2500.0, texture)

    def _clutter(self, lens: Viewpoint, others: Sequence[str], clear_mm: float) -> Iterable[Panel]:
        """Return boxes and other sheets, none nearer than the target, so that none hides it."""
        rng = self._rng
        for _ in range(rng.randrange(3, 10)):
            x, y = _ahead(lens, rng.uniform(max(900.0, clear_mm + 400), 5500), rng.uniform(-35, 35))
            half, height = rng.uniform(60, 250), rng.uniform(100, 600)
            square = [(x - half, y - half), (x + half, y - half), (x + half, y + half), (x - half, y + half)]
            yield from standing_panels(square, height, rng.choice(CLUTTER))
        for other in others:
            x, y = _ahead(lens, rng.uniform(max(500.0, clear_mm + 300), 4000), rng.uniform(-35, 35))
            facing = lens.heading_deg + 180 + rng.uniform(-50, 50)
            yield picture_panel(other, x, y, facing, bottom_mm=rng.uniform(0, 300))


def _ahead(lens: Viewpoint, distance_mm: float, bearing_deg: float) -> tuple[float, float]:
    heading = math.radians(lens.heading_deg + bearing_deg)
    return lens.x_mm + distance_mm * math.cos(heading), lens.y_mm + distance_mm * math.sin(heading)


def first_errors(
    places: Iterable[tuple[float, float]], bearing_deg: float, distance_mm: float
) -> tuple[float, float] | None:
    """Return the errors of the first detection of the target: of its bearing, degrees, and found over true distance.

    Args:
        places: Bearing and distance of each detection.
        bearing_deg: The target's true bearing.
        distance_mm: Its true distance.
    """
    for found_deg, found_mm in places:
        error_deg, ratio = found_deg - bearing_deg, found_mm / distance_mm
        if abs(error_deg) <= SAME_BEARING_DEG and 1 / SAME_DISTANCE <= ratio <= SAME_DISTANCE:
            return error_deg, ratio
    return None


@dataclass(frozen=True, slots=True)
class Cell:
    """The results of the frames at one distance.

    Attributes:
        hits: Share of the frames in which the target was found where it is.
        distance_bias: Mean error of the distance, as a share.
        distance_sd: Its standard deviation.
        bearing_error_deg: Mean size of the error of the bearing.
    """

    hits: float
    distance_bias: float
    distance_sd: float
    bearing_error_deg: float


class Bench:
    """Measure detectors.

    Args:
        size: Width and height of the frames.
        hfov_deg: Horizontal view.
        frames: Frames per distance.
        others: Sheets that hang in every room unless they are the target.
    """

    def __init__(self, size: tuple[int, int], hfov_deg: float, frames: int, others: Sequence[str]) -> None:
        self._size = size
        self._hfov_deg = hfov_deg
        self._frames = frames
        self._others = others

    def cell(self, subject: Subject, distance_m: float, slant_deg: float) -> Cell:
        """Measure how well `subject` is found at one distance and slant."""
        rooms = Rooms(self._size, self._hfov_deg, seed=round(distance_m * 1000 + slant_deg))
        ratios, bearing_errors_deg = [], []
        for _ in range(self._frames):
            view = rooms.view(subject.texture, self._without(subject), distance_m * 1000, slant_deg)
            found = subject.target.detector.detect(np.asarray(view.image, np.uint8))
            places = (rooms.pinhole.locate(one, subject.target.height_mm) for one in found)
            if errors := first_errors(places, view.bearing_deg, view.distance_mm):
                bearing_errors_deg.append(abs(errors[0]))
                ratios.append(errors[1] - 1)
        if not ratios:
            return Cell(0.0, 0.0, 0.0, 0.0)
        return Cell(len(ratios) / self._frames, fmean(ratios), pstdev(ratios), fmean(bearing_errors_deg))

    def false_alarms(self, subject: Subject, frames: int) -> tuple[int, list[float]]:
        """Return in how many frames without the target something was found, and the CPU time of each look, ms."""
        rooms = Rooms(self._size, self._hfov_deg, seed=1)
        alarms, times_ms = 0, []
        for _ in range(frames):
            image = np.asarray(rooms.view(None, self._without(subject)).image, np.uint8)
            start_s = time.process_time()
            alarms += bool(subject.target.detector.detect(image))
            times_ms.append((time.process_time() - start_s) * 1000)
        return alarms, times_ms

    def _without(self, subject: Subject) -> list[str]:
        return [other for other in self._others if other not in (subject.texture, subject.hidden)]


def subjects(folder: Path, photos: Sequence[Path]) -> list[Subject]:
    """Return the built-in pictures, a marker of each family, a QR code, a magenta sheet and the user's `photos`."""
    pictures = [(file.stem, file.stem, file) for file in sorted(PICTURES.glob("*.png"))]
    pictures += [(photo.stem, str(photo), photo) for photo in photos]
    found = [
        Subject(f"picture {name}", texture, make_detector({"detector": "picture", "pictures": [str(file)]}))
        for name, texture, file in pictures
    ]
    for family, dictionary in (
        ("aruco_4x4_50", cv2.aruco.DICT_4X4_50),
        ("apriltag_36h11", cv2.aruco.DICT_APRILTAG_36H11),
    ):
        spec = {"detector": "marker", "id": 7, "family": family, "height_mm": MARKER_SHARE * A4_WIDTH_MM}
        found.append(Subject(f"marker {family}", _marker_sheet(folder, dictionary), make_detector(spec)))
    code = make_detector({"detector": "qr", "text": "7", "height_mm": MARKER_SHARE * A4_WIDTH_MM})
    found.append(Subject("qr 7", _code_sheet(folder), code))
    magenta = folder / "magenta.png"
    cv2.imwrite(str(magenta), np.full((594, 420, 3), (200, 40, 220), np.uint8))
    found.append(Subject("color magenta", str(magenta), make_detector({"detector": "color", "color": "magenta"})))
    for name, texture in [("lena", "lena"), *((photo.stem, str(photo)) for photo in photos)]:
        haar = make_detector({"detector": "haar", "height_mm": FACE_SHARE * A4_HEIGHT_MM})
        found.append(Subject(f"haar face {name}", texture, haar, hidden="lena"))
    return found


FACE_SHARE = 0.55
"""Height of a face in a portrait; only to check whether a cascade's box lies on it."""


def _marker_sheet(folder: Path, dictionary: int) -> str:
    """Write an image of a sheet with the marker in its centre."""
    side = round(MARKER_SHARE * 420)
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(dictionary), 7, side)
    return _sheet(folder / f"marker{dictionary}.png", marker)


def _code_sheet(folder: Path) -> str:
    """Write an image of a sheet with a QR code of 21 modules in its centre."""
    side = round(MARKER_SHARE * 420)
    code = cv2.QRCodeEncoder.create().encode("7")[2:-2, 2:-2]  # without the white around it
    return _sheet(folder / "code.png", cv2.resize(code, (side, side), interpolation=cv2.INTER_NEAREST))


def _sheet(file: Path, square: cv2.typing.MatLike) -> str:
    side = square.shape[0]
    sheet = np.full((594, 420), 255, np.uint8)
    top, left = (594 - side) // 2, (420 - side) // 2
    sheet[top : top + side, left : left + side] = square
    cv2.imwrite(str(file), sheet)
    return str(file)


def main() -> None:
    """Print the tables."""
    arguments = parser(__doc__)
    arguments.add_argument("--size", default="320x240", help="of the frames, e.g. 640x480")
    arguments.add_argument("--hfov", type=float, default=60.0, help="horizontal field of view in degrees")
    arguments.add_argument("--frames", type=int, default=20, help="per distance")
    arguments.add_argument("--rooms", type=int, default=100, help="without the target, for false alarms and times")
    arguments.add_argument(
        "--slant", type=float, nargs="*", default=[0.0, 30.0, 45.0, 60.0], help="of the target, degrees"
    )
    arguments.add_argument("--photo", type=Path, nargs="*", default=[], help="further A4 pictures to find")
    arguments.add_argument("--only", default="", help="measure only detectors with this in their name")
    args = arguments.parse_args()
    width, height = (int(side) for side in args.size.split("x"))
    bench = Bench((width, height), args.hfov, args.frames, picture_names())
    with tempfile.TemporaryDirectory() as folder:
        measured = [one for one in subjects(Path(folder), args.photo) if args.only in one.name]
        _print_costs(bench, measured, args.rooms)
        for slant_deg in args.slant:
            _print_ranges(bench, measured, slant_deg)


def _print_costs(bench: Bench, measured: Iterable[Subject], rooms: int) -> None:
    print(f"| detector | false alarms in {rooms} rooms | CPU ms median | 95 % |\n|---|---|---|---|")
    for subject in measured:
        alarms, times_ms = bench.false_alarms(subject, rooms)
        slow = sorted(times_ms)[int(0.95 * (len(times_ms) - 1))]
        print(f"| {subject.name} | {alarms} | {median(times_ms):.1f} | {slow:.1f} |", flush=True)


def _print_ranges(bench: Bench, measured: Iterable[Subject], slant_deg: float) -> None:
    print(f"\nSeen at {slant_deg:g} degrees: hits %, distance error % (mean +- sd), bearing error deg")
    print("| detector | " + " | ".join(f"{one:g} m" for one in DISTANCES_M) + " |")
    print("|---" * (len(DISTANCES_M) + 1) + "|")
    for subject in measured:
        cells = (bench.cell(subject, distance_m, slant_deg) for distance_m in DISTANCES_M)
        texts = (
            f"{c.hits:.0%} {c.distance_bias * 100:+z.0f}±{c.distance_sd * 100:.0f} {c.bearing_error_deg:.1f}°"
            if c.hits
            else "-"
            for c in cells
        )
        print(f"| {subject.name} | " + " | ".join(texts) + " |", flush=True)


if __name__ == "__main__":
    main()
