"""How detectors number and arrange their outputs: which layout a model has, and how to decode it.

| layout | outputs |
|---|---|
| ``yolox`` | (1, N, 5 + C), of YOLOv5 (1, 3 N, 5 + C): centre and size, objectness, scores; N cells of `STRIDES` |
| ``yolo`` | (1, 4 + C, N), or (1, N, 4 + C) if the labels are known: centre and size in pixels, scores |
| ``e2e`` | (1, N, 6): corners in pixels, score, label; or (N, 7): number of the image, corners, label and score |
| ``detr`` | logits (1, Q, C) and boxes (1, Q, 4): centre and size as shares of the frame, or corners in pixels |
| ``detr-post`` | labels, boxes, scores; a second input takes the size of the frame |
| ``boxes`` | boxes (N, 4): corners in pixels, labels and scores (N); or boxes with their score (N, 5), and labels |
| ``yunet`` | of the face detector YuNet, which OpenCV decodes |
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors.onnx_export_notes import ExportNotes, export_notes
from nxtdrive.vision.detectors.onnx_file import OnnxFile
from nxtdrive.vision.detectors.onnx_runtimes import Arrays

LAYOUTS = ("yolox", "yolo", "e2e", "detr", "detr-post", "boxes", "yunet")
STRETCHING_LAYOUTS = ("detr", "detr-post", "boxes")
"""Layouts whose models get the frame stretched to their size."""
STRIDES = (8, 16, 32)
ANCHORS = 3
"""Boxes for each cell in YOLOv3, YOLOv5 and YOLOv7; YOLOX has one."""
YUNET_OUTPUTS = {f"{part}_{stride}" for part in ("cls", "obj", "bbox", "kps") for stride in STRIDES}

SHARES = 2.0
"""Corners that are all below this many pixels are shares of the frame: no target has two pixels."""
LARGEST_EXPONENT = 20.0
"""Of the size of a box in cells; a larger one is damaged."""

Floats = NDArray[np.floating[Any]]


@dataclass(frozen=True, slots=True)
class OutputLayout:
    """The meaning of a model's outputs.

    Attributes:
        name: One of `LAYOUTS`.
        roles: Name of the output that has ``boxes``, ``scores`` and ``labels``, or ``all``.
        label_count: Number of labels, None if the outputs do not show it.
        in_rows: For ``yolo``: a label is a row, not a column.
        raw: For ``yolox``: centre and size are relative to the cells.
        anchors: For ``yolox``: boxes for each cell, 1 or 3.
        numbered: For ``e2e``: a place begins with the number of its image.
        in_pixels: For ``detr``: boxes are corners in pixels.
        notes: What the metadata say.
    """

    name: str
    roles: Mapping[str, str]
    label_count: int | None = None
    in_rows: bool = True
    raw: bool = False
    anchors: int = 1
    numbered: bool = False
    in_pixels: bool = False
    notes: ExportNotes = field(default_factory=ExportNotes)

    @property
    def stretched(self) -> bool:
        """Whether frames are stretched to the input's shape, not padded."""
        return (self.name in STRETCHING_LAYOUTS and not self.in_pixels) or self.notes.rt_detr

    @property
    def coco_label_count(self) -> int:
        """Number of labels of a model trained on COCO whose outputs do not show it: 91 of torchvision's, else 80.

        Source: RT-DETR's rtdetr_postprocessor.py in `deploy_mode`, YOLOv10's export, MMDeploy's `dets` and `labels`;
        torchvision's detectors number as COCO itself.
        """
        return 91 if self.name == "boxes" and "scores" in self.roles else 80


@dataclass(frozen=True, slots=True)
class ModelDetections:
    """The places that a model found.

    Attributes:
        corners: (N, 4): left, top, right and bottom, as shares of the image that was given to it.
        scores: (N): 0 to 1.
        labels: (N): number of the label.
    """

    corners: Floats
    scores: Floats
    labels: NDArray[np.int64]


def find_layout(
    model: OnnxFile, outputs: Arrays, size: tuple[int, int], named: int, wanted: str | None = None
) -> OutputLayout:
    """Return the layout of a model.

    Args:
        model: The file.
        outputs: Its outputs for any image.
        size: Width and height of that.
        named: Number of labels the model names, 0 if it names none.
        wanted: The layout, if the user gives it.

    Raises:
        ConfigError: The outputs fit no layout, or not the wanted one.
    """
    shapes = {name: value.shape for name, value in outputs.items()}
    flat = {name: shape for name, shape in shapes.items() if len(shape) < 4} or shapes  # masks and feature maps are not
    notes = export_notes(model.metadata)
    found = _alone(flat, size, named, wanted, notes) if len(flat) == 1 else _together(model, flat, wanted)
    if found is not None and found.numbered and outputs[found.roles["all"]][:, 0].any():
        found = None  # seven numbers of another kind: there is one image, number 0
    if found is None or (wanted is not None and found.name != wanted):
        raise _unfit(model, shapes, wanted)
    if found.name == "yolox":
        rows = _rows(outputs[found.roles["all"]])
        anchors = ANCHORS if len(rows) > len(_cells(size)[1]) else 1
        relative = anchors == 1 and _relative(rows.astype(np.float32), size)
        return replace(found, raw=relative, anchors=anchors)
    if found.name == "detr":
        beyond = np.abs(outputs[found.roles["boxes"]]) > SHARES
        return replace(found, in_pixels=bool(2 * beyond.sum() > beyond.size))
    return found


def decode(layout: OutputLayout, outputs: Arrays, size: tuple[int, int]) -> ModelDetections:
    """Decode a model's outputs.

    Args:
        layout: As `find_layout` returned it.
        outputs: Of the model.
        size: Width and height of the image that was given to it.
    """
    parts = {role: np.asarray(outputs[name], np.float32) for role, name in layout.roles.items()}
    with np.errstate(all="ignore"):
        if layout.name == "e2e":
            rows = _rows(parts["all"])
            rows = _without_number(rows) if layout.numbered else rows
            corners = rows[:, :4]
            if layout.notes.rt_detr or layout.notes.oriented:
                corners = _corners(corners, rows[:, -1] if layout.notes.oriented else None)
            return _places(_shares(corners, size), rows[:, 4], rows[:, 5])
        if layout.name in ("yolox", "yolo"):
            return _dense(layout, _rows(parts["all"]), size)
        if layout.name == "detr":
            boxes = parts["boxes"].reshape(-1, 4)
            return _queries(_shares(boxes, size) if layout.in_pixels else _corners(boxes), parts["scores"])
        boxes = _rows(parts["boxes"])
        scores = parts["scores"].reshape(-1) if "scores" in parts else boxes[:, 4]
        corners = boxes[:, :4]
        if layout.name == "boxes":  # a detr-post model was given one pixel as the size of the frame
            corners = _shares(corners, size)
        return _places(corners, scores, parts["labels"].reshape(-1))


def _alone(
    shapes: Mapping[str, Sequence[int]], size: tuple[int, int], named: int, wanted: str | None, notes: ExportNotes
) -> OutputLayout | None:
    """Return the layout of a single output."""
    ((name, shape),) = shapes.items()
    if len(shape) < 2 or any(side != 1 for side in shape[:-2]):
        return None
    roles, (rows, columns) = {"all": name}, shape[-2:]
    cells = len(_cells(size)[1])
    box = 4 + notes.oriented  # centre, size and perhaps an angle
    by_rows, by_columns = rows - box, columns - box  # labels of ``yolo``, if each has a row or a column
    in_rows = named == by_rows if named in (by_rows, by_columns) else columns > rows
    numbered = len(shape) == 2 and columns == 7
    more = wanted == "e2e" or notes.chosen  # beyond the sixth column are coefficients of a mask, keypoints, or an angle
    fits = {
        "yolox": columns >= 6 and rows in (cells, ANCHORS * cells) and (wanted == "yolox" or named in (0, columns - 5)),
        "e2e": columns >= 6 if more else numbered or (columns == 6 and (named != 2 or rows not in (6, cells))),
        "yolo": min(rows, columns) >= 5 and (wanted == "yolo" or columns > rows or named in (by_rows, by_columns)),
    }
    shown = by_rows if in_rows else by_columns
    # what is beyond the named labels are keypoints, or coefficients of a mask
    counts = {"yolox": columns - 5, "yolo": named if 0 < named < shown else shown, "e2e": None}
    likely = ("e2e", "yolox", "yolo") if notes.chosen else fits
    chosen = wanted if wanted in fits else next((each for each in likely if fits[each]), None)
    if not chosen or not fits[chosen]:
        return None
    return OutputLayout(chosen, roles, counts[chosen], in_rows, numbered=numbered and chosen == "e2e", notes=notes)


def _unfit(model: OnnxFile, shapes: Mapping[str, Sequence[int]], wanted: str | None) -> ConfigError:
    """Return the error of outputs that fit no layout, or not the wanted one."""
    listed = ", ".join(f"{name} {shape}" for name, shape in list(shapes.items())[:20])
    fits = f"do not fit the layout {wanted!r}" if wanted else "fit no layout that is known"
    remedy = f"Set layout to one of: {', '.join(LAYOUTS)}; or export the model in one of these."
    if len(shapes) == 1 and all(len(shape) <= 2 for shape in shapes.values()):
        remedy = "It may be one that names the whole picture; a detector also says where something is."
    return ConfigError(f"the outputs of {model.path} {fits}: {listed}.", remedy=remedy)


def _together(model: OnnxFile, shapes: Mapping[str, Sequence[int]], wanted: str | None) -> OutputLayout | None:
    """Return the layout of several outputs."""
    if set(shapes) >= YUNET_OUTPUTS:
        return OutputLayout("yunet", {}, 1)
    roles = _roles(model, shapes)
    if set(roles) == {"boxes", "scores"}:
        boxes, scores = shapes[roles["boxes"]], shapes[roles["scores"]]
        fits = len(scores) >= 2 and scores[-2] == boxes[-2] and boxes[-1] == 4
        return OutputLayout("detr", roles, scores[-1]) if fits else None
    if "labels" not in roles or ("scores" not in roles and shapes[roles["boxes"]][-1] != 5):
        return None
    takes_size = len(model.inputs) > 1 if wanted is None else wanted == "detr-post"
    return OutputLayout("detr-post" if takes_size else "boxes", roles)


def _roles(model: OnnxFile, shapes: Mapping[str, Sequence[int]]) -> dict[str, str]:
    """Return which output has boxes, scores and labels, by shapes, types and names."""
    whole = {one.name for one in model.outputs if one.dtype.startswith(("int", "uint"))}
    words = {name: name.casefold() for name in shapes}
    fours = [name for name, shape in shapes.items() if len(shape) >= 2 and shape[-1] in (4, 5)]
    # of two candidates, as with a model of four labels or boxes, the name decides, else the rank
    named = {name: any(word in words[name] for word in ("box", "det")) for name in fours}
    boxes = sorted(fours, key=lambda name: (not named[name], -len(shapes[name]), name))[:1]
    others = [name for name in shapes if name not in boxes]
    if not boxes or not 1 <= len(others) <= 2:
        return {}
    if len(others) == 1:
        many = len(shapes[others[0]]) >= 2 and shapes[boxes[0]][-1] == 4
        return {"boxes": boxes[0], "scores" if many and others[0] not in whole else "labels": others[0]}
    labels = min(others, key=lambda n: (n not in whole, "label" not in words[n] and "class" not in words[n], n))
    return {"boxes": boxes[0], "labels": labels, "scores": next(name for name in others if name != labels)}


def _rows(output: NDArray[Any]) -> NDArray[Any]:
    return output.reshape(-1, output.shape[-1]) if output.ndim < 3 else output.reshape(output.shape[-2:])


def _dense(layout: OutputLayout, rows: Floats, size: tuple[int, int]) -> ModelDetections:
    """Decode an output with a row or a column for each cell."""
    if layout.name == "yolo":
        rows = rows.T if layout.in_rows else rows
        scores = rows[:, 4:][:, : layout.label_count]
    else:
        scores = rows[:, 4:5] * rows[:, 5:]
    boxes = rows[:, :4]
    if layout.raw:
        cells, strides = _cells(size)
        extent = np.exp(np.minimum(boxes[:, 2:], LARGEST_EXPONENT))
        boxes = np.concatenate([boxes[:, :2] + cells, extent], axis=1) * strides[:, None]
    labels = scores.argmax(axis=1) if scores.shape[1] else np.zeros(len(scores))
    corners = _corners(boxes, rows[:, -1] if layout.notes.oriented else None)
    return _places(_shares(corners, size), scores.max(axis=1, initial=0.0), labels)


def _without_number(rows: Floats) -> Floats:
    """Return corners, score and label of places that begin with the number of the image; labels are whole numbers."""
    score_first = (rows[:, 5] % 1).any()
    return rows[:, 1:] if score_first else rows[:, [1, 2, 3, 4, 6, 5]]


def _queries(corners: Floats, scores: Floats) -> ModelDetections:
    scores = scores.reshape(len(corners), scores.shape[-1])
    if scores.size and not (scores.min() >= 0 and scores.max() <= 1):
        scores = 1 / (1 + np.exp(-scores))
    return _places(corners, scores.max(axis=1, initial=0.0), scores.argmax(axis=1))


def _places(corners: Floats, scores: Floats, labels: NDArray[Any]) -> ModelDetections:
    """Leave out places that are not numbers or not valid."""
    count = min(len(corners), len(scores), len(labels))
    corners, scores, labels = corners[:count], scores[:count], labels[:count]
    usable = np.isfinite(corners).all(axis=1) & np.isfinite(scores) & np.isfinite(labels)
    usable &= (np.abs(labels) < 2**31) & (corners[:, 2:] > corners[:, :2]).all(axis=1)
    return ModelDetections(corners[usable], scores[usable], np.rint(labels[usable]).astype(np.int64))


def _corners(boxes: Floats, angles: Floats | None = None) -> Floats:
    """Return the corners of the upright boxes around those given by centre, size and perhaps an angle."""
    centre, half = boxes[:, :2], boxes[:, 2:4] / 2
    if angles is not None:
        along, across = np.abs(np.cos(angles))[:, None], np.abs(np.sin(angles))[:, None]
        half = half * along + half[:, ::-1] * across
    return np.concatenate([centre - half, centre + half], axis=1)


def _shares(corners: Floats, size: tuple[int, int]) -> Floats:
    """Return corners as shares of an image, given in its pixels or as shares."""
    finite = corners[np.isfinite(corners)]
    return corners if finite.size and np.abs(finite).max() <= SHARES else corners / np.tile(size, 2)


def _cells(size: tuple[int, int]) -> tuple[Floats, Floats]:
    """Return column and row of each cell of the strides, and the stride."""
    cells, strides = [np.empty((0, 2))], [np.empty(0)]
    for stride in STRIDES:
        x, y = np.meshgrid(np.arange(size[0] // stride), np.arange(size[1] // stride))
        cells.append(np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float64))
        strides.append(np.full(x.size, float(stride)))
    return np.concatenate(cells), np.concatenate(strides)


def _relative(rows: Floats, size: tuple[int, int]) -> bool:
    """Return whether centres are relative to their cells: then most are near 0, not near their cell in the image."""
    cells, strides = _cells(size)
    centres = np.nan_to_num(rows[:, :2], posinf=1e9, neginf=-1e9)
    absolute = np.abs(centres / strides[:, None] - cells - 0.5).max(axis=1)
    return bool(np.median(np.abs(centres - 0.5).max(axis=1)) < np.median(absolute))
