"""Detectors that are not part of nxtdrive: offered by installed packages."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

import nxtdrive
from behaviors.mission import MissionError, load_mission
from firmware_protocol.errors import ConfigError
from nxtdrive.cli.main import DONE, main
from nxtdrive.signals import Terminated
from nxtdrive.vision.detection import Detection
from nxtdrive.vision.detectors import make_detector
from nxtdrive.vision.detectors.shared_frame import detect_each
from sim_backend.bundled import PICTURES

EXAMPLE = Path(__file__).parents[3] / "examples" / "lamp-detector"
ODD = """
from nxtdrive.signals import Terminated
def fails(spec): raise KeyError("lamp")
def nothing(spec): return None
class Told:
    def __init__(self, spec): self.file = spec.take("weights_file", str)
    def detect(self, image): return []
class Answers:
    def __init__(self, spec): self.answer = None
    def detect(self, image): return self.answer
class Writes:
    def __init__(self, spec): pass
    def detect(self, image): image[:] = 0
    def description(self): raise KeyError("lamp")
def leaves(spec): raise SystemExit(3)
def ends(spec): raise Terminated(143)
def sharing(spec):
    from nxtdrive.vision.detectors.picture import PictureDetector, read_image
    return PictureDetector([read_image(spec.path("lena.png"))])
"""
FRAME = np.full((24, 32, 3), 60, np.uint8)
CORNERS = (1, 1), (9, 1), (9, 8), (1, 8)


@pytest.fixture
def installed(monkeypatch, tmp_path):
    """A folder in which the example and some odd detectors are installed; the import system forgets them afterwards."""
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    (tmp_path / "lamp.py").write_text((EXAMPLE / "lamp.py").read_text(encoding="utf-8"), encoding="utf-8")
    (tmp_path / "odd.py").write_text(ODD, encoding="utf-8")
    info = tmp_path / "lamp_detector-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: lamp-detector\nVersion: 1.0\n", encoding="utf-8")
    offered = (EXAMPLE / "pyproject.toml").read_text(encoding="utf-8").split('detectors"]\n')[1].split("\n")[0]
    points = ["[nxtdrive.detectors]", offered.replace('"', ""), "marker = odd:nothing"]
    points += [
        f"{name} = odd:{name}"
        for name in ("fails", "nothing", "Told", "missing", "Answers", "Writes", "leaves", "ends", "sharing")
    ]
    (info / "entry_points.txt").write_text("\n".join(points) + "\n", encoding="utf-8")
    yield tmp_path
    for name in ("lamp", "odd"):
        sys.modules.pop(name, None)


def _mission(folder, keys):
    path = folder / "mission.toml"
    path.write_text(f'[mission]\ntargets = ["it"]\n[target.it]\n{keys}', encoding="utf-8")
    return path


def test_an_installed_detector_is_used_as_the_others_are(installed, printed):
    frame = np.full((240, 320, 3), 60, np.uint8)
    frame[100:124, 200:224] = 255
    cv2.imwrite(str(installed / "frame.png"), frame)
    mission = str(EXAMPLE / "lamp.toml")
    assert main(["mission", "check", mission]) == DONE
    assert "least_brightness" in printed("mission", "show", mission)
    words = ["--mission", mission, "--target", "lamp", "--out", str(installed / "out.png")]
    assert "lamp at +" in printed("detect", "try", installed / "frame.png", *words)


@pytest.mark.slow
def test_a_mission_with_an_installed_detector_succeeds_in_its_room(installed):
    report = nxtdrive.run_mission(EXAMPLE / "lamp.toml", nxt=f"sim://{EXAMPLE}/lamp-world.toml?seed=0")
    assert report.achieved


def test_a_mission_with_one_that_is_not_installed_names_those_that_are(tmp_path, refused):
    said = refused("mission", "check", _mission(tmp_path, 'detector = "lamp"\n'))
    assert "there is no detector 'lamp'; use one of picture, haar, marker, qr, color, onnx" in said
    assert "or install its package" in said


def test_installed_ones_are_among_those_that_are_named(installed):
    with pytest.raises(
        MissionError, match=r"use one of picture.*onnx, Answers, Told, Writes, ends, fails, lamp, leaves, missing"
    ):
        load_mission(_mission(installed, 'detector = "sonar"\n'))
    with pytest.raises(MissionError, match=r"there is no detector 'lanp'; did you mean 'lamp'\?"):
        load_mission(_mission(installed, 'detector = "lanp"\n'))
    with pytest.raises(
        ConfigError, match=r"Use one of: picture.*onnx, Answers, Told, Writes, ends, fails, lamp, leaves, missing"
    ):
        make_detector({"detector": "lanp"})


def test_one_that_is_a_detector_of_nxtdrive_inside_looks_for_itself(installed):
    made = make_detector({"detector": "sharing"}, PICTURES)
    frame = cv2.imread(str(PICTURES / "lena.png"))
    found = detect_each({"one": made.detector, "other": made.detector}, frame)
    assert found["one"]
    assert found["one"] == found["other"]


def test_a_built_in_detector_keeps_its_name(installed):
    assert type(make_detector({"detector": "marker", "id": 3}).detector).__name__ == "MarkerDetector"


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ('detector = "fails"\n', "odd.py:3: KeyError: 'lamp'. -v shows the traceback"),
        ('detector = "missing"\n', "cannot be made: AttributeError"),
        ('detector = "leaves"\n', "odd.py:15: SystemExit: 3"),
        ('detector = "nothing"\n', "has no detect()"),
        ('detector = "lamp"\nleast_brightness = 300\n', "least_brightness = 300 is not valid"),
        ('detector = "lamp"\nleast = 3\n', "the lamp detector has no option least"),
        ('detector = "lamp"\nheight_mm = 1\n', "target.it.height_mm"),
        ('detector = "Told"\nweights_file = "w.bin"\n', "target.it.weights_file: there is no file 'w.bin'"),
    ],
)
def test_a_mistake_is_a_sentence(installed, refused, keys, text):
    assert text in refused("mission", "check", _mission(installed, keys))


def test_a_signal_that_comes_in_its_code_is_not_its_mistake(installed):
    with pytest.raises(Terminated):
        make_detector({"detector": "ends"})


def test_its_files_lie_beside_the_mission(installed):
    (installed / "w.bin").touch()
    target = load_mission(_mission(installed, 'detector = "Told"\nweights_file = "w.bin"\n')).target["it"]
    made = make_detector(target.model_dump()).detector
    assert made._detector.file == str(installed / "w.bin")


@pytest.mark.parametrize(
    ("answer", "text"),
    [
        (None, "fails: TypeError: detect() returned NoneType, not a list"),
        ([((1, 2, 3, 4), 0.5)], "returns a wrong result: detection 0 is a tuple, not a Detection."),
        ([{"box": (1, 2, 3, 4)}], "detection 0: score: is missing."),
        ([Detection((1, 2, 0, 4), 0.5)], "detection 0: its box must be at least one pixel wide."),
        ([Detection((1, 2, 3, 0.2), 0.5)], "detection 0: its box must be at least one pixel high."),
        ([Detection((1, 2, 3), 0.5)], "detection 0: its box must have 4 entries."),
        ([Detection((1, 2, math.nan, 4), 0.5)], "detection 0: box.2: it is not a number."),
        ([Detection((1, 2, 10**400, 4), 0.5)], "detection 0: box.2: it is not a number."),
        ([Detection((1, 2, 3, 4), 0.5), Detection((1, 2, 3, 4), 50)], "detection 1: score: must be 1 or less."),
        ([Detection((1, 2, 3, 4), 0.5, None, "x")], "detection 0: its cut must be a Cut."),
        ([Detection((1, 2, 3, 4), 0.5, 7)], "detection 0: quad: must be a list in brackets"),
        ([Detection((1, 2, 3, 4), 0.5, (CORNERS[0],) * 4)], "not a convex quadrilateral"),
        ([Detection((1, 2, 3, 4), 0.5, (*CORNERS[:2], *CORNERS[:1:-1]))], "not a convex quadrilateral"),
    ],
)
def test_anything_that_is_not_a_detection_is_refused_with_a_sentence(installed, answer, text):
    detector = make_detector({"detector": "Answers"}).detector
    detector._detector.answer = answer
    with pytest.raises(ConfigError) as refused:
        detector.detect(FRAME)
    assert text in str(refused.value)
    assert str(refused.value).startswith("the detector 'Answers' (odd:Answers)")


def test_numbers_of_any_kind_are_taken(installed):
    detector = make_detector({"detector": "Answers"}).detector
    box, corners = np.array([1.6, 2, 8, 7], np.float32), np.array(CORNERS, np.int64)
    detector._detector.answer = (Detection(tuple(box), np.float32(1), corners),)
    assert detector.detect(FRAME) == [Detection((2, 2, 8, 7), 1.0, CORNERS)]


def test_a_detector_can_neither_change_the_frame_nor_fail_unnamed(installed):
    detector = make_detector({"detector": "Writes"}).detector
    for call in (lambda: detector.detect(FRAME), detector.description):
        with pytest.raises(
            ConfigError, match=r"the detector 'Writes' \(odd:Writes\) fails at .*odd.py:\d+: "
        ) as failed:
            call()
        assert "-v shows the traceback" in str(failed.value)
    assert FRAME.all()


@pytest.mark.parametrize("keys", ["detector = 3\n", 'detector = ["lamp"]\n', 'detectr = "lamp"\n', ""])
def test_a_missing_name_is_reported_too(installed, keys):
    with pytest.raises(MissionError, match=r"target\.it: (there is no detector|the key detector is missing)"):
        load_mission(_mission(installed, keys))


def test_a_target_must_be_a_table(tmp_path):
    (tmp_path / "m.toml").write_text('[mission]\ntargets = ["it"]\n[target]\nit = 3\n')
    with pytest.raises(MissionError, match=r"target\.it: it must be a table"):
        load_mission(tmp_path / "m.toml")
