"""Headline figures are paired by scenario, and a sweep's summary has the command to repeat it."""

import json
import platform
import shlex
import sys
import zipfile

import cv2
import numpy as np
import pytest
from sweep_results import broken_result, mission_result, target_result

import nxtdrive
from behaviors.profiles import registry
from nxtdrive.cli.main import main
from nxtdrive.tools.sweep.differences import beyond
from nxtdrive.tools.sweep.summary import HEADLINE, figures, reached_by
from nxtdrive.tools.sweep.summary_file import own_profiles


def _result(seed, times_s, *, contacts=0):
    targets = [target_result(time_s, spl=0.5, sct=0.25) for time_s in times_s]
    return mission_result(*targets, seed=seed, contacts=contacts, longest_run=1)


def test_headline_figures_count_by_the_missions_time():
    known = figures([_result(1, [59.0, 61.0]), _result(2, [121.0, None], contacts=3)], HEADLINE)
    means = {name: value.mean for name, value in known.items()}
    assert [means[name] for name in ("by 60 s", "by 120 s", "by 300 s", "success")] == [0.25, 0.5, 0.75, 0.75]
    assert (means["SPL"], means["SCT"], means["contacts"], means["longest run"]) == (0.375, 0.1875, 1.5, 1.0)


def test_what_both_do_alike_cancels_out_of_a_difference():
    """A difference that is the same in all scenarios has no width, however much scenarios differ."""
    hard, easy = _result(1, [None, 100.0], contacts=5), _result(2, [10.0, 20.0], contacts=1)
    ours = [each.model_copy(update={"contacts": each.contacts + 2}) for each in (hard, easy)]
    more = beyond(ours, [hard, easy])
    assert (more["contacts"].low, more["contacts"].mean, more["contacts"].high) == (2.0, 2.0, 2.0)
    assert all(more[name].mean == 0.0 for name in HEADLINE if name != "contacts")


def test_a_mission_that_broke_counts_in_every_figure_of_targets():
    results = [_result(1, [10.0, 20.0]), broken_result(seed=2)]
    known = figures(results, HEADLINE)
    assert (known["success"].mean, known["SPL"].mean, known["SCT"].mean) == (0.5, 0.25, 0.125)
    assert [figures(results)[name].mean for name in ("spl", "soft_spl", "sct")] == [0.25, 0.5, 0.125]
    assert reached_by(results, np.array([15.0, 30.0])).tolist() == [0.25, 0.5]


@pytest.mark.parametrize("swapped", [False, True])
def test_a_mission_that_broke_reached_nothing_and_has_no_contacts_to_compare(swapped):
    ours, theirs = ([broken_result(seed=2)], [_result(2, [10.0, 20.0], contacts=4)])[:: -1 if swapped else 1]
    more = beyond(ours, theirs)
    assert more["by 60 s"].mean == (1.0 if swapped else -1.0)
    assert more["contacts"].number == 0


@pytest.mark.slow
def test_a_sweep_leaves_a_summary_by_which_it_can_be_repeated(here, capsys):
    command = ["sweep", "--classes", "open", "--seeds", "100", "--profiles", "thesis,oracle", "--out", "a.jsonl"]
    assert main(command) == 0
    first = json.loads((here / "a.summary.json").read_text())
    assert (
        first["versions"].items()
        >= {
            **{"nxtdrive": nxtdrive.__version__, "python": platform.python_version()},
            **{"numpy": np.__version__, "opencv": cv2.__version__},
        }.items()
    )
    assert first["seeds"] == {"open": [100]}
    assert set(first["paired"]) == {"thesis - oracle", "oracle - thesis"}
    assert set(first["policies"]["oracle"]["headline"]) == set(HEADLINE)
    assert main([*shlex.split(shlex.join(first["command"]))[1:], "--out", "b.jsonl"]) == 0
    assert (here / "a.jsonl").read_bytes() == (here / "b.jsonl").read_bytes()
    assert main([*command[:-1], "b.jsonl"]) != 0
    assert "exists already" in capsys.readouterr().err


@pytest.mark.slow
def test_a_summary_names_the_versions_that_performed_its_missions(here, capsys):
    command = ["sweep", "--classes", "open", "--agents", "oracle", "--out", "a.jsonl", "--resume", "--seeds"]
    assert main([*command, "100"]) == 0
    first = json.loads((here / "a.summary.json").read_text())
    assert first["earlier_versions"] == []
    older = {**first["versions"], "sources": "of yesterday"}
    (here / "a.summary.json").write_text(json.dumps({**first, "versions": older}))
    capsys.readouterr()
    for _ in range(2):
        assert main([*command, "100-101"]) == 0
        second = json.loads((here / "a.summary.json").read_text())
        assert (second["versions"], second["earlier_versions"]) == (first["versions"], [older])
        assert "other versions of nxtdrive or its libraries" in capsys.readouterr().err


PROFILE = "from behaviors.profiles.adaptive import AdaptiveProfile\nclass Calm(AdaptiveProfile):\n    pass\n"


@pytest.mark.slow
def test_a_summary_distinguishes_versions_of_a_profile_of_your_own(here, monkeypatch, capsys):
    monkeypatch.setattr(sys, "path", [str(here), *sys.path])
    monkeypatch.setattr(registry, "external_profiles", {})
    command = ["sweep", "--classes", "open", "--out", "a.jsonl", "--resume", "--agents", "calm:Calm", "--seeds"]

    def swept(text, seeds):
        (here / "calm.py").write_text(text)
        assert main([*command, seeds]) == 0
        return json.loads((here / "a.summary.json").read_text())["profiles"], capsys.readouterr().err

    first, _ = swept(PROFILE, "100")
    assert list(first) == ["calm:Calm"]
    again, said = swept(PROFILE, "100-101")
    assert again == first
    assert "has changed" not in said
    second, said = swept(PROFILE + "# better\n", "100-102")
    assert second["calm:Calm"][0] == first["calm:Calm"][0] != second["calm:Calm"][1]
    assert "calm:Calm has changed since some of its missions in a.jsonl" in said
    sys.modules.pop("calm")


def test_a_profile_in_a_package_without_init_has_a_digest(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    monkeypatch.setattr(registry, "external_profiles", {})
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "calm.py").write_text(PROFILE)
    registry.find_profile("mine.calm:Calm")
    (digest,) = own_profiles(tmp_path / "none.summary.json")["mine.calm:Calm"]
    assert len(digest) == 64
    for name in ("mine.calm", "mine"):
        sys.modules.pop(name)


def test_a_profile_whose_source_is_in_no_folder_has_no_digest(tmp_path, monkeypatch):
    archive = tmp_path / "mine.zip"
    with zipfile.ZipFile(archive, "w") as file:
        file.writestr("zipped.py", PROFILE)
    monkeypatch.setattr(sys, "path", [str(archive), *sys.path])
    monkeypatch.setattr(registry, "external_profiles", {})
    registry.find_profile("zipped:Calm")
    assert own_profiles(tmp_path / "none.summary.json") == {}
    sys.modules.pop("zipped")
    assert own_profiles(tmp_path / "none.summary.json") == {}
