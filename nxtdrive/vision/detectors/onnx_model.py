"""A model from an ONNX file: loads it, runs it on frames, and says which labels it found where."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from threading import Lock

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from firmware_protocol.wording import number_of
from nxtdrive.vision.detection import Image
from nxtdrive.vision.detectors.onnx_file import read_onnx
from nxtdrive.vision.detectors.onnx_input import COLORS, GRAY, LARGEST, NORMALISATIONS, fitted, image_input
from nxtdrive.vision.detectors.onnx_labels import coco_labels, labels_in, listed, read_labels
from nxtdrive.vision.detectors.onnx_layouts import LAYOUTS, ModelDetections, OutputLayout, decode, find_layout
from nxtdrive.vision.detectors.onnx_runtimes import RUNTIMES, load

OPEN_SIZE = 416
"""Width and height in pixels for a model that leaves them open."""
MULTIPLE = 32
"""All layouts need a multiple of this."""

MIN_FACE, FACES_OVERLAP = 0.05, 0.3
"""Minimum score with which YuNet reports a place, and how much of two faces may be the same."""


@dataclass(frozen=True, slots=True)
class Options:
    """Facts about a model that its file does not state.

    Attributes:
        layout: One of `LAYOUTS`; by default what the outputs fit.
        labels: A file with the labels, in the model's order; by default those of the metadata.
        runtime: ``onnxruntime`` or ``opencv``; by default the first one that is installed.
        size: Width and height in pixels of the model's input where the file leaves them open.
        colors: ``bgr`` or ``rgb``; by default as usual with the layout.
        normalisation: ``none`` (0 to 255), ``unit`` (0 to 1) or ``imagenet``; by default as usual with the layout,
            and ``none`` where the model takes bytes.
    """

    layout: str | None = None
    labels: str | None = None
    runtime: str | None = None
    size: int = OPEN_SIZE
    colors: str | None = None
    normalisation: str | None = None

    def __post_init__(self) -> None:
        choices = {"layout": LAYOUTS, "runtime": RUNTIMES, "colors": COLORS, "normalisation": NORMALISATIONS}
        for name, known in choices.items():
            value = getattr(self, name)
            if value not in (None, *known):
                raise ConfigError(f"there is no {name} {value!r}.", remedy=f"Use one of: {', '.join(known)}.")
        if not MULTIPLE <= self.size <= LARGEST or self.size % MULTIPLE:
            remedy = f"Use a multiple of {MULTIPLE} up to {LARGEST}, such as {OPEN_SIZE}."
            raise ConfigError(f"a model cannot get frames of {self.size} pixels.", remedy=remedy)


class OnnxModel:
    """A model that was loaded; a damaged one can crash the process that loads it.

    Args:
        path: The file.
        options: What it does not say.

    Raises:
        ConfigError: It is not a detector that can be run.

    Attributes:
        labels: Its labels; empty if nothing names them.
    """

    def __init__(self, path: Path, options: Options) -> None:
        self._file, self._options = read_onnx(path), options
        self._running = Lock()  # OpenCV's networks run in one thread at a time
        self._input = image_input(self._file, options.size)
        if self._input.tensor.dtype == "uint8" and options.normalisation not in (None, "none"):
            raise ConfigError(
                f"{path} takes whole numbers from 0 to 255, not normalisation {options.normalisation!r}.",
                remedy='Leave normalisation out, or set it to "none".',
            )
        self._runtime = load(path, options.runtime)
        named = labels_of(path, options.labels)
        size = self._input.width or OPEN_SIZE, self._input.height or OPEN_SIZE
        gray = np.full((size[1], size[0], 3), GRAY, np.uint8)
        outputs = self._runtime.run(self._input.arrays(gray, "rgb", "none"))
        self._layout = find_layout(self._file, outputs, size, len(named), options.layout)
        self._preparation = _usual(self._layout, self._input.tensor.dtype)
        self._faces: cv2.FaceDetectorYN | None = None
        if self._layout.name == "yunet":
            self._faces = _face_detector(path)
        self.labels = self._named(named)
        self._assumed = bool(self.labels) and not named and self._layout.name != "yunet"

    def places(self, image: Image) -> tuple[ModelDetections, NDArray[np.float64]]:
        """Return the places found in a BGR frame, and width and height of the frame of which their corners are shares.

        Raises:
            ConfigError: It cannot be run.
        """
        with self._running:
            return self._places(image)

    def _places(self, image: Image) -> tuple[ModelDetections, NDArray[np.float64]]:
        small, scale = fitted(image, self._input.size_for(image), stretched=self._layout.stretched)
        size = small.shape[1], small.shape[0]
        if self._faces is not None:
            found = _find_faces(self._faces, small)
        else:
            colors, normalisation = self._preparation
            given = self._options.colors or colors, self._options.normalisation or normalisation
            found = decode(self._layout, self._runtime.run(self._input.arrays(small, *given)), size)
        return found, np.array(size) / scale

    def description(self) -> dict[str, str]:
        """Return the model's own description, and how it is run."""
        about = self._file.metadata
        licence = next((text for key, text in about.items() if "licen" in key.casefold()), "")
        side = self._input.width, self._input.height
        size = f"{side[0]}x{side[1]} pixels" if all(side) else "frames as they are"
        assumed = "the file names none; taken as COCO's: " if self._assumed else ""
        runtime = self._runtime.title if self._faces is None else f"OpenCV {cv2.__version__}"
        return {
            "model": f"{self._file.path}, layout {self._layout.name}, {size}, {runtime}",
            "labels": assumed + listed(self.labels) or "the file names none; a label is a number",
            "licence": licence[:200] or "the file names none; ask where it comes from",
            **{key: about[key][:200] for key in ("author", "description", "version", "producer") if about.get(key)},
        }

    def _named(self, named: tuple[str, ...]) -> tuple[str, ...]:
        """Return the labels, at most as many as the model distinguishes."""
        count = self._layout.label_count
        if count is not None and len(named) > count:
            raise ConfigError(
                f"{self._file.path} has {number_of(count, 'label')}, but {len(named)} are named.",
                remedy="Give the file with the labels that this model was trained with.",
            )
        if self._layout.name == "yunet":
            return ("face",)
        return named or coco_labels(count or self._layout.coco_label_count)


def labels_of(path: Path, file: str | None = None) -> tuple[str, ...]:
    """Return the labels in a file, or else those that the model names in its metadata.

    Raises:
        ConfigError: One of them cannot be read.
    """
    return read_labels(Path(file)) if file else labels_in(read_onnx(path).metadata)


def _usual(layout: OutputLayout, dtype: str) -> tuple[str, str]:
    """Return the order of the colours and the normalisation with which a layout's models are trained."""
    if layout.name == "yolox" and layout.anchors == 1:
        return "bgr", "none"
    if dtype == "uint8":  # bytes, which the model normalises itself
        return "rgb", "none"
    # RF-DETR calls its boxes so
    return "rgb", "imagenet" if layout.name == "detr" and layout.roles["boxes"] == "dets" else "unit"


def _face_detector(path: Path) -> cv2.FaceDetectorYN:
    try:
        return cv2.FaceDetectorYN.create(str(path), "", (OPEN_SIZE, OPEN_SIZE), MIN_FACE, FACES_OVERLAP)
    except cv2.error as error:
        raise ConfigError(f"OpenCV cannot load {path} as YuNet: {error}", remedy="Use the one of 2023.") from None


def _find_faces(detector: cv2.FaceDetectorYN, image: Image) -> ModelDetections:
    size = image.shape[1], image.shape[0]
    try:
        detector.setInputSize(size)
        _, faces = detector.detect(image)
    except cv2.error as error:
        raise ConfigError(f"OpenCV cannot run YuNet: {error}", remedy="Use the one of 2023.") from None
    found = np.empty((0, 15), np.float32) if faces is None else np.asarray(faces, np.float32)
    corners = np.concatenate([found[:, :2], found[:, :2] + found[:, 2:4]], axis=1) / np.tile(size, 2)
    usable = np.isfinite(found).all(axis=1)
    return ModelDetections(corners[usable], found[usable, 14], np.zeros(int(usable.sum()), np.int64))
