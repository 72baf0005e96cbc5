"""Profiles that are not part of nxtdrive: named by module and class, or installed."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest

from behaviors.mission import Mission, MissionError
from behaviors.profile_names import PAST, named_profiles, profile_name
from behaviors.profiles import registry
from behaviors.profiles.adaptive import AdaptiveProfile
from behaviors.profiles.registry import find_profile
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
from nxtdrive.signals import Terminated
from nxtdrive.tools.sweep.task import Task, evaluate
from nxtdrive.tools.web.messages import read_message
from nxtdrive.tools.web.missions import Missions

EXAMPLE = Path(__file__).parents[2] / "examples" / "patient-profile"
JOURNAL = Path(__file__).parents[1] / "nxtdrive" / "cli" / "journals" / "format-2.jsonl"


@pytest.fixture(autouse=True)
def _folder(monkeypatch, here):
    """A folder with the example's module, and an import system that forgets it afterwards."""
    (here / "patient.py").write_text((EXAMPLE / "patient.py").read_text(encoding="utf-8"), encoding="utf-8")
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(registry, "external_profiles", {})
    yield
    for name in ("patient", "odd", "looker"):
        sys.modules.pop(name, None)


def _install(folder, name="patient", offered="patient:Patient"):
    info = folder / "patient_profile-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: patient-profile\nVersion: 1.0\n", encoding="utf-8")
    (info / "entry_points.txt").write_text(f"[nxtdrive.profiles]\n{name} = {offered}\n", encoding="utf-8")
    sys.path.insert(0, str(folder))


def test_a_class_of_this_folder_is_a_profile():
    assert find_profile("patient:Patient").__name__ == "Patient"


def test_an_installed_profile_is_found_by_its_name(tmp_path):
    with pytest.raises(ValueError, match="must be thesis, adaptive, a class"):
        profile_name("patient")
    _install(tmp_path)
    assert profile_name("patient") == "patient"
    assert find_profile("patient").__name__ == "Patient"


def test_the_skill_that_is_shown_searches(tmp_path, sim_world, sim_brick):
    page = (EXAMPLE.parents[1] / "docs" / "profiles.md").read_text(encoding="utf-8")
    [block] = [text for text in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "class LookRound" in text]
    (tmp_path / "looker.py").write_text(block, encoding="utf-8")
    text = '[mission]\ntargets = ["lena"]\nprofile = "looker:Looker"\n[target.lena]\ndetector = "picture"\n'
    (tmp_path / "m.toml").write_text(f'{text}pictures = ["lena.png"]\n', encoding="utf-8")
    sim_world.put("lena", x_mm=1500, y_mm=2000)
    assert sim_world.run_mission(sim_brick, "m.toml").achieved


@pytest.mark.parametrize("name", ["patent", "adaptiv"])
def test_a_mistyped_name_leads_to_the_nearest_profile(tmp_path, name):
    _install(tmp_path)
    with pytest.raises(
        MissionError, match=rf"no installed package offers '{name}'; did you mean '(patient|adaptive)'\?"
    ):
        find_profile(name)


def test_a_built_in_profile_keeps_its_name(tmp_path):
    _install(tmp_path, "adaptive")
    assert named_profiles() == ["thesis", "adaptive"]
    assert find_profile("adaptive") is AdaptiveProfile


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("patient:Nobody", "cannot be loaded: AttributeError"),
        ("missing:Profile", "cannot be loaded: ModuleNotFoundError"),
        ("odd:Profile", "odd.py:1: ZeroDivisionError: division by zero; correct that line."),
        ("missing:Profile", "name it as module:Class in the folder of module.py"),
        ("patient.py:Patient", "leave out `.py`: patient:Patient."),
        ("./patient:Patient", "name it as patient:Patient in the folder of patient.py."),
        ("my profiles\\patient.py:Patient", "name it as patient:Patient in the folder of patient.py."),
        ("../profiles/patient.py:Patient", "'../profiles/patient.py' is a path, not the name of a module;"),
        ("patient:Nobody", "correct the name of the class, or write it in {folder}/patient.py."),
        ("slip:Profile", "{folder}/slip.py:2: SyntaxError: expected ':'; correct that line."),
        (
            "needs:Profile",
            "{folder}/needs.py:1: ModuleNotFoundError: No module named 'lamps'; install the package",
        ),
        ("patient:PatientPolicy", "lacks own_policy, skill, learn, evidence"),
    ],
)
def test_anything_that_is_not_a_profile_gives_a_sentence(tmp_path, name, text, refused):
    (tmp_path / "odd.py").write_text("1 / 0\n", encoding="utf-8")
    (tmp_path / "slip.py").write_text("\nclass Profile\n", encoding="utf-8")
    (tmp_path / "needs.py").write_text("import lamps\n", encoding="utf-8")
    text = text.format(folder=tmp_path)
    with pytest.raises(MissionError, match=re.escape(text)):
        find_profile(name)
    for command in (["run", "--policy"], ["sweep", "--policies"]):
        assert text in refused(*command, name)


@pytest.mark.parametrize(
    ("offered", "text"),
    [
        (
            "patient:Nobody",
            "has no attribute 'Nobody'; correct the name of the class, or write it in {folder}/patient.py.",
        ),
        ("patient Patient", "its entry point is 'patient Patient', not module:Class; correct it in its package."),
        ("", "its entry point is '', not module:Class; correct it in its package."),
        ("patient", "its entry point is 'patient', not module:Class; correct it in its package."),
        ("gone:Patient", "No module named 'gone'; install the package of gone, or correct the import."),
    ],
)
def test_an_installed_profile_that_cannot_be_loaded_gives_a_sentence(tmp_path, offered, text):
    _install(tmp_path, "calm", offered)
    with pytest.raises(MissionError, match=re.escape(text.format(folder=tmp_path))):
        find_profile("calm")


def test_a_client_may_choose_an_installed_profile_or_the_missions_own_and_no_other_module(tmp_path):
    (tmp_path / "odd.py").write_text("1 / 0\n", encoding="utf-8")
    mission = '[mission]\ntargets = ["tag"]\nprofile = "patient:Patient"\n[target.tag]\ndetector = "marker"\nid = 7\n'
    (tmp_path / "own.toml").write_text(mission, encoding="utf-8")
    missions = Missions(tmp_path)
    for name in ("odd:Profile", "patient"):
        with pytest.raises(ValueError, match=f"There is no profile '{name}' here: choose thesis, adaptive"):
            missions.load("", name)
    assert missions.load("own.toml", "patient:Patient") == missions.load("own.toml")
    _install(tmp_path)
    for name in ("thesis", "patient"):
        chosen = json.dumps({"type": "start_mission", "mission": "own.toml", "profile": name})
        assert missions.load("own.toml", read_message(chosen).profile).mission.profile == name


def test_a_mission_may_name_an_installed_profile_only(tmp_path, refused):
    mission = tmp_path / "mission.toml"
    mission.write_text(
        '[mission]\ntargets = ["tag"]\nprofile = "patient"\n[target.tag]\ndetector = "marker"\nid = 7\n',
        encoding="utf-8",
    )
    said = refused("mission", "check", mission)
    assert "must be thesis, adaptive, a class as package.module:Class, or an installed profile" in said
    assert "or an installed profile, not 'patient'" in said
    mission.write_text(mission.read_text(encoding="utf-8").replace("patient", "adaptiv"), encoding="utf-8")
    assert "there is no profile 'adaptiv'; did you mean 'adaptive'?" in refused("mission", "check", mission)
    mission.write_text(mission.read_text(encoding="utf-8").replace("adaptiv", "patient"), encoding="utf-8")
    _install(tmp_path)
    assert main(["mission", "check", str(mission)]) == DONE


@pytest.mark.slow
def test_an_external_profile_is_swept(tmp_path):
    words = ["--classes", "block_transient", "--seeds", "100", "--policies", "patient:Patient"]
    assert main(["sweep", *words, "--out", "patient.jsonl"]) == DONE
    lines = [json.loads(line) for line in (tmp_path / "patient.jsonl").read_text(encoding="utf-8").splitlines()]
    assert {line["policy"] for line in lines} == {"patient:Patient"}
    chosen = [choice for line in lines for choice in line["choices"]]
    assert "wait" in {choice["choice"] for choice in chosen}


@pytest.mark.slow
def test_a_run_says_which_external_profile_drove(tmp_path, capsys, printed):
    mission = tmp_path / "short.toml"
    text = '[mission]\ntargets = ["tag"]\ntime_limit_s = 2\n[target.tag]\ndetector = "marker"\nid = 7\n'
    mission.write_text(text, encoding="utf-8")
    assert main(["run", str(mission), "--policy", "patient:Patient", "--no-video", "--out", "runs"]) == NOT_ACHIEVED
    (run,) = (tmp_path / "runs").iterdir()
    capsys.readouterr()
    assert "profile patient:Patient" in printed("explain-run", run)


@pytest.mark.parametrize("name", ["patient", "gone:Patient"])
def test_a_run_is_explained_and_exported_where_its_profile_is_not(tmp_path, capsys, printed, name):
    mission = Mission.model_validate(
        {"mission": {"targets": ["lena"], "profile": name}, "target": {"lena": {"detector": "color", "color": "red"}}},
        context=PAST,
    )
    (tmp_path / "mission.json").write_text(mission.model_dump_json(), encoding="utf-8")
    (tmp_path / "journal.jsonl").write_bytes(JOURNAL.read_bytes())
    said = " ".join(printed("explain-run", tmp_path).split())
    assert f"profile {name}" in said
    assert f"profile '{name}' cannot be loaded: ModuleNotFoundError" in said
    assert "no mission.json" not in said
    assert "reached after" in said, "the decisions are there without the profile"
    assert main(["export", str(tmp_path), "--html"]) == DONE
    assert main(["explain-run", str(tmp_path), "--profile", "gone:Patient"]) == USAGE
    assert "in the folder of module.py, or install its package" in capsys.readouterr().err


BROKEN = """\
from behaviors.profiles.adaptive import AdaptiveProfile

class Odd(AdaptiveProfile):
    def skill(self, state, choice):
        return self.skills[state]
"""


@pytest.mark.slow
def test_an_exception_in_a_profile_is_one_sentence_with_its_place(tmp_path, refused):
    (tmp_path / "odd.py").write_text(BROKEN, encoding="utf-8")
    words = ["run", "--no-video", "--profile", "odd:Odd"]
    (said,) = refused(*words).splitlines()
    expected = (
        f"profile 'odd:Odd' failed at {tmp_path / 'odd.py'}:5: AttributeError: 'Odd' object has no attribute 'skills'"
    )
    assert (
        said == f"nxtdrive: {expected}. Correct it there, or report it to the profile's author. -v shows the traceback."
    )
    (run,) = (tmp_path / "runs").iterdir()
    assert "no attribute 'skills'" in json.loads((run / "summary.json").read_text(encoding="utf-8"))["error"]
    assert "Traceback" in refused(*words, "-v")


@pytest.mark.parametrize(
    ("fails", "error"),
    [
        ("return self.skills[state]", "AttributeError"),
        ("import sys; sys.exit(3)", "SystemExit"),
        ("raise SystemExit", "SystemExit"),
    ],
)
def test_the_line_of_a_swept_mission_has_the_place_where_its_profile_failed(fails, error, tmp_path):
    (tmp_path / "odd.py").write_text(BROKEN.replace("return self.skills[state]", fails), encoding="utf-8")
    line = evaluate(Task(0, "open", 100, "odd:Odd", "geometric"))
    assert f"profile 'odd:Odd' failed at {tmp_path / 'odd.py'}:5: {error}" in line.error


EXITS = {
    "in a skill": "    def skill(self, state, choice):\n        sys.exit(3)\n",
    "as it is made": "    def __init__(self, *_, **named):\n        sys.exit()\n",
    "as its policy is made": "    @classmethod\n    def own_policy(cls, mission):\n        sys.exit(3)\n",
    "as its policy chooses": (
        "    @classmethod\n    def own_policy(cls, mission):\n        return Rash()\n"
        "class Rash:\n    def select(self, evidence):\n        sys.exit(3)\n"
    ),
}


@pytest.mark.parametrize("where", EXITS)
def test_a_profile_that_exits_does_not_end_a_run_in_silence(where, tmp_path, refused):
    text = "import sys\nfrom behaviors.profiles.adaptive import AdaptiveProfile\nclass Odd(AdaptiveProfile):\n"
    (tmp_path / "odd.py").write_text(text + EXITS[where], encoding="utf-8")
    words = ["explain-run", str(JOURNAL)] if "policy" in where else ["run", "--no-video"]
    said = refused(*words, "--profile", "odd:Odd")
    assert f"profile 'odd:Odd' failed at {tmp_path / 'odd.py'}:" in said
    assert "SystemExit" in said
    assert "A profile must not end the program: return from the method, or raise an exception." in said
    if where == "in a skill":
        (run,) = (tmp_path / "runs").iterdir()
        assert "SystemExit: 3" in json.loads((run / "summary.json").read_text(encoding="utf-8"))["error"]


def test_a_module_that_exits_is_no_profile(tmp_path, capsys):
    (tmp_path / "odd.py").write_text("import sys\nsys.exit(3)\n", encoding="utf-8")
    assert main(["run", "--no-video", "--profile", "odd:Odd"]) == USAGE
    assert f"{tmp_path / 'odd.py'}:2: SystemExit: 3; correct that line." in capsys.readouterr().err


def test_a_signal_that_comes_while_a_profile_is_loaded_ends_the_command(tmp_path):
    leaves = "from nxtdrive.signals import Terminated\nraise Terminated(143)\n"
    (tmp_path / "odd.py").write_text(leaves, encoding="utf-8")
    with pytest.raises(Terminated):
        find_profile("odd:Odd")


@pytest.mark.parametrize(
    "begin",
    [
        lambda: main(["run", "--no-video", "--profile", "odd:Odd"]),
        lambda: evaluate(Task(0, "open", 100, "odd:Odd", "geometric")),
    ],
    ids=["mission", "sweep"],
)
def test_a_signal_in_a_profile_ends_a_mission_and_a_sweep(tmp_path, begin):
    leaves = "from nxtdrive.signals import Terminated; raise Terminated(143)"
    (tmp_path / "odd.py").write_text(BROKEN.replace("return self.skills[state]", leaves), encoding="utf-8")
    with pytest.raises(Terminated):
        begin()


def test_of_two_profiles_in_one_module_the_one_that_ran_is_named(tmp_path):
    (tmp_path / "odd.py").write_text(BROKEN + "\nclass Even(Odd):\n    pass\n", encoding="utf-8")
    for name in ("odd:Odd", "odd:Even"):
        find_profile(name)
    for name in ("odd:Odd", "odd:Even"):
        assert f"profile '{name}' failed at" in evaluate(Task(0, "open", 100, name, "geometric")).error
    with pytest.raises(AttributeError) as error:
        find_profile("odd:Odd").skill(None, "search", None)
    assert "profile 'odd:Even' or 'odd:Odd' failed at" in str(registry.raised_by_profile(error.value))


def test_a_bug_of_ours_is_not_the_fault_of_another_name_for_our_profile(tmp_path):
    (tmp_path / "odd.py").write_text(
        "from behaviors.profiles.adaptive import AdaptiveProfile as Odd\n", encoding="utf-8"
    )
    with pytest.raises(AttributeError) as error:
        find_profile("odd:Odd").own_policy(None)
    assert registry.raised_by_profile(error.value) is None


@pytest.mark.slow
def test_an_exception_that_the_profile_may_have_caused_keeps_its_traceback(tmp_path):
    text = "from patient import Patient\nclass Odd(Patient):\n    def __init__(self, *_, **named):\n"
    text += "        super().__init__(*_, **named)\n        self._perception = None\n"
    (tmp_path / "odd.py").write_text(text, encoding="utf-8")
    with pytest.raises(AttributeError) as error:
        main(["run", "--no-video", "--profile", "odd:Odd"])
    assert "a bug in the profile 'odd:Odd' or in nxtdrive" in error.value.__notes__[0]
