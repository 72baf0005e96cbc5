"""Every block of code in a document is run on the simulated brick; `NOT_RUN` gives the reasons for the others."""

from __future__ import annotations

import contextlib
import glob
import json
import os
import pty
import re
import shlex
import shutil
import signal
import subprocess
import sys
import termios
import threading

import pytest

from behaviors.mission.robot import load_robot_file
from nxtdrive import open_brick
from nxtdrive.cli.main import DONE, NO_BRICK, NOT_ACHIEVED, USAGE, main
from nxtdrive.tools.web.classroom.config import read_classroom
from sim_backend.faults_file import load_faults
from tests.architecture.document_blocks import (
    BLOCK,
    DOCUMENTS,
    EXAMPLES,
    IN_A_SHELL,
    IN_A_TERMINAL,
    LASTING,
    LONG,
    NOT_RUN,
    PROGRAM,
    ROOT,
    blocks,
    commands,
    make_home,
    reason,
    shortened,
    simulated,
)

MISSION = '[mission]\nname = "shown"\ntargets = ["{}"]\n'
LENA = '[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'

ELSEWHERE = {
    "docs/sweep.md": "tests/tools/sweep/test_sweep_document.py",
    "docs/first-mission.md": "tests/architecture/test_document_outputs.py",
    "docs/gym.md": "tests/nxtdrive/gym/test_gym.py",
    "docs/journal.md": "tests/nxtdrive/recording/test_journal_csv.py",
    "docs/web-protocol.md": "tests/tools/web/test_web_document.py",
    "docs/worlds.md": "tests/nxtdrive/cli/test_cli_world.py",
}
"""Pages whose blocks of Python or TOML are run by a test of their own."""

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("document blocks")]


def _blocks(*languages):
    """Every block in one of these languages, as a parameter: its document and its text."""
    return [
        pytest.param(page, text, id=f"{page}-{number}")
        for page, number, text in blocks(*languages)
        if not (page in ELSEWHERE and {"python", "toml"}.intersection(languages))
    ]


def _run(command):
    elsewhere = (LASTING, IN_A_TERMINAL, IN_A_SHELL, PROGRAM)
    return not (reason(command) or any(pattern.search(command) for pattern in elsewhere))


SHELL = [(each, commands(each.values[1])) for each in _blocks("", "sh")]
LASTING_COMMANDS = sorted({each for _, said in SHELL for each in said if LASTING.search(each) and not reason(each)})
DRAWN = {each for _, said in SHELL for each in said if IN_A_TERMINAL.search(each) and "usb://" not in each}
IN_TERMINALS = sorted({" ".join(simulated(each)) for each in DRAWN})
PROGRAMS = [
    pytest.param(each.values[0], one, marks=[pytest.mark.nightly] * bool(LONG.search(one)), id=one.partition("  ")[0])
    for each, said in SHELL
    for one in said
    if PROGRAM.search(one) and not reason(one)
]


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    folder = tmp_path_factory.mktemp("home")
    make_home(folder)
    return folder


@pytest.fixture(scope="module")
def home_with_runs(home, tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "home"
    shutil.copytree(home, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        assert main(["run", "--profile", "adaptive", "--no-video"]) == DONE
    return folder


@pytest.fixture
def here(home, tmp_path, monkeypatch):
    """A copy of it, as the current folder."""
    shutil.copytree(home, tmp_path / "home")
    monkeypatch.chdir(tmp_path / "home")
    yield from _installed(tmp_path / "home", monkeypatch)


@pytest.fixture
def here_with_runs(home_with_runs, tmp_path, monkeypatch):
    """A copy of the one with runs, as the current folder."""
    shutil.copytree(home_with_runs, tmp_path / "home")
    monkeypatch.chdir(tmp_path / "home")
    yield from _installed(tmp_path / "home", monkeypatch)


def _installed(folder, monkeypatch):
    """Put a folder with installed packages on the path; the import system forgets their modules afterwards."""
    monkeypatch.setattr(sys, "path", [str(folder), *sys.path])
    yield folder
    for path in folder.glob("*.py"):
        sys.modules.pop(path.stem, None)


def _do(words):
    devices = (NO_BRICK,) if words[0] in ("list", "doctor") else ()  # this computer may have none
    assert main(words) in (DONE, NOT_ACHIEVED, *devices), words


def _call(module_and_words, **options):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    subprocess.run([sys.executable, *module_and_words], env=environment, check=True, timeout=300, **options)


@pytest.mark.parametrize(
    ("page", "text"), [each for each, said in SHELL if any(_run(one) and not LONG.search(one) for one in said)]
)
def test_commands_run(page, text, here, monkeypatch):
    monkeypatch.setenv("PATH", os.path.dirname(sys.executable), prepend=os.pathsep)  # for `sim exec`
    notes = [block for _, block in BLOCK.findall((ROOT / page).read_text(encoding="utf-8")) if "!tick" in block]
    (here / "tone.txt").write_text("".join(notes), encoding="utf-8")
    for command in commands(text):
        if not _run(command) or LONG.search(command):
            continue
        if command.startswith("python -m tools."):
            _call(shlex.split(command, comments=True)[1:])
        else:
            _do(simulated(command))


@pytest.mark.nightly
@pytest.mark.parametrize(
    ("page", "text"), [each for each, said in SHELL if any(_run(one) and LONG.search(one) for one in said)]
)
def test_whole_missions_run(page, text, here_with_runs):
    """The other commands of their blocks as well, since they may make files for them."""
    if "--plot" in text:
        pytest.importorskip("matplotlib", reason="needs the extra nxtdrive[plot]")
    if "behaviors/adaptive" in text:  # elsewhere it would hide the package from workers
        (here_with_runs / "behaviors" / "adaptive").mkdir(parents=True)
    for command in filter(_run, commands(text)):
        if command.startswith("python -m tools."):
            _call(shlex.split(command, comments=True)[1:])
        else:
            _do(shortened(simulated(command), sorted(glob.glob("runs/*"))))


@pytest.mark.parametrize(("page", "command"), PROGRAMS)
def test_programs_of_the_examples_run_in_the_simulator(page, command, tmp_path, monkeypatch):
    folder = tmp_path / "example"
    shutil.copytree((ROOT / page).parent, folder)
    program = PROGRAM.search(command)
    if environment := program["environment"]:
        monkeypatch.setenv(*environment.strip().split("=", 1))
    _call(program["words"].split(), cwd=folder)


@pytest.mark.parametrize("words", IN_TERMINALS)
def test_commands_for_a_terminal_draw_and_end_with_a_key(words, here):
    keyboard, terminal = pty.openpty()
    termios.tcsetwinsize(terminal, (24, 80))
    command, environment = [sys.executable, "-m", "nxtdrive", *words.split()], {**os.environ, "TERM": "xterm-256color"}
    with subprocess.Popen(command, stdin=terminal, stdout=terminal, stderr=terminal, env=environment) as program:
        os.close(terminal)
        late = threading.Timer(60, program.kill)
        late.start()
        screen = bytearray()
        with contextlib.suppress(OSError):  # at the end of the program
            while data := os.read(keyboard, 65536):
                screen += data
                if b"at rest" in screen:
                    os.write(keyboard, b"\x1b")
        late.cancel()
    os.close(keyboard)
    assert program.returncode == DONE, screen


@pytest.mark.parametrize("command", LASTING_COMMANDS)
def test_commands_that_keep_running_start_and_end_on_request(command, here):
    (here / "examples").symlink_to(EXAMPLES)
    words = [each.replace("/tmp/", f"{here}/") for each in simulated(command)]
    if words[0] in ("web", "serve"):
        words += ["--port", "0"]
    with subprocess.Popen(
        [sys.executable, "-m", "nxtdrive", *words],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as program:
        late = threading.Timer(60, program.kill)
        late.start()
        first = ""
        if words[0] != "mcp":  # which ends when the assistant does, with its input
            first = program.stdout.readline()
            program.send_signal(signal.SIGINT)
        said = first + program.communicate()[0]
        late.cancel()
    assert program.returncode in (DONE, 130), said
    assert "Traceback" not in said


def test_every_reason_is_needed():
    said = [each for _, several in SHELL for each in several]
    for pattern in NOT_RUN:
        assert any(re.search(pattern, command) for command in said), pattern
    assert all((ROOT / test).exists() for test in ELSEWHERE.values())


@pytest.mark.parametrize(
    ("page", "text"),
    [each for each in _blocks("python") if not re.search(r"def test_|^sim_world\.", each.values[1])],
)
def test_python_runs(page, text, here):
    text = text.replace('nxt="usb://", camera="0"', 'nxt="sim://"').replace("usb://", "sim://track")
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
    (here / "follow.rxe").write_bytes((ROOT / "tests/golden/programs/line_follower.rxe").read_bytes())
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
