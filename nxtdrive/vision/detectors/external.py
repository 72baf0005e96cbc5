"""A detector of another package, wrapped so that its caller gets detections, or an error that names it."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from importlib.metadata import EntryPoint
from itertools import islice, pairwise
from traceback import walk_tb
from typing import Annotated, Any, TypeVar

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict, Field, TypeAdapter, ValidationError

from behaviors.ports import Cut
from firmware_protocol.errors import ConfigError, NXTError
from input_files.pydantic_words import words
from nxtdrive.signals import Terminated
from nxtdrive.vision.detection import Described, Detection, Detector, Image, Quad
from nxtdrive.vision.detectors.spec import DetectorSpec

MAX_DETECTIONS = 1000
"""Detections of a frame that are looked at, the best ones."""
MIN_TURN = 1.0
"""Minimum product of neighbouring sides, square pixels, whatever the direction."""
FAR_PX = 1_000_000
"""A box or corner beyond this, in pixels, is invalid."""
REMEDY = "Ask its author, or use another; `python -m pydoc nxtdrive.vision.detection` shows what one has."
FAILED_REMEDY = f"-v shows the traceback for its author. {REMEDY}"
SIDES = {2: "wide", 3: "high"}
"""What a box is, by the place of its size."""

T = TypeVar("T")


def _number(value: Any) -> float:  # noqa: ANN401 - also numpy's numbers
    try:
        number = float(value)
    except (TypeError, OverflowError):
        number = math.nan
    if math.isnan(number):
        raise ValueError("it is not a number")
    return number


def _whole(value: object) -> int:
    return round(max(-2.0 * FAR_PX, min(_number(value), 2.0 * FAR_PX)))


def _convex(quad: Quad) -> Quad:
    """Refuse corners of which three are collinear: no distance can be computed from those."""
    sides = [(u - last_u, v - last_v) for (last_u, last_v), (u, v) in pairwise((*quad, quad[0]))]
    turns = [a * d - b * c for (a, b), (c, d) in pairwise((*sides, sides[0]))]
    if min(turns) < MIN_TURN and max(turns) > -MIN_TURN:
        raise ValueError("its corners are not a convex quadrilateral")
    return quad


Coordinate = Annotated[float, BeforeValidator(_number), Field(ge=-FAR_PX, le=FAR_PX)]
Pixel = Annotated[int, BeforeValidator(_whole), Field(ge=-FAR_PX, le=FAR_PX)]
Side = Annotated[Pixel, Field(ge=1)]
Score = Annotated[
    float, BeforeValidator(_number), Field(ge=0, le=1 + 1e-6), AfterValidator(lambda score: min(score, 1.0))
]
Corner = tuple[Coordinate, Coordinate]
Corners = Annotated[tuple[Corner, Corner, Corner, Corner], AfterValidator(_convex)]


class _Found(BaseModel):
    """The required form of a detection; numpy's numbers count as numbers."""

    model_config = ConfigDict(from_attributes=True)

    box: tuple[Pixel, Pixel, Side, Side]
    score: Score
    quad: Corners | None = None
    cut: Cut = Cut.NONE
    bound: bool = False


_FOUND = TypeAdapter(list[_Found])


class ExternalDetector:
    """A detector that another package has made.

    Args:
        entry: Where it comes from.
        detector: The detector.
    """

    def __init__(self, entry: EntryPoint, detector: Detector) -> None:
        self._entry = entry
        self._detector = detector

    def detect(self, image: Image) -> list[Detection]:
        """Return the detections; the image is protected from changes.

        Raises:
            ConfigError: The detector fails, or does not return detections.
        """
        shown = image.view()
        shown.flags.writeable = False
        places = _called(
            self._entry, "fails", lambda: list(islice(_iterable(self._detector.detect(shown)), MAX_DETECTIONS))
        )
        try:
            found = _FOUND.validate_python(places, from_attributes=True)
        except ValidationError as error:
            mistake = _mistake_words(dict(error.errors()[0]))
            raise ConfigError(f"{_name(self._entry)} returns a wrong result: {mistake}.", remedy=REMEDY) from None
        return [Detection(each.box, each.score, each.quad, each.cut, each.bound) for each in found]


class DescribedExternalDetector(ExternalDetector):
    """An external detector with a description."""

    def description(self) -> Mapping[str, str]:
        """Return its description.

        Raises:
            ConfigError: It fails.
        """
        described: Any = self._detector
        return _called(
            self._entry, "fails", lambda: {str(key): str(text) for key, text in described.description().items()}
        )


def make_external(entry: EntryPoint, spec: DetectorSpec) -> ExternalDetector:
    """Have another package make its detector.

    Raises:
        ConfigError: It fails, or does not make a detector.
    """
    detector: Detector = _called(entry, "cannot be made", lambda: entry.load()(spec))
    if not callable(getattr(detector, "detect", None)):
        raise ConfigError(f"{_name(entry)} has no detect().", remedy=REMEDY)
    kind = DescribedExternalDetector if isinstance(detector, Described) else ExternalDetector
    return kind(entry, detector)


def _iterable(value: object) -> Iterable[object]:
    if not isinstance(value, list | tuple):
        raise TypeError(f"detect() returned {type(value).__name__}, not a list")
    return value


def _called(entry: EntryPoint, what: str, work: Callable[[], T]) -> T:
    """Call code of another package and return its result.

    Raises:
        ConfigError: It raises anything.
    """
    try:
        return work()
    except (NXTError, Terminated):
        raise
    except (Exception, SystemExit) as error:
        reason = f"{what}{_place(entry, error)}: {type(error).__name__}: {error}"
        raise ConfigError(f"{_name(entry)} {reason}.", remedy=FAILED_REMEDY) from error


def _name(entry: EntryPoint) -> str:
    return f"the detector {entry.name!r} ({entry.value})"


def _place(entry: EntryPoint, error: BaseException) -> str:
    """Return the last line of the detector's package in a traceback, in words; empty if there is none."""
    package = entry.module.partition(".")[0]
    for frame, line in reversed(list(walk_tb(error.__traceback__))):
        if frame.f_globals.get("__name__", "").partition(".")[0] == package:
            return f" at {frame.f_code.co_filename}:{line}"
    return ""


def _mistake_words(mistake: Mapping[str, Any]) -> str:
    """Describe which detection is wrong, and how."""
    number, *where = mistake["loc"]
    kind, context = mistake["type"], mistake.get("ctx", {})
    match where:
        case []:
            return f"detection {number} is a {type(mistake['input']).__name__}, not a Detection"
        case ["box", 2 | 3 as side] if kind == "greater_than_equal":
            return f"detection {number}: its box must be at least one pixel {SIDES[int(side)]}"
        case ["box", _] if kind == "missing":
            return f"detection {number}: its box must have 4 entries"
        case ["cut", *_]:
            return f"detection {number}: its cut must be a Cut"
    place = ".".join(map(str, where))
    return f"detection {number}: {place}: {words(kind, context, mistake['msg'], mistake['input'])}"
