"""Compare looks for several pictures at once with looks for each alone, in the rooms of `living_room`.

    python -m tools.dev.together [--pictures 12] [--frames 1] [--seeds tune|report]

Each of the prints hangs in rooms at several distances, among six others, in every condition; all of them are targets.
Detections are the same if their boxes are, to a pixel. Times are CPU time of one thread.
"""

from __future__ import annotations

import random
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import fmean

import cv2
import numpy as np

from nxtdrive.vision.detection import Detection, Detector
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.detectors.shared_frame import detect_each
from sim_backend.camera.textures import Image

from .living_room import CONDITIONS, SEEDS, LivingRoom, is_right, taken
from .prints import write_distractors, write_prints
from .program import parser

DISTANCES_M = (0.6, 1.5, 2.5, 3.5)
FEW = 3


def frames(room: LivingRoom, names: Sequence[str], number: int) -> Iterator[tuple[Image, str, float, float, float]]:
    """Yield frames, the print that each shows, where its centre is, and its height, in pixels."""
    for name in names:
        width_share = room.width_share(name)
        for distance_m in DISTANCES_M:
            for shot in room.shots(name, distance_m, number):
                for condition, draw in CONDITIONS.items():
                    rng = random.Random(f"{name} {condition} {distance_m}")  # noqa: S311 - a repeatable draw
                    frame, u, v = taken(shot, draw(rng), rng, width_share)
                    yield frame, name, u, v, shot.height_px


def compared(alone: Sequence[Detection], together: Sequence[Detection]) -> str:
    """Return how two looks for a picture differ, in words."""
    if bool(alone) != bool(together):
        return "found alone only" if alone else "found at once only"
    pairs = zip(alone, together, strict=False)
    near = all(np.abs(np.subtract(one.box, other.box)).max() <= 1 for one, other in pairs)
    same = near and len(alone) == len(together)
    return ("same" if same else "found elsewhere") if alone else "nothing"


def timed(detectors: Mapping[str, Detector], image: Image) -> tuple[dict[str, list[Detection]], float]:
    """Return the detections, and the CPU time in ms."""
    start_s = time.thread_time()
    found = detect_each(detectors, image)
    return found, 1000 * (time.thread_time() - start_s)


def main() -> None:
    """Print the figures."""
    arguments = parser(__doc__)
    arguments.add_argument("--pictures", type=int, default=12, help="number of pictures to look for")
    arguments.add_argument("--frames", type=int, default=1, help="rooms per print and distance")
    arguments.add_argument("--seeds", choices=SEEDS, default="report", help="which rooms")
    args = arguments.parse_args()
    cv2.setNumThreads(1)
    outcomes, right = Counter[str](), Counter[str]()
    times_ms: list[tuple[float, float, float]] = []
    with tempfile.TemporaryDirectory() as text:
        files = write_prints(Path(text))
        names = list(files)[: args.pictures]
        room = LivingRoom(files, write_distractors(Path(text)), SEEDS[args.seeds])
        specs = {name: {"detector": "picture", "pictures": [str(files[name])]} for name in names}
        detectors: dict[str, Detector] = {name: make_detector(spec).detector for name, spec in specs.items()}
        few = {name: detectors[name] for name in names[:FEW]}
        for image, shown, u, v, height_px in frames(room, names, args.frames):
            alone = {name: timed({name: one}, image) for name, one in detectors.items()}
            together, took_ms = timed(detectors, image)
            times_ms.append((fmean(each_ms for _, each_ms in alone.values()), timed(few, image)[1], took_ms))
            outcomes.update(compared(alone[name][0][name], together[name]) for name in names)
            for how, found in (("alone", alone[shown][0][shown]), ("at once", together[shown])):
                right[how] += any(is_right(one, u, v, height_px) for one in found)
    print(f"{outcomes.total()} looks for {len(names)} pictures: {dict(outcomes)}")
    print(f"the print that is shown was found at its place: {dict(right)}")
    one_ms, few_ms, all_ms = (fmean(each) for each in zip(*times_ms[1:], strict=True))  # without the first look
    print(f"CPU ms: one {one_ms:.1f}; {len(few)} at once {few_ms:.1f}, {few_ms / one_ms:.2f} times as long; ", end="")
    print(f"{len(names)} at once {all_ms:.1f}, {all_ms / one_ms:.2f} times as long")


if __name__ == "__main__":
    main()
