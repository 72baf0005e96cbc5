"""A run as an MCAP file, read back with the library's reader."""

from __future__ import annotations

import base64
import json
import sys
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader

from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.ports import Sighting
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import looked, read_frames
from nxtdrive.recording.mcap_file import write_mcap
from nxtdrive.recording.mcap_schemas import SCHEMAS
from nxtdrive.recording.run_reader import PastRun
from nxtdrive.vision.detection import Detection

SIGHTING = {"bearing_deg": 3.0, "distance_mm": 900.0, "confidence": 1.0, "box": [10, 10, 20, 20]}


def _look(time_s, pose, range_mm):
    return Record(time_s, RecordKind.LOOK, "search", "lena", {"pose": pose, "range_mm": range_mm, "sighting": SIGHTING})


RECORDS = [
    Record(0.0, RecordKind.START, "idle", "lena", {"format": 2, "mission": "m", "targets": ["lena"]}),
    Record(0.1, RecordKind.CALL, "idle", "lena", {"verb": "arrive", "battery_mv": 7412}),
    _look(0.574, [0.0, 0.0, 0.0], 1500),
    _look(1.0, [1000.0, 500.0, 90.0], None),
    Record(2.001, RecordKind.CHOICE, "search", "lena", {"choice": "move_to", "why": "it was not seen", "evidence": {}}),
    Record(3.3, RecordKind.END, "finished", "lena", {"ending": "achieved", "targets": [], "error": ""}),
]


@pytest.fixture(name="run")
def _run(tmp_path):
    """A run folder with three pictures, of which the second has boxes, and the third one of what is not the target."""
    path = tmp_path / "run-001"
    path.mkdir()
    (path / "journal.jsonl").write_text("".join(f"{each.to_json()}\n" for each in RECORDS), encoding="utf-8")
    camera = CameraFolder(path / "camera")
    camera.add(np.zeros((48, 64, 3), np.uint8), 0.5)
    box, other = (10, 10, 20, 20), (40, 5, 10, 10)
    sighting = Sighting("lena", 3.0, 900.0, 1.0, 0.9, box)
    look = looked("lena", sighting, [Detection(box, 1.0), Detection(other, 0.4)])
    camera.add(np.zeros((48, 64, 3), np.uint8), 0.9, look)
    camera.add(np.zeros((48, 64, 3), np.uint8), 1.2, looked("lena", None, [Detection(other, 0.4)]))
    camera.close()
    return path


def _past(records, mission=None):
    return PastRun(Path("journal.jsonl"), tuple(records), (), mission)


def _read(path):
    """Messages by topic: time in nanoseconds and values."""
    topics = {}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages(log_time_order=False):
            values = json.loads(message.data)
            assert schema.encoding == "jsonschema"
            assert json.loads(schema.data)["title"] == schema.name
            assert set(values) <= set(json.loads(schema.data)["properties"]) | {"timestamp"}
            topics.setdefault(channel.topic, []).append((message.log_time, values))
    return topics


@pytest.fixture(name="topics")
def _topics(run, tmp_path):
    assert main(["export", str(run), "--mcap", str(tmp_path / "run.mcap")]) == DONE
    return _read(tmp_path / "run.mcap")


def test_there_is_every_topic_and_every_schema_is_used(topics, tmp_path):
    assert sorted(topics) == [
        "/battery",
        "/camera",
        "/camera/boxes",
        "/decisions",
        "/log",
        "/pose",
        "/sonar",
        "/state",
        "/tf",
    ]
    with open(tmp_path / "run.mcap", "rb") as file:
        summary = make_reader(file).get_summary()
    assert {schema.name for schema in summary.schemas.values()} == set(SCHEMAS)


def test_times_are_those_of_the_journal_and_in_order(topics, tmp_path):
    assert [time_ns for time_ns, _ in topics["/state"]] == [round(each.time_s * 1e9) for each in RECORDS]
    assert [time_ns for time_ns, _ in topics["/camera"]] == [500_000_000, 900_000_000, 1_200_000_000]
    for time_ns, values in topics["/sonar"]:
        assert values["timestamp"] == {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}
    with open(tmp_path / "run.mcap", "rb") as file:
        times = [each.log_time for _, _, each in make_reader(file).iter_messages(log_time_order=False)]
    assert times == sorted(times)


def test_places_are_as_in_ros(topics):
    _, turned = topics["/pose"][1]
    assert turned["pose"]["position"] == {"x": 1.0, "y": -0.5, "z": 0.0}
    assert turned["pose"]["orientation"] == pytest.approx({"x": 0.0, "y": 0.0, "z": -(0.5**0.5), "w": 0.5**0.5})
    assert topics["/tf"][1][1]["translation"] == turned["pose"]["position"]
    assert [values["ranges"] for _, values in topics["/sonar"]] == [[1.5], []]
    assert [values["voltage"] for _, values in topics["/battery"]] == [7.412]


@pytest.mark.parametrize("sonar_mm", [None, 150.0])
def test_the_sonar_is_where_the_robot_has_it(tmp_path, sonar_mm):
    mission = sonar_mm and Mission.model_validate(
        {
            "mission": {"targets": ["lena"]},
            "target": {"lena": {"detector": "color", "color": "red"}},
            "robot": {"sonar_forward_mm": sonar_mm},
        }
    )
    write_mcap(_past(RECORDS, mission), None, tmp_path / "x.mcap")
    for _, values in _read(tmp_path / "x.mcap")["/sonar"]:
        assert values["pose"]["position"]["x"] == (sonar_mm or 100.0) / 1000


def test_pictures_boxes_and_decisions_are_there(topics, run):
    jpeg = (run / "camera" / "000002.jpg").read_bytes()
    assert base64.b64decode(topics["/camera"][1][1]["data"]) == jpeg
    empty, boxes, found = (values for _, values in topics["/camera/boxes"])
    assert (empty["points"], empty["texts"]) == ([], [])
    corners = [[(at["x"], at["y"]) for at in each["points"]] for each in boxes["points"]]
    other = [(40, 5), (50, 5), (50, 15), (40, 15)]
    assert corners == [other, [(10, 10), (30, 10), (30, 30), (10, 30)]], "the target's once"
    assert boxes["points"][0]["outline_color"] != boxes["points"][1]["outline_color"]
    assert ([boxes["points"][0]["points"]], []) == ([each["points"] for each in found["points"]], found["texts"])
    assert boxes["texts"][0]["text"] == "lena R 3° 0.90 m"
    assert [values["message"] for _, values in topics["/decisions"]] == ["lena: look elsewhere, since it was not seen"]
    assert topics["/log"][-1][1]["message"] == "achieved"


def test_without_camera_there_are_no_pictures(run):
    assert main(["export", str(run), "--mcap", "--no-camera"]) == DONE
    assert not {"/camera", "/camera/boxes"} & set(_read(run / "run.mcap"))


@pytest.mark.parametrize(
    "data",
    [
        {"pose": "here", "range_mm": "far"},
        {"pose": [1, 2], "range_mm": True},
        {"pose": [1, 2, None], "range_mm": []},
        {"battery_mv": "full", "why": {}},
    ],
    ids=range(4),
)
def test_values_of_an_unknown_form_are_left_out(tmp_path, data):
    records = [Record(2.0, kind, "x", "\ud800", data) for kind in RecordKind] + [RECORDS[0]]
    write_mcap(_past(records), None, tmp_path / "x.mcap")
    assert set(_read(tmp_path / "x.mcap")) <= {"/state", "/decisions", "/sonar", "/log"}


def test_a_picture_that_is_gone_is_left_out(run, tmp_path):
    (run / "camera" / "000001.jpg").unlink()
    count = write_mcap(_past([]), read_frames(run), tmp_path / "x.mcap")
    topics = _read(tmp_path / "x.mcap")
    assert len(topics["/camera"]) == 2
    assert sum(map(len, topics.values())) == count


def test_without_the_package_a_sentence_says_how_to_install_it(run, tmp_path, monkeypatch, refused):
    monkeypatch.setitem(sys.modules, "mcap", None)
    assert "[mcap]" in refused("export", run, "--mcap", tmp_path / "run.mcap")


def test_a_file_that_cannot_be_written_is_a_sentence_and_leaves_nothing(run, tmp_path, refused):
    assert "cannot be written" in refused("export", run, "--mcap", tmp_path / "gone" / "run.mcap")
    (tmp_path / "folder").mkdir()
    assert main(["export", str(run), "--mcap", str(tmp_path / "folder")]) == USAGE
    assert not list(tmp_path.glob(".draft-*"))
