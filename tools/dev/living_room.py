"""Measure the detectors with twenty prints in the conditions of a living room.

    python -m tools.dev.living_room [--frames 10] [--rooms 1000] [--only fox,map]
        [--conditions "roll 15,glare"] [--seeds tune|report] [--detector haar]

For every print and condition: the range, which is the distance up to which the print is found at its place in 90 % of
the frames. Each condition is applied to the same rendered frames, so that only the condition differs. The tables of
docs/ranges.md come from here.
"""

from __future__ import annotations

import math
import random
import tempfile
import time
import zlib
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

import cv2
import numpy as np
from numpy.typing import NDArray

from nxtdrive.vision.detection import Detection, Detector
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.geometry import A4_HEIGHT_MM, Pinhole
from nxtdrive.vision.sources import read_image
from sim_backend.camera.lens import PERFECT, motion_blur_kernel
from sim_backend.camera.textures import Image

from .detector_ranges import Rooms
from .prints import write_distractors, write_prints
from .program import parser

SIZE = (320, 240)
MARGIN = (32, 40)
"""The rooms are rendered larger by this on every side, so that a rolled frame has no empty corners."""

HFOV_DEG = 60.0
DISTANCES_M = (0.6, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5)
SHARE = 0.9
OFF_PX, OFF_SHARE = 6.0, 0.25
"""A detection is right if its centre is this near to the print's (or within this share of its height)."""

SAME_SIZE = 1.35
KEPT = 0.8
"""Share of the ideal camera's range that should remain under a condition."""

TURN_PX = 3.5
"""Smear of a turn at the mission's 36 degrees a second, in a fiftieth of a second."""

FACE_SHARES = {"lena": 0.52, "astronaut": 0.33}
"""Height of the face in a print, as a share of the print's: `haar` finds faces."""

SEEDS = {"tune": 1000, "report": 2000}
"""Rooms that thresholds were chosen in, and rooms that are reported."""


@dataclass(frozen=True, slots=True)
class Camera:
    """One frame's conditions.

    Attributes:
        roll_deg: Roll of the camera, clockwise.
        gain: Factor of the pixel values of blue, green, red, before they are cut at 255.
        motion_blur_px: Horizontal blur.
        jpeg: Quality.
        glare: Share of the print that a reflection makes white.
    """

    roll_deg: float = 0.0
    gain: tuple[float, float, float] = (1.0, 1.0, 1.0)
    motion_blur_px: float = 0.0
    jpeg: int = 80
    glare: float = 0.0


def _gray(gain: float) -> tuple[float, float, float]:
    return gain, gain, gain


def _mixture(rng: random.Random) -> Camera:
    """Return random conditions of a living room: a little of everything."""
    light, warm = math.exp(rng.uniform(-0.7, 0.7)), math.exp(rng.uniform(-0.25, 0.25))
    return Camera(
        roll_deg=rng.uniform(-10, 10),
        gain=(light / warm, light, light * warm),
        motion_blur_px=rng.choice((0.0, 0.0, 2.0)),
        jpeg=rng.choice((30, 50, 80)),
        glare=rng.choice((0.0, 0.0, 0.1)),
    )


CONDITIONS: dict[str, Callable[[random.Random], Camera]] = {
    "ideal": lambda _: Camera(),
    "roll 5": lambda rng: Camera(roll_deg=rng.choice((-5, 5))),
    "roll 10": lambda rng: Camera(roll_deg=rng.choice((-10, 10))),
    "roll 15": lambda rng: Camera(roll_deg=rng.choice((-15, 15))),
    "light x1/3": lambda _: Camera(gain=_gray(3 ** (-1 / 2.2))),
    "light x3": lambda _: Camera(gain=_gray(3 ** (1 / 2.2))),
    "pixels x1/3": lambda _: Camera(gain=_gray(1 / 3)),
    "pixels x3": lambda _: Camera(gain=_gray(3.0)),
    "warm": lambda _: Camera(gain=(0.6, 0.9, 1.2)),
    "cool": lambda _: Camera(gain=(1.25, 1.0, 0.7)),
    "turn": lambda _: Camera(motion_blur_px=TURN_PX),
    "JPEG 20": lambda _: Camera(jpeg=20),
    "glare": lambda _: Camera(glare=0.2),
    "living room": _mixture,
}
"""Light x3 is three times the light on the sensor of a camera with gamma 2.2; pixels x3 triples the pixel values."""


@dataclass(frozen=True, slots=True)
class Shot:
    """A clean frame with a margin, and where the print is in it: centre and height in pixels."""

    image: Image
    u: float
    v: float
    height_px: float


def taken(shot: Shot, camera: Camera, rng: random.Random, width_share: float) -> tuple[Image, float, float]:
    """Return the frame that the camera takes, and the print's centre in it."""
    frame: cv2.typing.MatLike = _glared(shot, camera, rng, width_share) if camera.glare else shot.image
    centre = frame.shape[1] / 2, frame.shape[0] / 2
    turn = cv2.getRotationMatrix2D((centre[0] - 0.5, centre[1] - 0.5), camera.roll_deg, 1.0)
    if camera.roll_deg:
        frame = np.asarray(cv2.warpAffine(frame, turn, frame.shape[1::-1], flags=cv2.INTER_CUBIC))
    u, v = turn @ (shot.u, shot.v, 1.0)
    frame = frame[MARGIN[1] : MARGIN[1] + SIZE[1], MARGIN[0] : MARGIN[0] + SIZE[0]]
    light = cv2.GaussianBlur(frame, (5, 5), 0.6).astype(np.float32)
    if camera.motion_blur_px:
        light = np.asarray(cv2.filter2D(light, -1, motion_blur_kernel(camera.motion_blur_px)), np.float32)
    noise = np.random.default_rng(rng.randrange(1 << 30)).normal(0, 4.0, light.shape)
    seen = (light * np.array(camera.gain, np.float32) + noise).clip(0, 255).astype(np.uint8)
    packed = cv2.imencode(".jpg", seen, [cv2.IMWRITE_JPEG_QUALITY, camera.jpeg])[1]
    return np.asarray(cv2.imdecode(packed, cv2.IMREAD_COLOR), np.uint8), u - MARGIN[0], v - MARGIN[1]


def _glared(shot: Shot, camera: Camera, rng: random.Random, width_share: float) -> NDArray[np.float32]:
    """Return the frame with a soft ellipse on a share of the print, so bright that the camera shows it white."""
    high, wide = shot.height_px, shot.height_px * width_share
    stretch = math.exp(rng.uniform(-0.3, 0.3))
    radius = math.sqrt(camera.glare * high * wide / math.pi)
    u = shot.u + rng.uniform(-0.5, 0.5) * max(0.0, wide - 2 * radius * stretch)
    v = shot.v + rng.uniform(-0.5, 0.5) * max(0.0, high - 2 * radius / stretch)
    mask = np.zeros(shot.image.shape[:2], np.float32)
    axes = round(16 * radius * stretch), round(16 * radius / stretch)
    cv2.ellipse(mask, (round(16 * u), round(16 * v)), axes, 0, 0, 360, 1.0, -1, cv2.LINE_8, 4)
    mask = np.asarray(cv2.GaussianBlur(mask, (0, 0), max(0.5, 0.1 * radius)), np.float32)
    white = 255.0 / min(1.0, *camera.gain)
    return np.asarray(shot.image + mask[:, :, None] * (white - shot.image), np.float32)


class LivingRoom:
    """Render prints in rooms, and measure detectors on them.

    Args:
        files: The prints.
        distractors: Further sheets that hang in the rooms.
        seed: Seed of the rooms.
        alike: Prints that the detector finds as well; they hang in no room.
    """

    def __init__(
        self, files: Mapping[str, Path], distractors: Sequence[str], seed: int, alike: Collection[str] = ()
    ) -> None:
        self._files = files
        self._alike = alike
        self._distractors = distractors
        self._seed = seed
        self._size = SIZE[0] + 2 * MARGIN[0], SIZE[1] + 2 * MARGIN[1]
        focal_px = Pinhole.from_hfov(SIZE[0], HFOV_DEG).focal_px
        self._hfov_deg = 2 * math.degrees(math.atan(self._size[0] / 2 / focal_px))
        self._focal_px = focal_px

    def shots(self, name: str, distance_m: float, frames: int) -> list[Shot]:
        """Render clean frames with a print at a distance."""
        rooms = Rooms(self._size, self._hfov_deg, self._seed + round(100 * distance_m), PERFECT)
        rng = random.Random(f"{self._seed} {distance_m}")  # noqa: S311 - a repeatable draw
        width_mm, distance_mm = A4_HEIGHT_MM * self.width_share(name), 1000 * distance_m
        texture = str(self._files[name])
        taken = []
        for _ in range(frames):
            view = rooms.view(texture, self._others(name, rng), distance_mm, rng.uniform(0, 15), width_mm)
            bearing = math.radians(view.bearing_deg)
            depth_mm = view.distance_mm * math.cos(bearing)
            u = self._size[0] / 2 + self._focal_px * math.tan(bearing)
            height_px = self._focal_px * A4_HEIGHT_MM / depth_mm
            taken.append(Shot(np.asarray(view.image, np.uint8), u, self._size[1] / 2, height_px))
        return taken

    def rooms(self, name: str, frames: int) -> Iterable[Image]:
        """Render frames of rooms without the print, other ones for each print, each in a condition of its own."""
        rooms = Rooms(self._size, self._hfov_deg, self._seed + zlib.crc32(name.encode()), PERFECT)
        rng = random.Random(f"{self._seed} rooms {name}")  # noqa: S311 - a repeatable draw
        draws = list(CONDITIONS.values())
        for number in range(frames):
            view = rooms.view(None, self._others(name, rng))
            camera = draws[number % len(draws)](rng)
            shot = Shot(np.asarray(view.image, np.uint8), 192.0, 160.0, 60.0)
            yield taken(shot, camera, rng, 0.7)[0]

    def width_share(self, name: str) -> float:
        """Return a print's width as a share of its height."""
        height, width = read_image(self._files[name]).shape[:2]
        return float(width / height)

    def _others(self, name: str, rng: random.Random) -> list[str]:
        """Draw six sheets that are not the print."""
        sheets = [str(file) for other, file in self._files.items() if other != name and other not in self._alike]
        return rng.sample([*sheets, *self._distractors], 6)


def is_right(found: Detection, u: float, v: float, height_px: float, part: float = 1.0) -> bool:
    """Return whether a detection matches the print, or the visible `part` of its height, in place and size."""
    if found.quad is None:
        (x, y), high = found.centre, float(found.box[3])
    else:
        (ax, ay), (bx, by), (cx, cy), (dx, dy) = found.quad
        x, y = (ax + bx + cx + dx) / 4, (ay + by + cy + dy) / 4
        high = (math.dist((ax, ay), (dx, dy)) + math.dist((bx, by), (cx, cy))) / 2
    near = math.dist((x, y), (u, v)) <= max(OFF_PX, OFF_SHARE * height_px)
    return near and 1 / SAME_SIZE <= high / (part * height_px) <= SAME_SIZE


def range_m(rates: Sequence[float]) -> float:
    """Return the distance up to which the rate is at least `SHARE`, by interpolation; 0 if it is so nowhere.

    One nearer cell may fall short if the next is good again: with a few frames a rate is uncertain.
    """
    good = [rate >= SHARE for rate in rates]
    last = -1
    for index, fine in enumerate(good):
        if not fine and not (index + 1 < len(good) and good[index + 1]):
            break
        last = index
    if last < 0:
        return 0.0
    if last + 1 == len(rates):
        return DISTANCES_M[last]
    high, low = max(rates[last], SHARE), rates[last + 1]
    share = (high - SHARE) / (high - low) if high > low else 0.0
    return DISTANCES_M[last] + share * (DISTANCES_M[last + 1] - DISTANCES_M[last])


def measure_ranges(
    room: LivingRoom, name: str, detector: Detector, frames: int, wanted: Sequence[str], part: float = 1.0
) -> tuple[dict[str, float], list[float]]:
    """Return the range of a print in every condition, and the CPU time of each look in ms."""
    rates: dict[str, list[float]] = {condition: [] for condition in wanted}
    times_ms: list[float] = []
    width_share = room.width_share(name)
    for distance_m in DISTANCES_M:
        shots = room.shots(name, distance_m, frames)
        for condition in wanted:
            rng = random.Random(f"{condition} {distance_m}")  # noqa: S311 - a repeatable draw
            hits = 0
            if len(rates[condition]) >= 2 and max(rates[condition][-2:]) < SHARE / 2:
                rates[condition].append(0.0)
                continue
            for shot in shots:
                frame, u, v = taken(shot, CONDITIONS[condition](rng), rng, width_share)
                start_s = time.thread_time()
                found = detector.detect(frame)
                times_ms.append(1000 * (time.thread_time() - start_s))
                hits += any(is_right(one, u, v, shot.height_px, part) for one in found)
            rates[condition].append(hits / frames)
    return {condition: range_m(each) for condition, each in rates.items()}, times_ms


def measure_alarms(room: LivingRoom, name: str, detector: Detector, frames: int) -> tuple[int, list[float]]:
    """Return in how many rooms without the print it was found, and the CPU time of each look in ms."""
    alarms, times_ms = 0, []
    for frame in room.rooms(name, frames):
        start_s = time.thread_time()
        alarms += bool(detector.detect(frame))
        times_ms.append(1000 * (time.thread_time() - start_s))
    return alarms, times_ms


def _summary(times_ms: list[float]) -> str:
    if not times_ms:
        return "-"
    return f"{median(times_ms):.1f} / {sorted(times_ms)[int(0.95 * (len(times_ms) - 1))]:.1f}"


def _shares(rows: Iterable[Mapping[str, float]], wanted: Sequence[str]) -> Iterable[list[str]]:
    """Yield the ranges as shares of the ideal camera's: their mean over the prints, and how many prints keep 80 %."""
    found = [row for row in rows if row.get("ideal")]
    shares = {one: [min(1.0, row[one] / row["ideal"]) for row in found] for one in wanted}
    if found:
        yield ["share of ideal, mean", *(f"{sum(each) / len(each):.2f}" for each in shares.values())]
        yield [
            f"prints with 80 %, of {len(found)}",
            *(str(sum(one >= KEPT for one in each)) for each in shares.values()),
        ]


def main() -> None:
    """Print the table."""
    arguments = parser(__doc__)
    arguments.add_argument("--frames", type=int, default=10, help="per distance")
    arguments.add_argument("--rooms", type=int, default=100, help="without the print, for false alarms; per print")
    arguments.add_argument("--seeds", choices=SEEDS, default="report", help="which rooms")
    arguments.add_argument("--only", default="", help="prints, with commas")
    arguments.add_argument("--conditions", default=",".join(CONDITIONS), help="with commas")
    arguments.add_argument("--detector", choices=("picture", "haar"), default="picture")
    args = arguments.parse_args()
    wanted = args.conditions.split(",") if args.conditions else []
    with tempfile.TemporaryDirectory() as text:
        folder = Path(text)
        files = write_prints(folder)
        names, alike = (files, ()) if args.detector == "picture" else (FACE_SHARES, FACE_SHARES)
        room = LivingRoom(files, write_distractors(folder), SEEDS[args.seeds], alike)
        print(f"| print | {' | '.join(wanted)} | ms with, median / 95 % | false alarms | ms without |")
        print("|---" * (len(wanted) + 4) + "|")
        rows, all_alarms = [], 0
        for name in args.only.split(",") if args.only else names:
            spec = {"detector": "picture", "pictures": [str(files[name])]} if args.detector == "picture" else {}
            detector = make_detector(spec or {"detector": "haar"}).detector
            part = 1.0 if spec else FACE_SHARES[name]
            ranges, with_ms = measure_ranges(room, name, detector, args.frames, wanted, part) if wanted else ({}, [])
            alarms, without_ms = measure_alarms(room, name, detector, args.rooms)
            rows.append(ranges)
            all_alarms += alarms
            cells = [f"{ranges[one]:.1f}" for one in wanted]
            tail = [_summary(with_ms), f"{alarms} in {args.rooms}", _summary(without_ms)]
            print(f"| {name} | {' | '.join([*cells, *tail])} |", flush=True)
        for row in _shares(rows, wanted):
            print(f"| {' | '.join(row)} | | | |")
        print(f"{all_alarms} false alarms in {len(rows) * args.rooms} rooms")


if __name__ == "__main__":
    main()
