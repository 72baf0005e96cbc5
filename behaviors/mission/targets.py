"""The targets of a mission file: the options of each kind of detector."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Discriminator, Field, SerializerFunctionWrapHandler, Tag, model_serializer

from behaviors.detector_names import BUILT_IN_DETECTORS, installed_detectors
from behaviors.mission.robot import ColorName, Table
from behaviors.mission.usual_heights import default_height_mm

HEIGHT_MM = 10.0, 3000.0
"""Smallest and largest height of a target."""
MAX_TARGETS, MAX_PICTURES = 30, 20
"""Targets of a mission, and pictures of a target. One of 500x500 pixels takes 0.6 MB and 22 ms, so all take 13 s."""
Height = Annotated[float, Field(ge=HEIGHT_MM[0], le=HEIGHT_MM[1])]
MarkerFamily = Literal["aruco_4x4_50", "apriltag_36h11"]
OnnxLayout = Literal["yolox", "yolo", "e2e", "detr", "detr-post", "boxes", "yunet"]
OnnxRuntime = Literal["onnxruntime", "opencv"]
OnnxColors = Literal["bgr", "rgb"]
OnnxNormalisation = Literal["none", "unit", "imagenet"]
OTHER = "other"
"""Tag of the targets of installed detectors."""


class _Target(Table):
    """Keys that all targets have.

    Attributes:
        height_mm: Real height of what is detected.
    """

    height_mm: Height = 297.0


class PictureTarget(_Target):
    """Something flat of which there are photographs.

    Attributes:
        pictures: Image files, beside the mission file or among the built-in ones; 20 at most.
    """

    detector: Literal["picture"]
    pictures: list[str] = Field(min_length=1, max_length=MAX_PICTURES)


class HaarTarget(_Target):
    """What one of OpenCV's cascades finds, or your own cascade file.

    Attributes:
        cascade: Name of a cascade that comes with OpenCV, or an XML file.
    """

    detector: Literal["haar"]
    cascade: str = "haarcascade_frontalface_alt2"


class MarkerTarget(_Target):
    """A printed ArUco or AprilTag marker.

    Attributes:
        family: Its dictionary.
        id: Its number.
    """

    detector: Literal["marker"]
    family: MarkerFamily = "aruco_4x4_50"
    id: int = Field(ge=0)


class QrTarget(_Target):
    """A printed QR code.

    Attributes:
        text: What it says, all of it.
    """

    detector: Literal["qr"]
    text: str = Field(min_length=1, max_length=500)


class ColorTarget(_Target):
    """A patch of strong colour.

    Attributes:
        color: The name of the colour.
    """

    detector: Literal["color"]
    color: ColorName


class OnnxTarget(Table):
    """What a neural network finds that you have as an ONNX file.

    Attributes:
        model: The file, beside the mission file.
        label: One of the model's labels; `nxtdrive detect try` prints them.
        labels: A file with the labels, one per line, if the model does not name them.
        layout: How its outputs are arranged, if their shapes and names do not show it.
        runtime: What runs it; ONNX Runtime if that is installed, else OpenCV.
        size: Width and height of the model's input in pixels, if the model leaves them open.
        colors: Order of the colours, if it is not the one usual with the layout.
        normalisation: Range of the colours: 0 to 255, 0 to 1, or as for ImageNet; by default as usual with the layout.
        min_score: Minimum score of a detection.
        height_mm: Real height; without it one usual with the label counts until the robot has measured it by driving.
    """

    detector: Literal["onnx"]
    model: str
    label: str = Field(min_length=1, max_length=200)
    labels: str | None = None
    layout: OnnxLayout | None = None
    runtime: OnnxRuntime | None = None
    size: int = Field(default=416, ge=32, le=2048, multiple_of=32)
    colors: OnnxColors | None = None
    normalisation: OnnxNormalisation | None = None
    min_score: float = Field(default=0.4, gt=0, lt=1)
    height_mm: Height = Field(default_factory=lambda known: default_height_mm(str(known.get("label", ""))))

    @property
    def guessed(self) -> bool:
        """Whether its height is only that usual with the label."""
        return "height_mm" not in self.model_fields_set

    @model_serializer(mode="wrap")
    def _without_guess(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out a height that was not given, so that the mission that is read again does not give it either."""
        values: dict[str, Any] = dump(self)
        if self.guessed:
            values.pop("height_mm", None)
        return values


class ExternalTarget(_Target):
    """What the detector of an installed package finds; the package checks the other keys."""

    model_config = ConfigDict(extra="allow")

    detector: str


def _kind(target: object) -> str | None:
    """Return which of the classes describes a target; None if there is no such detector."""
    name = target.get("detector") if isinstance(target, dict) else getattr(target, "detector", None)
    if not isinstance(name, str) or name in BUILT_IN_DETECTORS:
        return name if isinstance(name, str) else None
    return OTHER if name in installed_detectors() else None


Target = Annotated[
    Annotated[PictureTarget, Tag("picture")]
    | Annotated[HaarTarget, Tag("haar")]
    | Annotated[MarkerTarget, Tag("marker")]
    | Annotated[QrTarget, Tag("qr")]
    | Annotated[ColorTarget, Tag("color")]
    | Annotated[OnnxTarget, Tag("onnx")]
    | Annotated[ExternalTarget, Tag(OTHER)],
    Discriminator(_kind),
]
