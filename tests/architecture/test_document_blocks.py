"""Every block of code in a document is run on the simulated brick; `NOT_RUN` gives the reasons for the others."""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from behaviors.robot_description import load_robot_file
from nxtdrive import open_brick
from nxtdrive.cli.main import DONE, NOT_ACHIEVED, USAGE, main
from nxtdrive.tools.web.classroom.config import read_classroom
from sim_backend.bundled import PICTURES
from sim_backend.faults_file import load_faults

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *EXAMPLES.glob("*/README.md")])
BLOCK = re.compile(r"^ *```(\w*)\n(.*?)^ *```", flags=re.DOTALL | re.MULTILINE)
COMMAND = re.compile(
    r"^ *(?:\w+=\S+ )?(?:sudo|nxtdrive|\.venv\S+|\.|python3?|py|pip3?|pytest|dask|jason|javac?|for) .*"
)

NOT_RUN = {
    r"sudo |-m tools\.rig |tests/hil ": "needs a virtual machine or devices of the system",
    r"-m venv |install |^\. ": "changes an environment; test_packaging.py, test_distribution.py and .ci/run install",
    r"^(\.venv/bin/)?pytest|=\S+ pytest|for each in": "tests/nxtdrive/test_pytest_plugin.py runs the examples' tests",
    r"^(\w+=\S+ )?(\.venv/bin/)?python (?!-m)": "programs of the examples, which their own tests call",
    r"^dask |--dask |^jason |^javac? ": "needs a cluster, or Jason",
    r"^nxtdrive (web|serve|teleop|mcp|monitor|sim serve|run --web)": "goes on until it is ended; has tests of its own",
    r"^nxtdrive (list|doctor)": "what it says depends on the devices of this computer",
    r"^nxtdrive sim exec": "tests/interop runs it",
    r"^nxtdrive (bench|sweep(?! --map))|tools\.dev\.(faults|reality_table)": "takes minutes to days",
    r"lamp\.toml": "needs the example installed; tests/nxtdrive/vision/test_detectors_from_elsewhere.py",
    r"^nxtdrive what-if": "takes minutes",
    r"nxtdrive run": "a whole mission; tests/missions and test_distribution.py run such",
    r"^nxtdrive (explain-run|chances) ": "needs a run; tests/nxtdrive/cli explains and counts recorded ones",
    r"^nxtdrive calibrate --nxt": "drives for minutes; tests/tools/calibrate",
    r"-m build|twine |check_wheel_contents ": "test_distribution.py builds, and runs them on what was built",
}
"""Commands that are printed and not run here, by a pattern of them, with the reason."""

MISSION = '[mission]\nname = "shown"\ntargets = ["{}"]\n'
LENA = '[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'

ELSEWHERE = {
    "docs/gym.md": "tests/nxtdrive/gym/test_gym.py",
    "docs/journal.md": "tests/nxtdrive/recording/test_journal_csv.py",
    "docs/web-protocol.md": "tests/tools/web/test_web_document.py",
    "docs/worlds.md": "tests/nxtdrive/cli/test_cli_world.py",
}
"""Pages whose blocks of Python or TOML are run by a test of their own."""

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("document blocks")]


def _blocks(*languages):
    """Every block in one of these languages, as a parameter: its document and its text."""
    found = []
    for path in DOCUMENTS:
        page = path.relative_to(ROOT).as_posix()
        for number, (language, text) in enumerate(BLOCK.findall(path.read_text(encoding="utf-8"))):
            if language in languages and not (language in ("python", "toml") and page in ELSEWHERE):
                found.append(pytest.param(page, text, id=f"{page}-{number}"))
    return found


def _commands(text):
    lines = [line.strip() for line in text.splitlines() if COMMAND.match(line) and "──" not in line]
    return [shlex.join(shlex.split(line, comments=True)) if "nxtdrive " in line else line for line in lines]


def _reason(command):
    return next((reason for pattern, reason in NOT_RUN.items() if re.search(pattern, command)), None)


SHELL = [each for each in _blocks("", "sh") if any(not _reason(command) for command in _commands(each.values[1]))]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder with what the documents speak of: a photograph, a mission and its room, a program."""
    folder = tmp_path_factory.mktemp("home")
    shutil.copy(PICTURES / "fox.png", folder / "my-cat.jpg")
    shutil.copy(EXAMPLES / "careful-explorer" / "careful_explorer.py", folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        new = ["mission", "new", "--picture", "my-cat.jpg", "--height-mm", "297", "my-mission.toml"]
        assert main(new) == DONE
    return folder


@pytest.fixture
def here(home, tmp_path, monkeypatch):
    """A copy of it, as the current folder."""
    shutil.copytree(home, tmp_path / "home")
    monkeypatch.chdir(tmp_path / "home")
    return tmp_path / "home"


def _simulated(command):
    """The words of a command after `nxtdrive`, with the simulated robot in the place of a brick and its webcam."""
    words = command.replace("usb://", "sim://").replace("detect try 0", "detect try my-cat.jpg")
    return shlex.split(words)[1:]


@pytest.mark.parametrize(("page", "text"), SHELL)
def test_commands_run(page, text, here, request):
    notes = [block for _, block in BLOCK.findall((ROOT / page).read_text(encoding="utf-8")) if "!tick" in block]
    (here / "tone.txt").write_text("".join(notes), encoding="utf-8")
    for command in _commands(text):
        if not _reason(command):
            assert main(_simulated(command)) in (DONE, NOT_ACHIEVED), command


def test_every_reason_is_needed():
    commands = [command for each in _blocks("", "sh") for command in _commands(each.values[1])]
    for pattern in NOT_RUN:
        assert any(re.search(pattern, command) for command in commands), pattern
    assert all((ROOT / test).exists() for test in ELSEWHERE.values())


@pytest.mark.parametrize(
    ("page", "text"),
    [each for each in _blocks("python") if not re.search(r"def test_|^sim_world\.", each.values[1])],
)
def test_python_runs(page, text, here):
    text = text.replace('nxt="usb://", camera="0"', 'nxt="sim://my-mission-world.toml"').replace(
        "usb://", "sim://track"
    )
    if "open_brick" in text:
        exec(text, {})
    else:  # what is shown goes on with a brick that is open
        with open_brick("sim://track") as brick:
            exec(text, {"brick": brick})


def test_the_tests_that_are_shown_pass(here):
    """In a project of its own, as a reader would paste them; what they leave out is put in front."""
    tests = [each.values for each in _blocks("python") if "def test_" in each.values[1]]
    assert len(tests) > 3
    mission = MISSION.format("lena") + 'profile = "thesis"\n' + LENA  # as the page says
    (here / "find_lena.toml").write_text(mission, encoding="utf-8")
    for number, (_, text) in enumerate(tests):
        (here / f"test_{number}.py").write_text(f"from careful_explorer import explore\n{text}", encoding="utf-8")
    (here / "pytest.ini").write_text("[pytest]\n", encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-p", "nxtdrive.pytest_plugin"]
    done = subprocess.run(command, cwd=here, capture_output=True, text=True, check=False, timeout=120)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize(("page", "text"), _blocks("toml"))
def test_toml_is_read_by_what_it_is_for(page, text, here, capsys):
    file = here / "shown.toml"
    file.write_text(text, encoding="utf-8")
    if "entry-points" in text:
        assert any(text in path.read_text(encoding="utf-8") for path in EXAMPLES.glob("*/pyproject.toml"))
    elif "\n[robot]" in text:
        assert load_robot_file(file).robot
    elif "[classroom]" in text:
        (here / "missions").mkdir()
        for name in ("my-mission.toml", "my-cat.jpg"):
            shutil.copy(name, here / "missions" / name.replace("my-mission", "cat"))
        assert read_classroom(file, here, here).name
    elif "drop_requests" in text:
        assert load_faults(file).drop_requests
    else:
        shutil.copy(ROOT / "behaviors" / "adaptive" / "chances.json", here)
        file.write_text(_whole_mission(text), encoding="utf-8")
        missing = re.findall(r'^model = "(.*?)"', text, flags=re.MULTILINE)
        assert main(["mission", "check", "shown.toml"]) == (USAGE if missing else DONE)
        said = "".join(capsys.readouterr())
        assert all(f"1 mistake\n  target.cup.model: there is no file '{name}'" in said for name in missing)


def _whole_mission(text):
    """A mission with a table that a document shows alone."""
    if "[mission]" in text:
        return text
    targets = re.findall(r"^\[target\.(\w+)\]", text, flags=re.MULTILINE)
    return MISSION.format(*targets or ["lena"]) + text + ("" if targets else LENA)


@pytest.mark.parametrize(("page", "text"), _blocks("json"))
def test_what_is_written_for_an_assistant_starts_a_command(page, text, capsys):
    for server in json.loads(text)["mcpServers"].values():
        with pytest.raises(SystemExit) as ended:
            main([*server["args"], "--help"])
        assert ended.value.code == DONE


def test_no_language_is_left_out():
    known = {
        "",
        "sh",
        "python",
        "toml",
        "json",
        "mermaid",
    }
    assert {language for path in DOCUMENTS for language, _ in BLOCK.findall(path.read_text(encoding="utf-8"))} <= known
