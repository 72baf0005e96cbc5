"""Measure where the `picture` detector fails, and fit the simulation's model of geometric vision to it.

In a checkout::

    python -m tools.dev.fit_geometric [--trials 200]

Each sweep degrades one condition (size, slant, covering, motion blur) and keeps the others easy. The printed result
goes into `sim_backend/camera/geometric.py`.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from statistics import pstdev

import numpy as np

from nxtdrive.vision.detection import TargetDetector
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.geometry import Pinhole
from sim_backend.bundled import PICTURES
from sim_backend.camera.geometric import PICTURE_MODEL, DetectorModel, Falloff, GeometricDetector, PictureView
from sim_backend.camera.scene import Panel, Viewpoint, picture_panel
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import TextureLibrary

from .detector_ranges import WALLS, first_errors
from .program import parser

TARGETS = ("lena", "rilakkuma")
"""The decoys are left out: unlike most pictures, a blurred landscape still looks the same."""

SIZE = (320, 240)
LENS = Viewpoint(0.0, 0.0, 0.0, 200.0)
COVERS = ("carton", "crate", "blue_box", "wood")
SEED = 1


@dataclass(frozen=True, slots=True)
class Setup:
    """One trial's conditions: the picture's position, its cover, and the camera's turn rate."""

    distance_mm: float
    slant_deg: float = 0.0
    covered: float = 0.0
    turn_rate_deg_s: float = 0.0
    brightness: float = 1.0


@dataclass(frozen=True, slots=True)
class Trial:
    """The true geometry and the detector's errors: bearing in degrees, and log of the distance ratio."""

    view: PictureView
    setup: Setup
    errors: tuple[float, float] | None


class BenchSetup:
    """Render arrangements and run the real detector on them."""

    def __init__(self, seed: int) -> None:
        self._rng = random.Random(seed)  # noqa: S311 - a repeatable draw
        self._camera = SimCamera(SIZE, seed=seed, textures=TextureLibrary(seed))
        self._detector = GeometricDetector(SIZE)
        self._pinhole = Pinhole.from_hfov(SIZE[0], 60.0)
        self._targets: dict[str, TargetDetector] = {
            name: make_detector({"detector": "picture", "pictures": [str(PICTURES / f"{name}.png")]})
            for name in TARGETS
        }

    def run(self, setup: Setup) -> Trial | None:
        """Look once at a random picture; return None if it is completely covered."""
        rng = self._rng
        name = rng.choice(list(self._targets))
        bearing = math.radians(rng.uniform(-10.0, 10.0))
        x, y = setup.distance_mm * math.cos(bearing), setup.distance_mm * math.sin(bearing)
        facing = 180.0 + math.degrees(bearing) + rng.choice((-1, 1)) * setup.slant_deg
        picture = picture_panel(name, x, y, facing, bottom_mm=60.0)
        panels = [*self._walls(setup.distance_mm), picture]
        if setup.covered:
            panels.append(self._cover(picture, setup.covered))
        views = self._detector.views(panels, LENS, name, setup.turn_rate_deg_s)
        if not views:
            return None
        image = self._camera.frame(panels, LENS, setup.turn_rate_deg_s, setup.brightness)
        return Trial(views[0], setup, self._errors(name, image, views[0]))

    def _errors(self, name: str, image: np.ndarray, view: PictureView) -> tuple[float, float] | None:
        target = self._targets[name]
        places = (self._pinhole.locate(one, target.height_mm) for one in target.detector.detect(image))
        errors = first_errors(places, view.bearing_deg, view.distance_mm)
        return None if errors is None else (errors[0], math.log(errors[1]))

    def _walls(self, distance_mm: float) -> list[Panel]:
        back, side = distance_mm + self._rng.uniform(200, 2000), 4000.0
        texture = self._rng.choice(WALLS)
        return [Panel(back, -side, back, side, 0.0, 2500.0, texture)]

    def _cover(self, picture: Panel, share: float) -> Panel:
        """Return a board just in front of the picture that hides a share of it, from the left, the right or below."""
        texture, near = self._rng.choice(COVERS), 0.97
        (x0, y0), (x1, y1) = ((near * x, near * y) for x, y in picture.foot_points_mm)
        across_x, across_y = x1 - x0, y1 - y0
        match self._rng.randrange(3):
            case 0:
                return Panel(x0, y0, x0 + share * across_x, y0 + share * across_y, 0.0, 600.0, texture)
            case 1:
                return Panel(x1 - share * across_x, y1 - share * across_y, x1, y1, 0.0, 600.0, texture)
            case _:
                top = picture.bottom_mm + share * (picture.top_mm - picture.bottom_mm)
                return Panel(x0, y0, x1, y1, 0.0, LENS.height_mm + near * (top - LENS.height_mm), texture)


def fit(values: Sequence[float], hits: Sequence[bool], sign: int) -> Falloff:
    """Fit a logistic curve by maximum likelihood on a grid.

    Args:
        values: The quantity in each trial.
        hits: Whether the detector found the picture there.
        sign: 1 if the hit rate falls with growing values, -1 if with shrinking ones.
    """
    measured, found = np.array(values), np.array(hits)
    low, high = float(measured.min()), float(measured.max())
    halves = np.linspace(low, high, 121)[:, None, None]
    widths = sign * np.geomspace((high - low) / 200, (high - low) / 2, 60)[None, :, None]
    rates = 1.0 / (1.0 + np.exp(np.clip((measured - halves) / widths, -60, 60)))
    rates = np.clip(rates, 1e-3, 1 - 1e-3)
    likelihood = np.where(found, np.log(rates), np.log(1 - rates)).sum(axis=2)
    half, width = np.unravel_index(int(likelihood.argmax()), likelihood.shape)
    return Falloff(round(float(halves[half, 0, 0]), 3), round(float(widths[0, width, 0]), 4))


def sweep(bench: BenchSetup, trials: int, make: Callable[[], Setup]) -> list[Trial]:
    """Run `trials` arrangements."""
    done = (bench.run(make()) for _ in range(trials))
    return [trial for trial in done if trial is not None]


def fit_model(trials: int) -> DetectorModel:
    """Measure all six sweeps and the errors, and fit the model."""
    rng = random.Random(SEED)  # noqa: S311 - a repeatable draw
    bench = BenchSetup(SEED)

    def near() -> float:
        return rng.uniform(700.0, 2000.0)

    sizes = sweep(bench, trials, lambda: Setup(math.exp(rng.uniform(math.log(2500), math.log(8000)))))
    slants = sweep(bench, trials, lambda: Setup(near(), slant_deg=rng.uniform(20.0, 85.0)))
    covered = sweep(bench, trials, lambda: Setup(near(), covered=rng.uniform(0.02, 0.95)))
    turning = sweep(bench, trials, lambda: Setup(near(), turn_rate_deg_s=rng.uniform(0.0, 720.0)))

    dim = sweep(bench, trials, lambda: Setup(near(), brightness=2 ** rng.uniform(-6.0, 0.0)))
    glaring = sweep(bench, trials, lambda: Setup(near(), brightness=2 ** rng.uniform(0.0, 3.0)))

    def curve(done: list[Trial], quantity: Callable[[PictureView], float], sign: int) -> Falloff:
        return fit([quantity(trial.view) for trial in done], [trial.errors is not None for trial in done], sign)

    def light(done: list[Trial], sign: int) -> Falloff:
        levels = [math.log2(trial.setup.brightness) for trial in done]
        return fit(levels, [trial.errors is not None for trial in done], sign)

    errors = [trial.errors for trial in sizes if trial.errors is not None]
    return DetectorModel(
        log2_height=curve(sizes, lambda view: math.log2(view.height_px), -1),
        slant_deg=curve(slants, lambda view: view.slant_deg, 1),
        hidden=curve(covered, lambda view: view.hidden, 1),
        blur=curve(turning, lambda view: view.blur, 1),
        bearing_sd_deg=round(pstdev(bearing for bearing, _ in errors), 3),
        dark=light(dim, -1),
        glare=light(glaring, 1),
        distance_sd=round(pstdev(ratio for _, ratio in errors), 3),
    )


def main() -> None:
    """Print the model in use and the measured one."""
    arguments = parser(__doc__)
    arguments.add_argument("--trials", type=int, default=200, help="frames in each of the six sweeps")
    args = arguments.parse_args()
    print(f"in use:   {PICTURE_MODEL}")
    print(f"measured: {fit_model(args.trials)}")


if __name__ == "__main__":
    main()
