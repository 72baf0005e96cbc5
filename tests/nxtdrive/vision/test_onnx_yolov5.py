"""Models of YOLOv5 and its relatives: three boxes a cell, decoded, of RGB frames from 0 to 1."""

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper

from nxtdrive.tools.dev.onnx_models import BOX, SCORE, SIDE, outputs_of
from nxtdrive.vision.detectors.onnx import OnnxDetector
from nxtdrive.vision.detectors.onnx_model import Options

RED = np.zeros((SIDE, SIDE, 3), np.uint8)
RED[:, :, 2] = 255


@pytest.fixture(params=[3, 1, 80], ids="{} labels".format)
def model(request, tmp_path):
    """Write a model that is as sure of its cup as its input is red, and return its file and the cup's label."""
    rows = np.tile(outputs_of("yolox-decoded")["output"], (1, 3, 1))
    labels = {3: "bowl, cup, cat", 1: "cup", 80: ""}[request.param]
    scores = rows[:, :, 6:7] if request.param == 1 else np.pad(rows[:, :, 5:], ((0, 0), (0, 0), (0, request.param - 3)))
    sure, rows[:, :, 4] = rows[:, :, 4:5] > 0.5, 0
    rows = np.concatenate([rows[:, :, :5], scores], axis=2)
    by_red = np.zeros_like(rows)
    by_red[:, :, 4:5] = sure
    nodes = [
        helper.make_node("Slice", ["images", "first", "second", "channel"], ["red"]),
        helper.make_node("ReduceMean", ["red"], ["redness"], keepdims=0),
        helper.make_node("Mul", ["redness", "by_red"], ["objectness"]),
        helper.make_node("Add", ["objectness", "rows"], ["output0"]),
    ]
    values = {"first": [0], "second": [1], "channel": [1]}
    constants = [numpy_helper.from_array(np.array(value, np.int64), name) for name, value in values.items()]
    constants += [numpy_helper.from_array(by_red, "by_red"), numpy_helper.from_array(rows, "rows")]
    image = helper.make_tensor_value_info("images", TensorProto.FLOAT, [1, 3, SIDE, SIDE])
    output = helper.make_tensor_value_info("output0", TensorProto.FLOAT, list(rows.shape))
    graph = helper.make_graph(nodes, "yolov5", [image], [output], constants)
    file = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)])
    file.ir_version = 8
    if labels:
        helper.set_model_props(file, {"names": labels})
    onnx.save(file, tmp_path / "yolov5.onnx")
    return tmp_path / "yolov5.onnx", "cup" if labels else "bicycle"  # COCO's second label


@pytest.mark.parametrize("runtime", ["onnxruntime", "opencv"])
def test_three_boxes_a_cell_are_recognised_and_get_red_first_from_0_to_1(model, runtime):
    (found,) = OnnxDetector(*model, Options(runtime=runtime)).detect(RED)
    left, top, right, bottom = BOX
    assert found.box == (left, top, right - left, bottom - top)
    assert found.score == pytest.approx(SCORE, abs=0.01)
