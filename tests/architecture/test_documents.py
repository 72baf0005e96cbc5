"""What the documents say matches the code."""

from __future__ import annotations

import ast
import contextlib
import json
import re
import shlex
import sys
import tomllib
from pathlib import Path

import pytest

from tests.architecture.document_blocks import blocks, commands, install_example

ROOT = Path(__file__).parents[2]
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
EXAMPLES = sorted((ROOT / "examples").glob("*/README.md"))


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_links_between_documents_lead_somewhere(path):
    for target in re.findall(r"\]\(([^)#]+)", path.read_text(encoding="utf-8")):
        if "://" not in target:
            assert (path.parent / target).exists(), f"{target} does not exist"


@pytest.mark.parametrize("path", sorted((ROOT / "docs").glob("*.md")), ids=lambda path: path.name)
def test_a_page_begins_by_saying_what_it_is_for(path):
    title, first = [line for line in path.read_text(encoding="utf-8").splitlines() if line][:2]
    assert title.startswith("# ")
    assert first[0].isalnum() or first[0] in "`[*", first


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_code_is_in_fences(path):
    """The tests run what is in fences; an indented block would be shown and never run."""
    text = re.sub(r"^ *```.*?^ *```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    assert not re.findall(r"^ +(?:nxtdrive|python3?|pip3?|pytest|sudo) .*", text, flags=re.MULTILINE)


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_drawings_and_commented_lines_of_code_fit_a_page(path):
    """The column of the site has room for about 100 characters; where these lines are broken they cannot be read."""
    blocks = re.findall(r"^ *```\w*\n(.*?)^ *```", path.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    for block in blocks:
        for line in block.splitlines():
            assert len(line) <= 100 or not re.search(r"\S\s+#|[─│▼├]", line), line


@pytest.mark.parametrize(
    ("page", "program"),
    [("profiles.md", "patient-profile/patient.py"), ("detectors.md", "lamp-detector/lamp.py")],
)
def test_a_page_shows_the_program_of_its_example(page, program):
    shown = f"```python\n{(ROOT / 'examples' / program).read_text(encoding='utf-8')}```\n"
    assert shown in (ROOT / "docs" / page).read_text(encoding="utf-8")


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_tests_that_documents_name_are_there(path):
    for file, name in re.findall(r"`(tests/[\w/]+\.py)(?:::(\w+))?`", path.read_text(encoding="utf-8")):
        tree = ast.parse((ROOT / file).read_text(encoding="utf-8"))
        names = [node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
        assert not name or name in names, f"{file} has no {name}"


SHELL = [(number, (page, text)) for page, number, text in blocks("", "sh") if "nxtdrive " in text]


def _misunderstood(command, capsys):
    """What the command line objects to in a command that a document prints."""
    from nxtdrive.cli.main import _parse

    with contextlib.suppress(SystemExit):
        _parse(shlex.split(command, comments=True)[1:])
    return capsys.readouterr().err


@pytest.mark.parametrize(("page", "text"), [pytest.param(*each, id=f"{each[0]}-{number}") for number, each in SHELL])
def test_nxtdrive_accepts_the_arguments_of_each_command_to_copy(page, text, tmp_path, monkeypatch, capsys):
    install_example(ROOT / "examples" / "patient-profile", tmp_path)
    monkeypatch.setattr(sys, "path", [str(tmp_path), *sys.path])
    for command in commands(text):
        assert not (command.startswith("nxtdrive ") and _misunderstood(command, capsys)), command


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_programs_to_run_exist(path):
    for program in re.findall(
        r"^(?:\S+ )?(?:\.venv/bin/)?python (\S+\.py)", path.read_text(encoding="utf-8"), re.MULTILINE
    ):
        assert (path.parent / program).exists() or (ROOT / program).exists(), program


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_commands_and_options_that_are_mentioned_exist(path, capsys):
    unknown = re.compile(r"unrecognized arguments|argument (COMMAND|ACTION): invalid choice")
    prose = re.sub(r"```.*?```", "", path.read_text(encoding="utf-8"), flags=re.DOTALL)
    for command in re.findall(r"`(nxtdrive [^`]+)`", prose):
        assert not unknown.search(_misunderstood(command, capsys)), command


@pytest.mark.parametrize("path", DOCUMENTS, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_what_is_to_be_installed_goes_into_a_named_environment(path):
    """README's first command makes one without pip: there a bare `pip install` would reach another Python."""
    named = re.compile(r"pip3? --python \.venv install|\.venv[/\\](bin[/\\]pip|Scripts[/\\]python -m pip) install")
    for line in re.findall(r".*\bpip3? .*install.*", path.read_text(encoding="utf-8")):
        assert named.search(line), line


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_extras_that_are_to_be_installed_exist(path):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    for extras in re.findall(r"(?:\.|nxtdrive)\[([a-z,]+)\]", path.read_text(encoding="utf-8")):
        assert set(extras.split(",")) <= set(project["optional-dependencies"]), extras


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.parent.name)
def test_an_example_that_uses_the_page_names_its_extra(path):
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"nxtdrive web|--web\b", text) or re.search(r"\[web\]|extra `web`", text)


@pytest.mark.parametrize("path", DOCUMENTS + EXAMPLES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_blocks_of_code_are_well_formed(path):
    parse = {"python": ast.parse, "toml": tomllib.loads, "json": json.loads}
    for language, block in re.findall(r"```(\w+)\n(.*?)```", path.read_text(encoding="utf-8"), flags=re.DOTALL):
        if language in parse:
            parse[language](block)


@pytest.mark.parametrize("name", ["README.md", "docs/sensors.md"])
def test_python_that_opens_a_brick_runs(name):
    blocks = re.findall(r"```python\n(.*?)```", (ROOT / name).read_text(encoding="utf-8"), flags=re.DOTALL)
    programs = [block for block in blocks if 'open_brick("usb://")' in block]
    assert programs
    for program in programs:
        exec(program.replace("usb://", "sim://track"), {})


def test_continuous_integration_runs_the_test_command_of_the_readme():
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    block = readme.split("<!-- test command -->")[1].split("```")[1]
    assert block.strip().startswith("python3 -m venv")
    assert block.strip().endswith("pytest")
    assert "<!-- test command -->" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


def test_the_readme_counts_targets_as_the_evaluation_does():
    counted = re.findall(r"\b\d+ of \d+\b", (ROOT / "README.md").read_text(encoding="utf-8"))
    measured = (ROOT / "docs" / "evaluation.md").read_text(encoding="utf-8")
    assert counted
    for count in counted:
        assert f"reached {count}" in measured, count


def test_what_the_evaluation_says_in_short_is_in_its_tables():
    text = (ROOT / "docs" / "evaluation.md").read_text(encoding="utf-8")
    summary = " ".join(text.split("**In short**")[1].split("\n\n")[0].split())
    easy = text.split("### The easy suite")[1].split("\n###")[0]
    share = {agent: 100 * float(rate) for agent, rate in re.findall(r"^\| (\w+) \| ([01]\.\d+) \[", easy, re.MULTILINE)}
    hard = text.split("### The hard suite")[1].split("### With rendered frames")[0]
    by_class = re.findall(r"^\| (?:`\w+`|adaptive) \| ([01]\.\d+) \[", hard, re.MULTILINE)
    assert f"[adaptive profile](adaptive.md) reaches {share['adaptive']:.1f} %" in summary
    assert f"the thesis profile {share['thesis']:.1f} %" in summary
    assert f"given the ground truth {share['oracle']:.1f} %" in summary
    assert len(by_class) == 9
    assert "In nine [harder classes]" in summary
    assert f"reaches {100 * min(map(float, by_class)):.0f} to 100 %" in summary


def test_the_built_in_missions_pictures_exist():
    from behaviors.mission import BUILT_IN, load_mission

    mission = load_mission(BUILT_IN, [ROOT / "sim_backend" / "pictures"])
    assert mission.mission.targets == ["lena", "rilakkuma"]


def _versions_of_the_changelog():
    """Each version of CHANGELOG.md, newest first, with its text."""
    _, *parts = re.split(r"^## ", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), flags=re.MULTILINE)
    return dict(part.split("\n", 1) for part in parts)


def test_changelog_has_the_unreleased_changes_first_and_then_the_versions_with_their_days():
    unreleased, *released = _versions_of_the_changelog()
    assert unreleased == "[Unreleased]"
    matches = [re.fullmatch(r"\[(\d+)\.(\d+)\.(\d+)\] - \d{4}-\d\d-\d\d", heading) for heading in released]
    assert all(matches), released
    versions = [tuple(int(part) for part in match.groups()) for match in matches if match]
    assert versions == sorted(set(versions), reverse=True)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert versions[:1] <= [tuple(int(part) for part in project["version"].split("."))]


def test_changelog_says_each_thing_once_under_the_headings_of_its_kind():
    for text in _versions_of_the_changelog().values():
        kinds = re.findall(r"^### (.+)", text, flags=re.MULTILINE)
        assert set(kinds) <= {"Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"}, kinds
        assert len(kinds) == len(set(kinds))
        for kind in re.split(r"^### ", text, flags=re.MULTILINE)[1:]:
            areas = re.findall(r"^#### (.+)", kind, flags=re.MULTILINE)
            assert len(areas) == len(set(areas)), areas
        bullets = re.findall(r"^- .+", text, flags=re.MULTILINE)
        assert sorted(bullets) == sorted(set(bullets))
