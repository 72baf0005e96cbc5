"""Models whose exporter has already chosen the places, or says in the metadata how to read them."""

import math
from pathlib import Path

import numpy as np
import pytest

from firmware_protocol.errors import ConfigError
from nxtdrive.tools.dev.onnx_models import BOX, LABELS, SCORE, constant_model, outputs_of
from nxtdrive.vision.detectors.onnx import OnnxDetector
from nxtdrive.vision.detectors.onnx_model import Options
from nxtdrive.vision.detectors.onnx_runtimes import _cannot

FRAME = np.full((240, 320, 3), 90, np.uint8)
NAMES = str(dict(enumerate(LABELS)))
LEFT, TOP, RIGHT, BOTTOM = BOX
CENTRED = (LEFT + RIGHT) / 2, (TOP + BOTTOM) / 2, RIGHT - LEFT, BOTTOM - TOP
LETTERBOXED = tuple(round(5 * side) for side in (LEFT, TOP, RIGHT - LEFT, BOTTOM - TOP))
"""The box in the frame, which is five times as wide as the input and has gray below it."""


@pytest.fixture
def detector(tmp_path):
    """Make a detector of a model with one output and this metadata besides the labels."""

    def make(rows, metadata, label="cup", **options):
        content = constant_model({"output0": np.asarray(rows, np.float32)}, metadata=metadata)
        (tmp_path / "model.onnx").write_bytes(content)
        return OnnxDetector(tmp_path / "model.onnx", label, Options(**options))

    return make


@pytest.mark.parametrize("label", ["bicycle", "1"])
@pytest.mark.parametrize("score_first", [False, True])  # YOLOv7 with --end2end; the flat format of super-gradients
def test_rows_of_seven_begin_with_the_image_and_end_with_label_and_score(detector, label, score_first):
    rows = np.array([(0, *BOX, 1, SCORE), (0, 0, 0, 20, 20, 0, 1.0)], np.float32)
    made = detector(rows[:, [0, 1, 2, 3, 4, 6, 5]] if score_first else rows, {}, label)
    (found,) = made.detect(FRAME)
    assert (found.box, found.score) == (LETTERBOXED, pytest.approx(SCORE))
    assert "layout e2e" in made.description()["model"]


@pytest.mark.parametrize("count", [0, 1])
def test_rows_of_seven_may_be_few(detector, count):
    made = detector(np.array([(0, *BOX, 1, SCORE)], np.float32)[:count], {}, "1", runtime="onnxruntime")
    assert len(made.detect(FRAME)) == count


def test_seven_numbers_of_another_kind_are_no_place(detector):
    with pytest.raises(ConfigError, match=r"fit no layout.*whole picture"):
        detector([(0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7)], {}, "1")


@pytest.mark.parametrize(
    "stated",
    [{"end2end": "True"}, {"end2end": "False", "args": "{'data': None, 'nms': True, 'opset': None}"}],
    ids=["end2end", "nms"],
)
@pytest.mark.parametrize("more", [32, 51], ids=["masks", "keypoints"])
def test_masks_and_keypoints_beside_chosen_places_are_ignored(detector, stated, more):
    rows = np.pad(outputs_of("e2e")["output0"], ((0, 0), (0, 0), (0, more)), constant_values=50.0)
    (found,) = detector(rows, {"names": NAMES, **stated}).detect(FRAME)
    assert found.box == LETTERBOXED


def test_the_layout_e2e_may_be_named_for_them(detector):
    rows = np.pad(outputs_of("e2e")["output0"], ((0, 0), (0, 0), (0, 32)), constant_values=50.0)
    assert detector(rows, {"names": NAMES}, layout="e2e").detect(FRAME)[0].box == LETTERBOXED


@pytest.mark.parametrize("ended", [True, False])
@pytest.mark.parametrize("degrees", [0, 90, 180])
def test_the_box_around_an_oriented_one_counts(detector, degrees, ended):
    x, y, width, height = CENTRED[0], CENTRED[1], 32.0, 16.0
    places = np.zeros((20, 7), np.float32)
    places[0] = (x, y, width, height, SCORE, 1, math.radians(degrees))
    if not ended:  # a column for each cell: a score for each label, then the angle
        places = np.pad(places, ((0, 64), (0, 1)))
        places[0] = (x, y, width, height, 0.1, SCORE, 0.0, math.radians(degrees))
        places = places.T
    stated = {"task": "obb", "end2end": str(ended)}
    (found,) = detector(places[None], {"names": NAMES, **stated}).detect(FRAME)
    across, down = (16, 32) if degrees == 90 else (32, 16)
    expected = 5 * (x - across / 2), 5 * (y - down / 2), 5 * across, 5 * down
    assert found.box == pytest.approx(expected, abs=1)


@pytest.mark.parametrize("each", [False, True], ids=["best label", "score for each label"])
def test_an_rt_detr_of_ultralytics_gives_centre_and_size_of_a_stretched_frame(detector, each):
    rows = np.zeros((1, 30, 7 if each else 6), np.float32)
    rows[0, 0] = (0.5, 0.25, 0.5, 0.25, *((0.1, SCORE, 0.0) if each else (SCORE, 1)))
    (found,) = detector(rows, {"names": NAMES, "head": "RTDETRDecoder", "end2end": "False"}).detect(FRAME)
    assert found.box == (80, 30, 160, 60)


def test_boxes_of_which_each_has_all_scores_may_be_corners_in_pixels(tmp_path):
    corners, scores = np.full((1, 20, 4), BOX, np.float32), np.zeros((1, 20, 3), np.float32)
    scores[0, 3, 1] = SCORE
    content = constant_model({"943": corners, "935": scores})  # YOLO-NAS
    (tmp_path / "model.onnx").write_bytes(content)
    (found,) = OnnxDetector(tmp_path / "model.onnx", "cup").detect(FRAME)
    assert found.box == LETTERBOXED


@pytest.mark.parametrize("name", ["best.pt", "model.pth"])
def test_a_checkpoint_of_pytorch_is_refused_with_the_command_that_exports_it(tmp_path, name):
    (tmp_path / name).write_bytes(b"PK\x03\x04" + bytes(500))
    with pytest.raises(ConfigError, match=r"is not an ONNX model.*yolo export model=.* format=onnx"):
        OnnxDetector(tmp_path / name, "cup")


def test_a_data_set_in_yaml_is_no_file_of_labels(detector, tmp_path):
    (tmp_path / "data.yaml").write_text("path: cups\nnames:\n  0: bowl\n  1: cup\n  2: cat\n")
    with pytest.raises(ConfigError, match=r"data\.yaml is YAML.*one per line"):
        detector(outputs_of("yolo")["output0"], {}, labels=str(tmp_path / "data.yaml"))


def test_a_long_reason_of_a_runtime_is_cut_between_words():
    refusal = _cannot("load", Path("cup.onnx"), "OpenCV", RuntimeError("first " + "word " * 100 + "last"), "Try.")
    assert str(refusal).startswith("OpenCV cannot load cup.onnx: ... word word")
    assert str(refusal).endswith("word last Try.")
    assert str(_cannot("run", Path("cup.onnx"), "OpenCV", RuntimeError("short"), "Try.")).count("...") == 0
