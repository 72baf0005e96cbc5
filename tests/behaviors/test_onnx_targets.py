"""Targets that a neural network finds, in mission files."""

from dataclasses import replace

import pytest

from behaviors.adaptive.bounded_sighting import limit_to_echo
from behaviors.adaptive.camera_scale import CameraScale
from behaviors.mission import Mission, MissionError, load_mission
from behaviors.mission.value_warnings import value_warnings
from behaviors.ports import Pose, Sighting

HEAD = '[mission]\ntargets = ["mug"]\n[target.mug]\ndetector = "onnx"\n'


@pytest.fixture
def load(tmp_path):
    """Load a mission with these keys of its target; the files it names exist."""
    for name in ("cups.onnx", "names.txt"):
        (tmp_path / name).touch()

    def make(keys):
        (tmp_path / "m.toml").write_text(HEAD + keys)
        return load_mission(tmp_path / "m.toml")

    return make


def test_files_lie_beside_the_mission(load, tmp_path):
    target = load('model = "cups.onnx"\nlabel = "cup"\nlabels = "names.txt"\nheight_mm = 95\n').target["mug"]
    assert (target.model, target.labels) == (str(tmp_path / "cups.onnx"), str(tmp_path / "names.txt"))
    assert (target.height_mm, target.guessed) == (95, False)


@pytest.mark.parametrize(("label", "height_mm"), [("cup", 100), ("Chair", 850), ("gizmo", 250)])
def test_without_a_height_one_usual_with_the_label_counts(load, label, height_mm):
    mission = load(f'model = "cups.onnx"\nlabel = "{label}"\n')
    assert mission.target["mug"].height_mm == height_mm
    assert mission.guessed_heights == {"mug"}


def test_guessed_heights_survive_writing_and_reading_a_mission(load):
    for keys, guessed in (("", {"mug"}), ("height_mm = 100\n", set())):
        mission = load(f'model = "cups.onnx"\nlabel = "cup"\n{keys}')
        again = Mission.model_validate_json(mission.model_dump_json())
        assert again.guessed_heights == guessed
        assert again.target["mug"].height_mm == 100


@pytest.mark.parametrize(
    ("profile", "keys", "warned"), [("thesis", "", 1), ("thesis", "height_mm = 95\n", 0), ("adaptive", "", 0)]
)
def test_the_thesis_is_warned_of_a_height_that_it_cannot_measure(load, profile, keys, warned):
    mission = load(f'model = "cups.onnx"\nlabel = "cup"\n{keys}[thesis]\n')
    table = mission.mission.model_copy(update={"profile": profile})
    found = value_warnings(mission.model_copy(update={"mission": table}))
    assert sum("does not measure it" in warning for warning in found) == warned


@pytest.mark.parametrize(
    ("keys", "message"),
    [
        ('model = "cups.onnx"\n', "target.mug.label: is missing"),
        ('label = "cup"\n', "target.mug.model: is missing"),
        ('model = "mugs.onnx"\nlabel = "cup"\n', "target.mug.model: there is no file 'mugs.onnx'; put it beside"),
        ('model = "cups.onnx"\nlabel = "cup"\nlayout = "ssd"\n', "target.mug.layout"),
        ('model = "cups.onnx"\nlabel = "cup"\nsize = 100\n', "target.mug.size"),
        ('model = "cups.onnx"\nlabel = "cup"\nsise = 416\n', "target.mug.sise: unknown key; did you mean 'size'"),
        ('model = "cups.onnx"\nlabel = "cup"\nheight_mm = 1\n', "target.mug.height_mm"),
        ("model = 3\nlabel = 4\n", "target.mug.model"),
    ],
)
def test_a_mistake_is_reported_with_its_path(load, keys, message):
    with pytest.raises(MissionError, match=message) as refused:
        load(keys)
    assert "default factory" not in str(refused.value)


def test_a_missing_key_is_one_mistake(load):
    with pytest.raises(MissionError, match=r": 1 mistake\n") as refused:
        load('model = "cups.onnx"\n')
    assert len(refused.value.mistakes) == 1


def _sighting(distance_mm, bearing_deg=0.0):
    return Sighting("mug", bearing_deg, distance_mm, 1.0, 0.0, (0, 0, 10, 10))


@pytest.mark.parametrize("factor", [0.3, 0.5, 1.0, 2.0, 3.0])
@pytest.mark.parametrize("echoes", [False, True])
def test_the_size_of_what_was_not_measured_is_learned_by_driving(factor, echoes):
    scale = CameraScale(0.0, {"mug"})
    assert scale.unknown("mug")
    for driven_mm in range(0, 1400, 40):
        true_mm = 2000.0 - driven_mm
        echo_ahead_mm = true_mm if echoes and true_mm < 1500 else None
        scale.learn(_sighting(true_mm / factor), Pose(driven_mm, 0.0, 0.0), echo_ahead_mm)
    assert scale.factor("mug") == pytest.approx(factor, rel=0.1)
    assert not scale.unknown("mug")


@pytest.mark.parametrize("stands_on_mm", [0.0, 60.0, 100.0])
@pytest.mark.parametrize("factor", [0.05, 0.3, 1.0, 3.0, 15.0])
def test_the_descent_of_its_lower_edge_shows_whether_it_stands_on_the_floor(stands_on_mm, factor):
    scale = CameraScale(0.0, {"mug"})
    for driven_mm in range(0, 1400, 40):
        true_mm = 2000.0 - driven_mm
        seen, floor_mm = _sighting(true_mm / factor), true_mm * 200.0 / (200.0 - stands_on_mm)
        scale.assume_on_floor(seen, floor_mm)
        if driven_mm == 0:
            assert scale.corrected(seen).distance_mm == pytest.approx(floor_mm)
            assert scale.unknown("mug")
        scale.learn(seen, Pose(driven_mm, 0.0, 0.0), None, floor_mm)
    assert scale.factor("mug") == pytest.approx(factor, rel=0.1)
    assert not scale.unknown("mug")


def test_other_targets_do_not_begin_with_the_factor_of_a_guess():
    scale = CameraScale(0.0, {"mug"})
    for driven_mm in range(0, 1400, 40):
        scale.learn(_sighting((2000.0 - driven_mm) / 2), Pose(driven_mm, 0.0, 0.0), None)
    assert scale.factor("lena") == 1.0
    assert not scale.unknown("lena")


@pytest.mark.parametrize(
    ("bearing_deg", "echo_ahead_mm", "distance_mm"),
    [(0.0, 800.0, 800.0), (0.0, 3000.0, 2000.0), (0.0, None, 2000.0), (25.0, 800.0, 2000.0)],
)
def test_an_echo_from_where_it_is_seen_bounds_an_unknown_distance(bearing_deg, echo_ahead_mm, distance_mm):
    assert limit_to_echo(_sighting(2000.0, bearing_deg), echo_ahead_mm).distance_mm == distance_mm


def test_what_is_nearer_than_its_guessed_size_says_is_smaller():
    sighting = replace(_sighting(2000.0), edges_mm=(-100.0, 50.0))
    assert limit_to_echo(sighting, 800.0).edges_mm == (-40.0, 20.0)
    assert limit_to_echo(sighting, 3000.0) == sighting
    assert limit_to_echo(_sighting(2000.0), 800.0).edges_mm is None
