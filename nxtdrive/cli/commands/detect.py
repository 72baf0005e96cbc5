"""``nxtdrive detect``: tries a detector on a picture, a video or a camera."""

from __future__ import annotations

import argparse
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, closing, suppress
from dataclasses import asdict, dataclass
from itertools import count
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from input_files.plain import IMAGE_SUFFIXES, at_home
from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_action, add_json_argument, check_not_read, check_writable, number
from nxtdrive.cli.output import write_json, write_line
from nxtdrive.cli.target_options import add_target_arguments, chosen_target, height_source
from nxtdrive.host.writing import writing

if TYPE_CHECKING:
    from nxtdrive.vision.camera import Frame
    from nxtdrive.vision.detection import Detection, Image, TargetDetector
    from nxtdrive.vision.geometry import Pinhole

DESCRIPTION = """\
Try a detector on an image, a video, a folder of images, a stream's URL or a
webcam's number, without a brick: it draws the detections, and prints their places
and the time taken. The source `sim` is the camera of the simulated robot. Bearings
are positive to the right."""
EXAMPLES = """\
  nxtdrive detect try 0 --picture my-cat.jpg
  nxtdrive detect try photo.jpg --target lena
  nxtdrive detect try sim --color orange --frames 5
  nxtdrive detect try 0 --marker 7 --height-mm 150 --frames 50
  nxtdrive detect try 0 --qr "7" --height-mm 160
  nxtdrive detect try 0 --onnx yolox_s.onnx --label cup
  nxtdrive detect try film.mp4 --haar haarcascade_profileface --out seen.webm
  nxtdrive detect try http://127.0.0.1:8081/camera.mjpg --color red"""

CAMERA_FRAMES = 100
"""Default number of frames taken from a live camera."""

VIDEO_FPS = 10
"""Frame rate of the annotated video, whatever the interval between the frames was."""

READ_TIMEOUT_S = 5.0


@dataclass(frozen=True, slots=True)
class FoundTarget:
    """One detection of the target.

    Attributes:
        bearing_deg: Positive right.
        distance_mm: Estimated from the apparent height; an upper bound where the target is cut off.
        score: 0..1 as the detector grades it.
        box: Left, top, width, height in pixels.
        cut: Sides at which the frame cuts the target off: left, top, right, bottom.
    """

    bearing_deg: float
    distance_mm: float
    score: float
    box: tuple[int, int, int, int]
    cut: list[str]


@dataclass(frozen=True, slots=True)
class FrameDetections:
    """The detections in one frame.

    Attributes:
        frame: Number of the frame.
        ms: Time the detector took, milliseconds.
        found: All detections, best first.
    """

    frame: int
    ms: float
    found: list[FoundTarget]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare ``try`` and its arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    try_ = add_action(actions, "try", "run a detector and draw its detections", _try)
    try_.add_argument("source", metavar="SOURCE", help="image, video, folder of images, URL, a webcam's number, or sim")
    try_.usage = (
        "%(prog)s [options] SOURCE\n"
        "    (--target NAME | --picture FILE ... | --haar NAME | --marker ID |\n"
        "     --qr TEXT | --color C | --onnx FILE --label NAME)"
    )
    add_target_arguments(try_)
    try_.add_argument(
        "--hfov-deg",
        metavar="DEG",
        type=number("angle", float, 1, 179),
        help="the camera's horizontal field of view (default: that of the mission or the robot file, else 60)",
    )
    try_.add_argument("--out", metavar="FILE", type=Path, help="*.png or *.webm (default: detected.png, detected.webm)")
    try_.add_argument(
        "--frames",
        metavar="N",
        type=number("frames", int, 1, math.inf),
        help="largest number of frames (default: all of a recording, 100 of a camera)",
    )
    add_json_argument(try_)


def _try(args: argparse.Namespace) -> int:
    from nxtdrive.mission.detectors import codes_in
    from nxtdrive.mission.vision import pinhole
    from nxtdrive.vision.detection import Described

    args.source = "sim" if args.source == "sim://" else args.source
    target = chosen_target(args)
    name, detector, camera = target.name, target.detector, target.camera
    if args.hfov_deg is not None:
        camera = camera.model_copy(update={"hfov_deg": args.hfov_deg})
    still = _is_image(args.source)
    out = args.out or Path("detected.png" if still else "detected.webm")
    source = at_home(args.source)
    in_source = _is_image(out) and out.resolve().parent == source.resolve()
    check_not_read(out, out if in_source else source, *map(at_home, target.pictures))
    drawing = _AnnotatedOutput(out)
    looks: list[FrameDetections] = []
    others: set[str] = set()
    about = dict(detector.detector.description()) if isinstance(detector.detector, Described) else {}
    if args.target is None and args.height_mm is None:
        about["height"] = f"{detector.height_mm:g} mm, {height_source(args)}; measure yours and give --height-mm"
    if not args.json:
        for title, text in about.items():
            write_line(f"{title}: {text}")
    try:
        for frame in _frames(args.source, args.mission, 1 if still else args.frames):
            height, width = frame.image.shape[:2]
            look, detections = _look(frame, detector, pinhole((width, height), camera))
            drawing.add(_drawn(frame, name, look, detections), seen=bool(look.found))
            looks.append(look)
            if not look.found:
                others.update(codes_in(frame.image, detector.detector))
            if not args.json:
                write_line(_line(name, look))
    except KeyboardInterrupt:
        pass  # write what has been recorded so far
    finally:
        drawing.close()
    if others and not args.json:
        write_line(f"read instead: {', '.join(sorted(others))}")
    return _report(looks, drawing.path, about, args.json)


def _is_image(source: str | Path) -> bool:
    path = at_home(source)
    return path.suffix.lower() in IMAGE_SUFFIXES and os.path.isfile(path)


def _frames(source: str, mission: Path | None, limit: int | None) -> Iterator[Frame]:
    """Yield the source's frames until its end or the limit; a simulated robot is in the mission's own room."""
    from nxtdrive.brick import open_brick
    from nxtdrive.mission.files import in_own_room
    from nxtdrive.transports.address import Address
    from nxtdrive.transports.base import WallClock
    from nxtdrive.vision.camera import EndOfFrames
    from nxtdrive.vision.sources import open_camera

    simulated = source == "sim"
    if limit is None and (simulated or source.isdecimal() or "://" in source or source.startswith("/dev/")):
        limit = CAMERA_FRAMES
    with ExitStack() as stack:
        brick = stack.enter_context(open_brick(in_own_room(Address.parse("sim://"), mission))) if simulated else None
        clock = brick or WallClock()
        camera = stack.enter_context(closing(open_camera(source, clock=clock, paced=False)))
        stack.enter_context(suppress(EndOfFrames))
        for _ in count() if limit is None else range(limit):
            yield camera.read(READ_TIMEOUT_S)


def _look(frame: Frame, target: TargetDetector, pinhole: Pinhole) -> tuple[FrameDetections, list[Detection]]:
    from nxtdrive.transports.base import WallClock
    from nxtdrive.vision.cut_off import marked

    clock = WallClock()
    begun = clock.now()
    detections = marked(target.detector.detect(frame.image), *frame.image.shape[1::-1])
    ms = (clock.now() - begun) * 1000
    places = ((one, *pinhole.locate(one, target.height_mm)) for one in detections)
    found = [
        FoundTarget(round(deg, 2), round(mm), round(one.score, 3), one.box, one.cut.names) for one, deg, mm in places
    ]
    return FrameDetections(frame.index, round(ms, 2), found), detections


def _drawn(frame: Frame, name: str, look: FrameDetections, detections: list[Detection]) -> Image:
    from behaviors.ports import Sighting
    from nxtdrive.vision.annotate import annotate

    sighting = None
    if look.found:
        best = look.found[0]
        place = best.bearing_deg, best.distance_mm
        sighting = Sighting(name, *place, best.score, frame.time_s, best.box, bound=bool(best.cut))
    return annotate(frame.image, sighting, detections)


def _line(name: str, look: FrameDetections) -> str:
    if not look.found:
        return f"frame {look.frame:4}  nothing  {look.ms:.1f} ms"
    return f"frame {look.frame:4}  {name} at {', '.join(map(_place, look.found))}  {look.ms:.1f} ms"


def _place(one: FoundTarget) -> str:
    distance, cut = f"{one.distance_mm} mm", ""
    if one.cut:
        distance, cut = f"at most {distance}", f", cut off at {' and '.join(one.cut)}"
    return f"{one.bearing_deg:+z.1f} deg {distance} (score {one.score:.2f}{cut})"


def _report(looks: list[FrameDetections], path: Path, about: Mapping[str, str], as_json: bool) -> int:
    seen = sum(bool(look.found) for look in looks)
    median_ms = median(look.ms for look in looks) if looks else math.nan
    if as_json:
        details: dict[str, object] = {
            "frames": len(looks),
            "seen": seen,
            "median_ms": round(median_ms, 2) if looks else None,
            "out": str(path) if looks else None,
        }
        details |= {"detector": about} if about else {}
        write_json({**details, "looks": [asdict(look) for look in looks]}, indent=2)
    elif looks:
        frames = number_of(len(looks), "frame")
        write_line(f"seen in {seen} of {frames}, {median_ms:.1f} ms per frame (median); drawn into {path}")
    return DONE


class _AnnotatedOutput:
    """Writes the annotated frames: a video, or one image of the last frame that shows the target."""

    def __init__(self, path: Path) -> None:
        from nxtdrive.recording.video import VideoRecorder

        suffix = path.suffix.lower()
        if suffix not in (".png", ".webm"):
            raise ConfigError(f"{path} is neither *.png nor *.webm.", remedy="Give --out one of these suffixes.")
        self.path = path
        self._recorder = VideoRecorder(path, VIDEO_FPS) if suffix == ".webm" else None
        self._count = 0
        self._size: tuple[int, int] | None = None
        self._last: Image | None = None
        if self._recorder is None:
            check_writable(path)

    def add(self, image: Image, *, seen: bool) -> None:
        if self._recorder is None:
            self._last = image if seen or self._last is None else self._last
            return
        self._recorder.add(self._fitted(image), self._count / VIDEO_FPS)
        self._count += 1

    def close(self) -> None:
        from nxtdrive.recording.output_file import write_image

        with writing(self.path):
            if self._recorder is not None:
                self._recorder.close()
            elif self._last is not None:
                write_image(self.path, self._last)

    def _fitted(self, image: Image) -> Image:
        """Resize to the first image's size: folders may hold images of several sizes, a video has one."""
        import cv2
        import numpy as np

        if self._size is None:
            self._size = image.shape[1], image.shape[0]
        return np.asarray(cv2.resize(image, self._size), np.uint8)
