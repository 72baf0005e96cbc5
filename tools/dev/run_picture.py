"""Put a run's map and a few of its camera's pictures into one picture, as shown in the README.

``nxtdrive run`` and then
``python -m tools.dev.run_picture runs/lena-then-rilakkuma-001 docs/images/run.png``
"""

from __future__ import annotations

from pathlib import Path

import cv2
from PIL import Image

from behaviors.journal import RecordKind
from firmware_protocol.errors import ConfigError
from nxtdrive.drawing.sheet import PAPER, encoded
from nxtdrive.recording.camera_index import read_frames
from nxtdrive.recording.output_file import write_file
from nxtdrive.recording.run_folder import MAP
from nxtdrive.recording.run_reader import read_run

from .program import parser

MARGIN_PX, GAP_PX = 40, 16
MOMENTS = {"arrive": 1.0, "wait": -0.2, "reached": -0.2, "finished": -0.2}
"""States whose first entry is shown, and how many seconds later: an approach shows a second after it begins, the
cause of the others is visible a moment before them.
"""


def main() -> None:
    """Read a run folder and write the picture."""
    arguments = parser(__doc__)
    arguments.add_argument("folder", type=Path, help="a run folder")
    arguments.add_argument("out", type=Path, help="the picture to write")
    args = arguments.parse_args()
    try:
        plan = Image.open(args.folder / MAP).convert("RGB")
        frames = representative_frames(args.folder)
    except (ConfigError, OSError) as error:
        arguments.error(f"{args.folder} is not a run with a map: {error}")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    write_file(args.out, encoded(above(plan, frames), args.out))
    print(args.out)


def representative_frames(folder: Path) -> list[Image.Image]:
    """Return one frame each of a sighting, a wait, an arrival and the end, where there is one."""
    entered: dict[str, float] = {}
    for record in read_run(folder).records:
        if record.kind is RecordKind.TRANSITION:
            entered.setdefault(str(record.data["to"]), record.time_s)
    recorded = read_frames(folder)
    if not recorded:
        return []
    shown = [recorded.at(entered[state] + later_s) for state, later_s in MOMENTS.items() if state in entered]
    drawn = [recorded.drawn(each) for each in shown if each]
    return [Image.fromarray(cv2.cvtColor(each, cv2.COLOR_BGR2RGB)) for each in drawn if each is not None]


def above(plan: Image.Image, frames: list[Image.Image]) -> Image.Image:
    """Place the map above a row of frames."""
    if not frames:
        return plan
    width = (plan.width - 2 * MARGIN_PX - GAP_PX * (len(MOMENTS) - 1)) // len(MOMENTS)
    height = round(width * frames[0].height / frames[0].width)
    whole = Image.new("RGB", (plan.width, plan.height + height + MARGIN_PX), PAPER)
    whole.paste(plan)
    for i, frame in enumerate(frames):
        whole.paste(
            frame.resize((width, height), Image.Resampling.LANCZOS), (MARGIN_PX + i * (width + GAP_PX), plan.height)
        )
    return whole


if __name__ == "__main__":
    main()
