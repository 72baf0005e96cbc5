"""Build small ONNX models for tests: one for each layout with constant outputs, and one that finds red areas.

They have no trained weights, and few operators, so that every runtime can run them.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

SIDE = 64
"""Width and height of the models' input."""
LABELS = ("bowl", "cup", "cat")
BOX = (16.0, 8.0, 48.0, 40.0)
"""Where the models with constant outputs detect a cup: left, top, right, bottom in pixels of their input."""
SCORE = 0.8
LAYOUTS = ("yolox", "yolox-decoded", "yolo", "e2e", "detr", "detr-post", "boxes", "boxes-scored")

Floats = NDArray[np.float32]
Shape = Sequence[int | str]


def outputs_of(layout: str) -> dict[str, Floats]:
    """Return what a model of a layout returns if it detects a cup at `BOX`, and less certain objects elsewhere."""
    left, top, right, bottom = BOX
    centred = ((left + right) / 2, (top + bottom) / 2, right - left, bottom - top)
    if layout in ("yolox", "yolox-decoded"):
        return {"output": _yolox(centred, raw=layout == "yolox")}
    if layout == "yolo":
        rows = np.full((84, 4 + len(LABELS)), 20.0, np.float32)
        rows[:, 4:] = 0.01
        rows[3] = [*centred, 0.1, SCORE, 0.0]
        rows[4] = [*centred, 0.1, SCORE - 0.1, 0.0]
        return {"output0": rows.T[None].copy()}
    scores, labels = np.array([SCORE, 0.5, 0.02], np.float32), np.array([1, 0, 1], np.float32)
    corners = np.array([BOX, (0, 0, 20, 20), (1, 1, 9, 9)], np.float32)
    if layout == "e2e":
        rows = np.zeros((20, 6), np.float32)
        rows[:3] = np.column_stack([corners, scores, labels])
        return {"output0": rows[None]}
    if layout == "detr":
        queries, logits = np.full((5, 4), 0.1, np.float32), np.full((5, len(LABELS)), -9.0, np.float32)
        queries[2], logits[2, 1] = np.array(centred) / SIDE, math.log(SCORE / (1 - SCORE))
        return {"logits": logits[None], "pred_boxes": queries[None]}
    if layout == "detr-post":
        return {"labels": labels[None], "boxes": corners[None] / np.float32(SIDE), "scores": scores[None]}
    if layout == "boxes-scored":
        return {"dets": np.column_stack([corners, scores])[None], "labels": labels[None]}
    return {"boxes": corners, "labels": labels, "scores": scores}


def _yolox(centred: Sequence[float], *, raw: bool) -> Floats:
    rows = []
    for stride in (8, 16, 32):
        for y in range(SIDE // stride):
            for x in range(SIDE // stride):
                here = stride == 16 and (x, y) == (2, 1)
                u, v, width, height = centred if here else ((x + 0.5) * stride, (y + 0.5) * stride, 20.0, 20.0)
                if raw:
                    u, v = u / stride - x, v / stride - y
                    width, height = math.log(width / stride), math.log(height / stride)
                rows.append([u, v, width, height, 1.0 if here else 0.01, 0.1, SCORE, 0.0])
    return np.array([rows], np.float32)


def constant_model(
    outputs: Mapping[str, Floats],
    *,
    shape: Shape = (1, 3, SIDE, SIDE),
    dtype: int = TensorProto.FLOAT,
    whole: Sequence[str] = (),
    takes_size: bool = False,
    metadata: Mapping[str, str] | None = None,
) -> bytes:
    """Return a model that returns the same for every image.

    Args:
        outputs: The values that it returns.
        shape: Shape of its input; texts leave dimensions open.
        dtype: Type of its input.
        whole: Names of the outputs that are whole numbers.
        takes_size: Whether it has a second input, which takes the size of the frame and scales the boxes.
        metadata: The file's metadata; by default its labels.
    """
    inputs = [helper.make_tensor_value_info("images", dtype, list(shape))]
    nodes = [
        helper.make_node("Cast", ["images"], ["image"], to=TensorProto.FLOAT),
        helper.make_node("ReduceMean", ["image"], ["mean"], keepdims=0),
        helper.make_node("Mul", ["mean", "nothing"], ["none"]),
    ]
    values = [numpy_helper.from_array(np.array(0, np.float32), "nothing")]
    if takes_size:
        inputs.append(helper.make_tensor_value_info("orig_target_sizes", TensorProto.INT64, [1, 2]))
        nodes.append(helper.make_node("Cast", ["orig_target_sizes"], ["size"], to=TensorProto.FLOAT))
        nodes.append(helper.make_node("Concat", ["size", "size"], ["sizes"], axis=1))
    declared = []
    for name, value in outputs.items():
        values.append(numpy_helper.from_array(value, f"{name}_values"))
        scaled = takes_size and name == "boxes"
        summed = f"{name}_sum" if scaled or name in whole else name
        nodes.append(helper.make_node("Add", [f"{name}_values", "none"], [summed]))
        if scaled:
            nodes.append(helper.make_node("Mul", [f"{name}_sum", "sizes"], [name]))
        if name in whole:
            nodes.append(helper.make_node("Cast", [f"{name}_sum"], [name], to=TensorProto.INT64))
        kind = TensorProto.INT64 if name in whole else TensorProto.FLOAT
        declared.append(helper.make_tensor_value_info(name, kind, list(value.shape)))
    return _saved(helper.make_graph(nodes, "constant", inputs, declared, values), metadata)


def red_model(metadata: Mapping[str, str] | None = None, *, dtype: int = TensorProto.FLOAT) -> bytes:
    """Return a model of the layout ``boxes`` that finds the box around all that is red, for frames of any size."""
    full = 255 if dtype == TensorProto.UINT8 else 1  # the largest value of its input
    node = helper.make_node
    nodes = [
        node("Cast", ["images"], ["floats"], to=TensorProto.FLOAT),
        node("Conv", ["floats", "redness", "least"], ["red"]),
        node("Mul", ["red", "gain"], ["steep"]),
        node("Clip", ["steep", "zero", "one"], ["mask"]),
        node("ReduceMax", ["mask"], ["across"], axes=[2], keepdims=0),
        node("ReduceMax", ["mask"], ["down"], axes=[3], keepdims=0),
        node("Reshape", ["across", "row"], ["columns"]),
        node("Reshape", ["down", "row"], ["rows"]),
    ]
    values = {
        "redness": np.array([1, -0.5, -0.5], np.float32).reshape(1, 3, 1, 1) / np.float32(full),
        "least": np.array([-0.4], np.float32),
        "gain": np.float32(1e4),
        "zero": np.float32(0),
        "one": np.float32(1),
        "row": np.array([1, -1], np.int64),
        "places": np.arange(1, 321, dtype=np.float32)[None],
        "from_end": np.arange(320, 0, -1, dtype=np.float32)[None],
        "places_down": np.arange(1, 241, dtype=np.float32)[None],
        "from_foot": np.arange(240, 0, -1, dtype=np.float32)[None],
        "width": np.float32(320),
        "height": np.float32(240),
    }
    for name, line, numbers, extent in (
        ("right", "columns", "places", None),
        ("left", "columns", "from_end", "width"),
        ("bottom", "rows", "places_down", None),
        ("top", "rows", "from_foot", "height"),
    ):
        nodes.append(node("Mul", [line, numbers], [f"{name}_all"]))
        nodes.append(node("ReduceMax", [f"{name}_all"], [f"{name}_most" if extent else name], axes=[1], keepdims=1))
        if extent:
            nodes.append(node("Sub", [extent, f"{name}_most"], [name]))
    nodes.append(node("Concat", ["left", "top", "right", "bottom"], ["boxes"], axis=1))
    nodes.append(node("ReduceMax", ["columns"], ["scores"], axes=[1], keepdims=1))
    nodes.append(node("Mul", ["scores", "zero"], ["labels"]))
    inputs = [helper.make_tensor_value_info("images", dtype, [1, 3, 240, 320])]
    sizes = {"boxes": 4, "scores": 1, "labels": 1}
    outputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, [1, size]) for name, size in sizes.items()]
    initial = [numpy_helper.from_array(np.asarray(value), name) for name, value in values.items()]
    graph = helper.make_graph(nodes, "red", inputs, outputs, initial)
    return _saved(graph, {"names": "{0: 'box'}"} if metadata is None else metadata)


def yunet_model() -> bytes:
    """Return a model with YuNet's outputs that sees one face, in the middle of the frame."""
    outputs: dict[str, Floats] = {}
    for stride in (8, 16, 32):
        cells = (SIDE // stride) ** 2
        score = np.zeros((1, cells, 1), np.float32)
        if stride == 16:
            score[0, 5] = 1.0
        outputs |= {f"cls_{stride}": score, f"obj_{stride}": score}
        outputs[f"bbox_{stride}"] = np.zeros((1, cells, 4), np.float32)
        outputs[f"kps_{stride}"] = np.zeros((1, cells, 10), np.float32)
    return constant_model(outputs, metadata={})


def _saved(graph: onnx.GraphProto, metadata: Mapping[str, str] | None) -> bytes:
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], producer_name="nxtdrive tests")
    model.ir_version = 8  # OpenCV and older runtimes read no newer one
    names = {"names": str(dict(enumerate(LABELS))), "license": "CC0-1.0"}
    helper.set_model_props(model, dict(names if metadata is None else metadata))
    return bytes(model.SerializeToString())
