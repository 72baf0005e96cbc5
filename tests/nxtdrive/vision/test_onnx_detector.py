"""Models of every layout, on both runtimes; built here, so that no weights are needed."""

import sys

import numpy as np
import pytest
from onnx import TensorProto

from firmware_protocol.errors import ConfigError
from nxtdrive.tools.dev.onnx_models import BOX, LAYOUTS, SCORE, SIDE, constant_model, outputs_of, red_model, yunet_model
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.detectors.onnx import OnnxDetector
from nxtdrive.vision.detectors.onnx_model import Options
from nxtdrive.vision.detectors.shared_frame import detect_each

RUNTIMES = ("onnxruntime", "opencv")
FRAME = np.full((240, 320, 3), 90, np.uint8)
STRETCHED = ("detr", "detr-post", "boxes", "boxes-scored")


@pytest.fixture
def detector(tmp_path):
    """Make a detector of the bytes of a model."""

    def make(content, label="cup", **options):
        (tmp_path / "model.onnx").write_bytes(content)
        return OnnxDetector(tmp_path / "model.onnx", label, Options(**options))

    return make


def model(layout, **more):
    outputs = outputs_of(layout)
    whole = ["labels"] if "labels" in outputs else []
    return constant_model(outputs, **{"whole": whole, "takes_size": layout == "detr-post", **more})


def expected(layout):
    """The box in the frame: stretched to the model's square, or with gray below it."""
    across, down = 320 / SIDE, (240 if layout in STRETCHED else 320) / SIDE
    left, top, right, bottom = BOX
    return round(left * across), round(top * down), round((right - left) * across), round((bottom - top) * down)


@pytest.mark.parametrize("runtime", RUNTIMES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_each_layout_is_recognised_and_read(detector, layout, runtime):
    made = detector(model(layout), runtime=runtime)
    (found,) = made.detect(FRAME)
    assert found.box == expected(layout)
    assert found.score == pytest.approx(SCORE, abs=0.01)
    assert f"layout {layout.split('-decoded')[0].split('-scored')[0]}," in made.description()["model"]


@pytest.mark.parametrize("runtime", RUNTIMES)
@pytest.mark.parametrize("layout", LAYOUTS)
def test_a_layout_may_be_named(detector, layout, runtime):
    name = layout.removesuffix("-decoded").removesuffix("-scored")
    (found,) = detector(model(layout), runtime=runtime, layout=name).detect(FRAME)
    assert found.box == expected(layout)


@pytest.mark.parametrize("runtime", RUNTIMES)
@pytest.mark.parametrize("shape", [("batch", 3, "height", "width"), (1, 3, "h", "w"), ("n", 3, SIDE, SIDE)])
@pytest.mark.parametrize("layout", ["yolox", "yolo", "e2e", "detr", "boxes"])
def test_open_dimensions_get_the_size_of_the_options(detector, layout, shape, runtime):
    (found,) = detector(model(layout, shape=shape), size=SIDE, runtime=runtime).detect(FRAME)
    assert found.box == expected(layout)


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_a_model_without_a_batch_gets_frames_as_they_are(detector, runtime):
    (found,) = detector(model("boxes", shape=(3, "height", "width")), runtime=runtime).detect(FRAME)
    assert found.box == (16, 8, 32, 32)


@pytest.mark.parametrize("dtype", [TensorProto.FLOAT16, TensorProto.UINT8])
def test_other_numbers_than_float_are_given(detector, dtype):
    assert detector(model("yolo", dtype=dtype)).detect(FRAME)


def test_colours_may_come_last(detector):
    assert detector(model("yolo", shape=(1, SIDE, SIDE, 3))).detect(FRAME)


@pytest.mark.parametrize("dtype", [TensorProto.FLOAT, TensorProto.FLOAT16, TensorProto.UINT8])
@pytest.mark.parametrize("runtime", RUNTIMES)
def test_what_is_in_the_frame_decides(detector, runtime, dtype):
    made = detector(red_model(dtype=dtype), "box", runtime=runtime)
    frame = FRAME.copy()
    assert made.detect(frame) == []
    frame[50:100, 30:90] = (0, 0, 230)
    (found,) = made.detect(frame)
    assert found.box == (30, 50, 60, 50)
    (larger,) = made.detect(frame.repeat(2, axis=0).repeat(2, axis=1))
    assert larger.box == (60, 100, 120, 100)


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_several_labels_of_a_model_share_its_run(detector, tmp_path, runtime):
    cup = detector(model("e2e"), runtime=runtime)
    bowl = OnnxDetector(tmp_path / "model.onnx", "bowl", Options(runtime=runtime))
    runs = []

    class Counted:
        title = "counted"

        def __init__(self, model):
            self.run = lambda inputs: runs.append(1) or model.run(inputs)

    cup._model._runtime = Counted(cup._model._runtime)
    together = detect_each({"cup": cup, "bowl": bowl}, FRAME)
    assert len(runs) == 1
    assert together == {"cup": cup.detect(FRAME), "bowl": bowl.detect(FRAME)}
    assert len(runs) == 3


def test_a_model_that_was_replaced_is_loaded_again(detector):
    assert detector(model("e2e")).detect(FRAME)[0].box == expected("e2e")
    assert detector(model("boxes")).detect(FRAME)[0].box == expected("boxes")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_yunet_finds_faces(detector, runtime):
    (found,) = detector(yunet_model(), "face", runtime=runtime).detect(FRAME)
    assert found.score == pytest.approx(1.0)


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_a_cell_a_row_is_read_if_the_labels_are_known(detector, runtime):
    rows = outputs_of("yolo")["output0"].transpose(0, 2, 1).copy()
    (found,) = detector(constant_model({"output0": rows}), runtime=runtime).detect(FRAME)
    assert found.box == expected("yolo")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_two_labels_with_a_row_for_each_cell_are_no_end_to_end_model(detector, runtime):
    rows = outputs_of("yolo")["output0"][:, :6].transpose(0, 2, 1)
    made = detector(constant_model({"out": rows.copy()}, metadata={"names": "bowl, cup"}), runtime=runtime)
    (found,) = made.detect(FRAME)
    assert found.box == expected("yolo")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_four_places_are_distinguished_from_their_boxes_by_rank(detector, runtime):
    corners = np.array([[BOX, (0, 0, 20, 20), (1, 1, 9, 9), (0, 0, 1, 1)]], np.float32)
    labels, scores = np.array([[1, 0, 1, 0]], np.float32), np.array([[SCORE, 0.5, 0.02, 0.01]], np.float32)
    outputs = {"a": labels, "b": corners, "c": scores}
    (found,) = detector(constant_model(outputs, whole=["a"]), runtime=runtime).detect(FRAME)
    assert found.box == expected("boxes")


@pytest.mark.parametrize("runtime", RUNTIMES)
@pytest.mark.parametrize("masks", [(), (1, 32, 16, 16)], ids=["keypoints", "masks"])
def test_columns_beyond_the_named_labels_are_no_labels(detector, masks, runtime):
    rows = np.pad(outputs_of("yolo")["output0"], ((0, 0), (0, 32), (0, 0)), constant_values=50.0)
    more = {"output1": np.zeros(masks, np.float32)} if masks else {}
    (found,) = detector(constant_model({"output0": rows, **more}), runtime=runtime).detect(FRAME)
    assert found.box == expected("yolo")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_a_row_for_each_cell_may_have_keypoints_too_if_the_layout_is_named(detector, runtime):
    columns = np.pad(outputs_of("yolo")["output0"], ((0, 0), (0, 32), (0, 0)), constant_values=50.0)
    model = constant_model({"output0": columns.transpose(0, 2, 1)})
    (found,) = detector(model, runtime=runtime, layout="yolo").detect(FRAME)
    assert found.box == expected("yolo")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_masks_are_left_out_of_boxes(detector, runtime):
    masks = np.zeros((3, 1, 28, 28), np.float32)
    made = detector(constant_model({**outputs_of("boxes"), "masks": masks}, whole=["labels"]), runtime=runtime)
    assert made.detect(FRAME)[0].box == expected("boxes")


def test_logits_may_be_called_labels_and_boxes_dets(detector):
    outputs = outputs_of("detr")
    made = detector(constant_model({"dets": outputs["pred_boxes"], "labels": outputs["logits"]}))
    assert made.detect(FRAME)[0].box == expected("detr")
    assert "layout detr" in made.description()["model"]


def test_outputs_without_descriptive_names_are_distinguished_by_shape_and_type(detector):
    outputs = outputs_of("boxes")
    named = {"1203": outputs["boxes"], "1178": outputs["labels"], "1190": outputs["scores"]}
    assert detector(constant_model(named, whole=["1178"])).detect(FRAME)[0].box == expected("boxes")


def test_the_fainter_of_two_that_overlap_and_other_labels_are_left_out(detector):
    assert detector(model("e2e"), "cat").detect(FRAME) == []
    assert len(detector(model("e2e"), "bowl").detect(FRAME)) == 1


def test_nan_is_not_a_place(detector):
    outputs = outputs_of("boxes")
    outputs["boxes"][0] = np.nan
    assert detector(constant_model(outputs)).detect(FRAME) == []


@pytest.mark.parametrize("layout", ["detr", "boxes", "boxes-scored"])
def test_a_model_may_find_no_place_at_all(detector, layout):
    outputs = {name: rows[:, :0] if rows.shape[0] == 1 else rows[:0] for name, rows in outputs_of(layout).items()}
    assert detector(constant_model(outputs), runtime="onnxruntime").detect(FRAME) == []


@pytest.mark.parametrize(
    ("metadata", "labels_file", "label"),
    [
        ({"names": "{0: 'bowl', 1: 'cup'}"}, None, "cup"),
        ({"id2label": '{"0": "bowl", "1": "Cup"}'}, None, "Cup"),
        ({"labels": '["bowl", "cup"]'}, None, "cup"),
        ({"classes": "bowl, cup"}, None, "cup"),
        ({"names": "{0: 'other'}"}, "bowl\ncup\ncat\n", "cup"),
        ({}, '["bowl", "cup", "cat"]', "cup"),
        ({"names": "{0: 'bowl', 1: 'cu", "classes": "bowl, cup"}, None, "cup"),  # damaged: not a list between commas
        ({}, None, "person"),  # COCO's number 1, where nothing names the labels
        ({}, None, "1"),
    ],
)
def test_labels_come_from_a_file_or_the_metadata(detector, tmp_path, metadata, labels_file, label):
    options = {}
    if labels_file:
        (tmp_path / "labels.txt").write_text(labels_file)
        options["labels"] = str(tmp_path / "labels.txt")
    layout = "boxes" if label in ("person", "1") else "yolo"
    made = detector(model(layout, metadata=metadata), label, **options)
    assert made.detect(FRAME)


@pytest.mark.parametrize(
    ("label", "message"),
    [
        ("cups", "has no label 'cups'. Did you mean 'cup'\\? It has: bowl, cup, cat"),
        ("CUP", "Did you mean 'cup'"),
        ("3", "has no label '3'"),
        ("", "has no label ''"),
    ],
)
def test_a_label_that_is_not_in_the_model_is_refused_with_those_that_are(detector, label, message):
    with pytest.raises(ConfigError, match=message):
        detector(model("yolo"), label)


def test_a_number_without_a_label_has_no_empty_label(detector):
    with pytest.raises(ConfigError, match="has no label ''"):
        detector(model("e2e", metadata={"names": "{0: 'bowl', 5: 'cat'}"}), "")


def test_a_line_of_a_file_is_one_label_and_labels_with_commas_are_quoted(detector, tmp_path):
    (tmp_path / "labels.txt").write_text("cup, white\n")
    with pytest.raises(ConfigError, match=r"has no label 'cup'.*It has: 'cup, white'"):
        detector(model("e2e"), "cup", labels=str(tmp_path / "labels.txt"))
    assert detector(model("e2e"), "cup, white", labels=str(tmp_path / "labels.txt"))


@pytest.mark.parametrize(
    ("layout", "label"),
    [("e2e", "bicycle"), ("detr-post", "bicycle"), ("boxes-scored", "bicycle"), ("boxes", "person")],
)
def test_cocos_labels_are_counted_as_the_layouts_models_do(detector, layout, label):
    made = detector(model(layout, metadata={}), label)  # the models detect label 1
    assert made.detect(FRAME)
    assert made.description()["labels"].startswith("the file names none; taken as COCO's: person, bicycle")


def test_one_label_is_counted_as_one(detector, tmp_path):
    (tmp_path / "labels.txt").write_text("cup\nbowl\n")
    outputs = {"logits": np.zeros((1, 5, 1), np.float32), "pred_boxes": np.zeros((1, 5, 4), np.float32)}
    with pytest.raises(ConfigError, match="has 1 label, but 2 are named"):
        detector(constant_model(outputs), labels=str(tmp_path / "labels.txt"))


def test_without_labels_a_number_is_needed(detector):
    with pytest.raises(ConfigError, match=r"does not name its labels.*give the number"):
        detector(model("yolo", metadata={}))
    assert detector(model("yolo", metadata={}), "1").detect(FRAME)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"hello, world", "is not an ONNX model"),
        (bytes(5000), "is not an ONNX model"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "is not an ONNX model"),
        (model("yolo")[:400], "is not an ONNX model"),
        (model("yolo", shape=(1, 1, SIDE, SIDE)), "takes something other than one image: images float32"),
        (model("yolo", shape=(4, 3, SIDE, SIDE)), "takes something other than one image"),
        (model("yolo", shape=(1, 3, 100_000, 100_000)), "takes something other than one image"),
        (model("yolo", dtype=TensorProto.INT64), "takes something other than one image"),
        (constant_model({"out": np.zeros((1, 1000), np.float32)}), "fit no layout that is known: out"),
        (constant_model({"a": np.zeros((1, 3, 7), np.float32), "b": np.zeros(3, np.float32)}), "fit no layout"),
        (model("yolo", metadata={"names": "a,b,c,d,cup"}), "has 3 labels, but 5 are named"),
    ],
)
def test_a_wrong_file_is_refused_with_the_reason(detector, content, message):
    with pytest.raises(ConfigError, match=message):
        detector(content)


@pytest.mark.parametrize("normalisation", ["unit", "imagenet"])
def test_bytes_cannot_be_normalised(detector, normalisation):
    with pytest.raises(ConfigError, match="takes whole numbers") as refused:
        detector(model("yolo", dtype=TensorProto.UINT8), normalisation=normalisation)
    assert "normalisation" in refused.value.remedy


@pytest.mark.parametrize("file", [".", "missing.onnx", "/dev/zero"])
def test_anything_that_is_not_a_file_is_refused(tmp_path, file):
    with pytest.raises(ConfigError):
        OnnxDetector(tmp_path / file, "cup")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"layout": "ssd"}, "no layout 'ssd'. Use one of: yolox"),
        ({"runtime": "tpu"}, "no runtime 'tpu'"),
        ({"size": 100}, "cannot get frames of 100 pixels"),
        ({"layout": "detr"}, "do not fit the layout 'detr'"),
    ],
)
def test_wrong_options_are_refused(detector, options, message):
    with pytest.raises(ConfigError, match=message):
        detector(model("yolo"), **options)


NO_TEXT = model("yolo").replace(b"ReduceMean", b"\xf5educeMean")


def test_a_name_that_is_not_a_text_is_refused_without_a_word_of_the_runtime(detector, capfd):
    with pytest.raises(ConfigError, match=r"onnxruntime .* cannot load"):
        detector(NO_TEXT)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("runtime", RUNTIMES)
def test_an_output_whose_name_is_not_a_text_is_refused(detector, runtime):
    with pytest.raises(ConfigError, match=r"cannot (load|run) .*model\.onnx"):
        detector(model("yolo").replace(b"output0", b"outpu\xf40"), runtime=runtime)


def test_what_crashes_opencv_is_refused(tmp_path):
    (tmp_path / "cups.onnx").write_bytes(NO_TEXT)
    with pytest.raises(ConfigError, match=r"cups\.onnx crashes the runtime"):
        make_detector({"detector": "onnx", "model": "cups.onnx", "label": "cup", "runtime": "opencv"}, tmp_path)


def test_an_operator_that_opencv_does_not_support_is_reported_with_a_remedy(detector):
    from onnx import ModelProto, helper

    proto = ModelProto.FromString(model("boxes"))
    proto.graph.node.append(helper.make_node("NonZero", ["image"], ["odd"]))
    proto.graph.output.append(helper.make_tensor_value_info("odd", TensorProto.INT64, [4, "n"]))
    with pytest.raises(ConfigError, match=r"OpenCV 4.* cannot (load|run) .*runtime = \"onnxruntime\""):
        detector(proto.SerializeToString(), runtime="opencv")


def test_without_onnxruntime_opencv_runs_the_model(detector, monkeypatch):
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    monkeypatch.setattr("nxtdrive.vision.detectors.onnx_runtimes.find_spec", lambda name: None)
    made = detector(model("yolo"))
    assert made.detect(FRAME)
    assert "OpenCV" in made.description()["model"]
    with pytest.raises(ConfigError, match=r"onnxruntime is not installed. Install it: .*\[onnx\]"):
        detector(model("yolo"), runtime="onnxruntime")


def test_the_description_names_labels_licence_and_runtime(detector):
    about = detector(model("yolo")).description()
    assert about["labels"] == "bowl, cup, cat"
    assert about["licence"] == "CC0-1.0"
    assert about["producer"] == "nxtdrive tests"
    assert "64x64 pixels, onnxruntime" in about["model"]


def test_a_specification_is_tried_in_another_process_first(tmp_path):
    (tmp_path / "cups.onnx").write_bytes(model("yolo"))
    spec = {"detector": "onnx", "model": "cups.onnx", "label": "cup", "height_mm": 100}
    assert make_detector(spec, tmp_path).detector.detect(FRAME)


def test_a_model_that_crashes_its_process_is_refused(tmp_path, monkeypatch):
    crash = tmp_path / "crash.py"
    crash.write_text("import os\nos.abort()\n")
    monkeypatch.setattr("nxtdrive.vision.detectors.onnx_isolation.PROGRAM", crash)
    (tmp_path / "cups.onnx").write_bytes(model("yolo"))
    with pytest.raises(ConfigError, match=r"cups\.onnx crashes the runtime"):
        make_detector({"detector": "onnx", "model": "cups.onnx", "label": "cup"}, tmp_path)


def test_the_other_process_says_why_it_refuses(tmp_path):
    (tmp_path / "odd.onnx").write_bytes(constant_model({"out": np.zeros((1, 1000), np.float32)}))
    with pytest.raises(ConfigError, match=r"odd\.onnx fit no layout that is known: out \(1, 1000\)"):
        make_detector({"detector": "onnx", "model": "odd.onnx", "label": "cup"}, tmp_path)


def test_a_file_with_labels_that_was_corrected_is_read_again(tmp_path):
    (tmp_path / "m.onnx").write_bytes(constant_model(outputs_of("yolo")))
    spec = {"detector": "onnx", "model": "m.onnx", "label": "cup", "labels": "labels.txt"}
    (tmp_path / "labels.txt").write_text("bowl\ncup\ncat\ndog\n")
    with pytest.raises(ConfigError, match="has 3 labels, but 4 are named"):
        make_detector(spec, tmp_path)
    (tmp_path / "labels.txt").write_text("bowl\ncup\ncat\n")
    make_detector(spec, tmp_path)
