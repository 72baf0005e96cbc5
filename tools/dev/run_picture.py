"""Combine a run's map and a few frames of its video into one picture, as shown in the README.

``python -m tools.dev.run_picture runs/lena-then-rilakkuma-001 docs/images/run.png``
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import cv2
import numpy as np

from nxtdrive.recording.run_folder import JOURNAL, MAP, VIDEO
from nxtdrive.recording.video import VIDEO_FPS
from nxtdrive.vision.detection import Image

PAPER = (250, 250, 248)
GAP_PX = 12


def main() -> None:
    """Read a run's folder and write the picture."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="a run's folder")
    parser.add_argument("out", type=Path, help="the picture to write")
    args = parser.parse_args()
    plan = cv2.imread(str(args.folder / MAP))
    if plan is None:
        parser.error(f"{args.folder} holds no {MAP}")
    frames = telling_frames(args.folder)
    args.out.parent.mkdir(parents=True, exist_ok=True)
    cv2.imwrite(str(args.out), _beside(plan.astype(np.uint8), frames))
    print(args.out)


def telling_frames(folder: Path) -> list[Image]:
    """Return one frame each of a sighting, a lost target, a wait and an arrival."""
    records = [json.loads(line) for line in (folder / JOURNAL).read_text(encoding="utf-8").splitlines()]
    entered = [(record["to"], record["t"]) for record in records if record["kind"] == "transition"]
    wanted: dict[str, float] = {}
    for state, time_s in entered:
        # an approach shows a second after it begins; the cause of the others shows a moment before them
        wanted.setdefault(state, time_s + 1.0 if state == "arrive" else time_s - 0.2)
    moments = [wanted[state] for state in ("arrive", "wait", "reached", "finished") if state in wanted]
    return [frame for time_s in moments if (frame := _frame_at(folder / VIDEO, time_s)) is not None]


def _frame_at(path: Path, time_s: float) -> Image | None:
    film = cv2.VideoCapture(str(path))
    film.set(cv2.CAP_PROP_POS_FRAMES, max(0, round(time_s * VIDEO_FPS)))
    there, frame = film.read()
    film.release()
    return frame.astype(np.uint8) if there else None


def _beside(plan: Image, frames: list[Image]) -> Image:
    """Place the map on the left and a column of frames on the right."""
    height = plan.shape[0]
    if not frames:
        return plan
    each = (height - GAP_PX * (len(frames) - 1)) // len(frames)
    width = round(each * frames[0].shape[1] / frames[0].shape[0])
    column = np.full((height, width + GAP_PX, 3), PAPER, np.uint8)
    for i, frame in enumerate(frames):
        top = i * (each + GAP_PX)
        column[top : top + each, GAP_PX:] = cv2.resize(frame, (width, each), interpolation=cv2.INTER_CUBIC)
    return np.hstack([plan, column])


if __name__ == "__main__":
    main()
