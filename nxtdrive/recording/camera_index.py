"""The index of a run's camera frames: when each was taken, and the detections in it.

``camera/index.jsonl`` begins with a line of `Header`; each further line is a `RecordedFrame`. docs/journal.md describes
both.
"""

from __future__ import annotations

import bisect
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self, TypeVar

import cv2
import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, model_validator

from behaviors.ports import Sighting
from input_files.json_text import MAX_BYTES
from input_files.picture import MAX_PIXELS, read_picture
from input_files.plain import MEGABYTE, InputFileError, read_text
from nxtdrive.recording.run_folder import CAMERA
from nxtdrive.vision.annotate import annotate
from nxtdrive.vision.detection import Box, Detection, Image

INDEX = "index.jsonl"
FILE_NAME = r"[0-9]{6,9}\.jpg"
"""Pattern of the names of frames; none leads out of the folder."""
MAX_FRAME_BYTES = 20 * MEGABYTE
MAX_SIZE_PX = 20_000
MAX_TIME_S = 100_000.0
"""More than a day; a video is as long as its frames say."""

Model = TypeVar("Model", bound=BaseModel)
Pixels = Annotated[int, Field(ge=-MAX_SIZE_PX, le=MAX_SIZE_PX)]
Coordinate = Annotated[float, Field(ge=-MAX_SIZE_PX, le=MAX_SIZE_PX)]
Corner = tuple[Coordinate, Coordinate]
Size = Annotated[int, Field(ge=1, le=MAX_SIZE_PX)]


class _Line(BaseModel):
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class Header(_Line):
    """First line: version of the format, size of the frames in pixels, frames a second at most."""

    version: Literal[1]
    width: Size
    height: Size
    fps: Annotated[float, Field(gt=0, le=1000)]

    @model_validator(mode="after")
    def _fits_in_memory(self) -> Self:
        if self.width * self.height > MAX_PIXELS:
            raise ValueError("more pixels than a frame may have")
        return self


class Found(_Line):
    """A place in a frame where a detector found its target; see `nxtdrive.vision.detection.Detection`."""

    box: tuple[Pixels, Pixels, Pixels, Pixels]
    score: float
    quad: tuple[Corner, Corner, Corner, Corner] | None = None


class Seen(_Line):
    """A target that was recognised; see `behaviors.ports.Sighting`."""

    bearing_deg: float
    distance_mm: float
    confidence: float
    box: tuple[Pixels, Pixels, Pixels, Pixels]
    bound: bool = False


class Look(_Line):
    """The result of a look for a target in a frame."""

    target: str
    sighting: Seen | None = None
    found: tuple[Found, ...] = ()


class RecordedFrame(_Line):
    """A frame: when it was taken (seconds of mission time), its file in the folder, and the looks that used it."""

    t: Annotated[float, Field(ge=0, le=MAX_TIME_S)]
    file: Annotated[str, Field(pattern=f"^{FILE_NAME}$")]
    looks: tuple[Look, ...] = ()


@dataclass(frozen=True, slots=True)
class RecordedFrames:
    """The camera's frames of a run.

    Attributes:
        folder: Where they are.
        header: Their size and rate.
        frames: In order of time.
    """

    folder: Path
    header: Header
    frames: tuple[RecordedFrame, ...]

    def at(self, time_s: float) -> RecordedFrame | None:
        """Return the latest frame at a mission time; None before the first."""
        number = bisect.bisect_right(self.frames, time_s, key=lambda frame: frame.t)
        return self.frames[number - 1] if number else None

    def drawn(self, frame: RecordedFrame, caption: str = "") -> Image | None:
        """Return a frame with boxes and caption in the size of the header; None if it cannot be read."""
        try:
            image = read_picture(self.folder / frame.file)
        except InputFileError:
            return None
        size = self.header.width, self.header.height
        if image.shape[1::-1] != size:
            image = np.asarray(cv2.resize(image, size), np.uint8)
        for look in frame.looks:
            found = [Detection(one.box, one.score, one.quad) for one in look.found]
            image = annotate(image, sighting_of(look, frame.t), found)
        return annotate(image, None, (), caption)


def read_frames(run_folder: Path) -> RecordedFrames | None:
    """Read the index of a run's frames, even of a run that was killed; lines that are damaged are left out.

    Args:
        run_folder: The run folder.

    Returns:
        None for a run without frames, or whose index does not begin with a header that this version supports.
    """
    folder = run_folder / CAMERA
    try:
        first, *lines = read_text(folder / INDEX, MAX_BYTES).split("\n")
    except InputFileError:
        return None
    header = _parsed(Header, first)
    if header is None:
        return None
    frames = [frame for line in lines if (frame := _parsed(RecordedFrame, line))]
    return RecordedFrames(folder, header, tuple(sorted(frames, key=lambda frame: frame.t)))


def looked(target: str, sighting: Sighting | None, found: Sequence[Detection]) -> Look:
    """Return the result of a look, for the index."""
    return Look(target=target, sighting=_seen(sighting) if sighting else None, found=tuple(map(_found, found)))


def _seen(sighting: Sighting) -> Seen:
    return Seen(
        bearing_deg=round(sighting.bearing_deg, 3),
        distance_mm=round(sighting.distance_mm, 3),
        confidence=round(sighting.confidence, 3),
        box=_whole(sighting.box),
        bound=sighting.bound,
    )


def _found(one: Detection) -> Found:
    return Found.model_validate({"box": _whole(one.box), "score": round(float(one.score), 3), "quad": one.quad})


def _whole(box: Box) -> Box:
    left, top, width, height = map(round, box)
    return left, top, width, height


def sighting_of(look: Look, time_s: float) -> Sighting | None:
    """Return the sighting of a look at a frame that was taken at a mission time; None if it recognised nothing."""
    seen = look.sighting
    if seen is None:
        return None
    place = seen.bearing_deg, seen.distance_mm
    return Sighting(look.target, *place, seen.confidence, time_s, seen.box, bound=seen.bound)


def _parsed(model: type[Model], line: str) -> Model | None:
    try:
        return model.model_validate_json(line)
    except ValidationError:
        return None
