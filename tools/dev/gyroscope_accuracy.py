"""Measure how often and how accurately the visual gyroscope measures a turn, in rendered rooms.

    python -m tools.dev.gyroscope_accuracy [--rooms 60] [--places 4] [--seed 1]

The rooms are those of `free_floor_accuracy`. At each place the camera takes two frames, 0.1 s apart, while the robot
turns about its axle or drives. The last column is what geometric vision simulates. The table of docs/ranges.md section
4 comes from here.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.visual_gyroscope import VisualGyroscope
from sim_backend.camera.geometric_gyroscope import GYROSCOPE_MODEL
from sim_backend.camera.lens import LensEffects
from sim_backend.camera.scene import Viewpoint
from sim_backend.camera.sim_camera import SimCamera
from sim_backend.camera.textures import TextureLibrary

from .free_floor_accuracy import Room, make_room
from .program import parser

SIZE = (320, 240)
FRAME_S = 0.1
LENS_FORWARD_MM = 80.0
"""How far the lens is in front of the axle."""
FAR_OFF_DEG = 1.0
"""A turn that is measured wrong by more than this, beyond its scale, is far off."""


@dataclass(frozen=True, slots=True)
class Motion:
    """How the robot moves between two frames, and how they are exposed."""

    turned_deg: float = 0.0
    driven_mm: float = 0.0
    brightness: float = 1.0
    shutter_s: float = 0.02

    @property
    def turn_deg_s(self) -> float:
        """Turn rate of the camera."""
        return self.turned_deg / FRAME_S


MOTIONS = {
    "at rest": Motion(),
    **{f"turn by {deg} deg": Motion(turned_deg=deg) for deg in (1, 2, 4, 6, 8, 10, 12)},
    **{f"drive {mm} mm": Motion(driven_mm=mm) for mm in (20, 40, 60, 80)},
    "drive 20 mm, turn by 2 deg": Motion(turned_deg=2, driven_mm=20),
    **{f"turn by 2 deg, brightness {light}": Motion(turned_deg=2, brightness=light) for light in (0.7, 0.5, 0.35, 0.2)},
    **{f"turn by 2 deg, shutter {s} s": Motion(turned_deg=2, shutter_s=s) for s in (0.05, 0.1)},
}

Measured = tuple[float | None, float | None]
"""The turn as the gyroscope measures it, and as the model does, in degrees; None where they do not."""


def measure(room: Room, motion: Motion, seed: int) -> Iterator[Measured]:
    """Yield the measurements at the places of a room; the direction of the turn is drawn."""
    rng = random.Random(f"{seed}/{motion}")  # noqa: S311 - a repeatable draw
    camera = SimCamera(
        SIZE, seed=seed, lens=LensEffects(shutter_s=motion.shutter_s), floor=room.floor, textures=TextureLibrary(seed)
    )
    pinhole = Pinhole.from_hfov(SIZE[0])
    for place in room.places:
        side = rng.choice((-1, 1))
        then, now = _moved(place, 0.0, 0.0), _moved(place, motion.driven_mm, side * motion.turned_deg)
        gyroscope = VisualGyroscope()
        seen = [
            gyroscope.turned_deg(
                camera.frame(room.panels, each, side * motion.turn_deg_s, motion.brightness), pinhole.resized(*SIZE)
            )
            for each in (then, now)
        ][-1]
        blur_deg = motion.turn_deg_s * motion.shutter_s
        modelled = GYROSCOPE_MODEL.measured_deg(then, now, blur_deg, motion.brightness, rng)
        yield seen and side * seen, modelled and side * modelled


def _moved(axle: Viewpoint, driven_mm: float, turned_deg: float) -> Viewpoint:
    """Return the pose of the lens after the axle moved."""
    then, now = math.radians(axle.heading_deg), math.radians(axle.heading_deg + turned_deg)
    return replace(
        axle,
        x_mm=axle.x_mm + driven_mm * math.cos(then) + LENS_FORWARD_MM * math.cos(now),
        y_mm=axle.y_mm + driven_mm * math.sin(then) + LENS_FORWARD_MM * math.sin(now),
        heading_deg=axle.heading_deg + turned_deg,
    )


def row(name: str, measured: Sequence[Measured]) -> str:
    """Return a row of the table."""
    seen = np.array([turn for turn, _ in measured if turn is not None])
    modelled = fmean(model is not None for _, model in measured)
    cells = ["-"] * 3
    if len(seen):
        middle = round(float(np.median(seen)), 2) + 0.0  # not -0
        low, high = np.percentile(seen, (25, 75))
        far_off = float((np.abs(seen - middle) > FAR_OFF_DEG).mean())
        cells = [f"{middle:.2f}", f"{(high - low) / 1.349:.2f}", f"{100 * far_off:.1f} %"]
    shares = f"{100 * len(seen) / len(measured):.0f} %", f"{100 * modelled:.0f} %"
    return f"| {name} | {len(measured)} | {shares[0]} | {' | '.join(cells)} | {shares[1]} |"


def main() -> None:
    """Print the table."""
    arguments = parser(__doc__)
    arguments.add_argument("--rooms", type=int, default=60)
    arguments.add_argument("--places", type=int, default=4, help="to look from, per room")
    arguments.add_argument("--seed", type=int, default=1)
    args = arguments.parse_args()
    rooms = [make_room(number, args.places, args.seed) for number in range(args.rooms)]
    print("| motion in 0.1 s | pairs | measured | median, deg | spread, deg | far off | measured in the model |")
    print("|---" * 7 + "|")
    for name, motion in MOTIONS.items():
        measured = [each for number, room in enumerate(rooms) for each in measure(room, motion, args.seed + number)]
        print(row(name, measured), flush=True)


if __name__ == "__main__":
    main()
