"""Find anything a neural network was trained for, by its label: the user brings a model as an ONNX file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from weakref import WeakValueDictionary

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detection import Detection, Image, distinct
from nxtdrive.vision.detectors.onnx_isolation import try_in_subprocess, versions
from nxtdrive.vision.detectors.onnx_labels import label_number
from nxtdrive.vision.detectors.onnx_layouts import ModelDetections
from nxtdrive.vision.detectors.onnx_model import OPEN_SIZE, OnnxModel, Options
from nxtdrive.vision.detectors.spec import DetectorSpec

MIN_SCORE = 0.4
MAX_PLACES = 100
"""Number of the best places that are compared for overlaps."""


_LOADED: WeakValueDictionary[tuple[object, ...], OnnxModel] = WeakValueDictionary()


class OnnxDetector:
    """Finds the places to which a model gives one of its labels as the best one. The score is the model's.

    Args:
        path: The model. A damaged one can crash the process; `from_spec` tries it in another process before.
        label: One of the model's labels.
        options: What the file does not say.
        min_score: Least score of a detection, 0 to 1.

    Raises:
        ConfigError: The file is not a detector that can be run, or has no such label.
    """

    def __init__(self, path: Path, label: str, options: Options | None = None, *, min_score: float = MIN_SCORE) -> None:
        if not 0 < min_score < 1:
            raise ConfigError(f"min_score = {min_score:g} is not a valid score.", remedy="It lies between 0 and 1.")
        self._model = _loaded(path, options or Options())
        self._number = label_number(label, self._model.labels, path)
        self._min_score = min_score

    def description(self) -> dict[str, str]:
        """Return the model's own description, and how it is run."""
        return self._model.description()

    def detect(self, image: Image) -> list[Detection]:
        """Return all places to which the model gives the label, best first."""
        return self.detect_all([self], image)[0]

    @classmethod
    def detect_all(cls, detectors: Sequence[OnnxDetector], image: Image) -> list[list[Detection]]:
        """Return what each of several detectors finds, best first; those of the same model share its run."""
        models = {detector._model for detector in detectors}
        places = {model: model.places(image) for model in models}
        return [detector._named(image, *places[detector._model]) for detector in detectors]

    def _named(self, image: Image, places: ModelDetections, extent: NDArray[np.float64]) -> list[Detection]:
        """Return those of the model's places in the image that have the label."""
        wanted = np.flatnonzero((places.labels == self._number) & (places.scores >= self._min_score))
        best = wanted[np.argsort(-places.scores[wanted], kind="stable")][:MAX_PLACES]
        inside = np.tile((image.shape[1], image.shape[0]), 2)
        corners = np.rint((places.corners[best] * np.tile(extent, 2)).clip(0, inside)).astype(int)
        found = []
        for (left, top, right, bottom), score in zip(corners.tolist(), places.scores[best].tolist(), strict=True):
            if right > left and bottom > top:
                found.append(Detection((left, top, right - left, bottom - top), min(1.0, float(score))))
        return distinct(found)


def _loaded(path: Path, options: Options) -> OnnxModel:
    """Return a model, which is loaded once while detectors of several labels use it."""
    key = path.resolve(), options, versions(path, options.labels)
    if (model := _LOADED.get(key)) is None:
        model = _LOADED[key] = OnnxModel(path, options)
    return model


def from_spec(spec: DetectorSpec) -> OnnxDetector:
    """Make the detector from ``model``, ``label`` and what the file does not say (`Options`), after a trial."""
    path, label = spec.path(spec.take("model", str)), spec.take("label", str)
    texts = {name: spec.take_optional(name) for name in ("layout", "labels", "runtime", "colors", "normalisation")}
    if texts["labels"] is not None:
        texts["labels"] = str(spec.path(texts["labels"]))
    options = Options(size=spec.take("size", int, OPEN_SIZE), **texts)
    min_score = spec.take("min_score", float, MIN_SCORE)
    try_in_subprocess(path, asdict(options))
    return OnnxDetector(path, label, options, min_score=min_score)
