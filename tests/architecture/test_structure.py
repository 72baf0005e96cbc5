"""The structure of the code: imports, lengths, and forbidden calls."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("firmware_protocol", "input_files", "nxtdrive", "behaviors", "sim_backend", "tools")
SOURCES = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))

MAX_FILE_LINES = 400
MAX_FUNCTION_LINES = 50
MAX_ROOT_NAMES = 20
GPL = {"nxt", "agentspeak"}
CLOCKS = {"time", "monotonic", "perf_counter", "sleep", "process_time"}


@pytest.fixture(scope="module")
def trees() -> dict[Path, ast.Module]:
    """Every file of the product, parsed."""
    return {path: ast.parse(path.read_text(encoding="utf-8")) for path in SOURCES}


def _imports(tree: ast.Module) -> Iterator[str]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module


def _lengths(node: ast.AST) -> Iterator[tuple[str, int]]:
    """Name and lines of each function."""
    for each in ast.walk(node):
        if isinstance(each, ast.FunctionDef | ast.AsyncFunctionDef):
            yield each.name, (each.end_lineno or each.lineno) - each.lineno + 1


def _reads_the_clock(node: ast.AST) -> bool:
    call = node.func if isinstance(node, ast.Call) else None
    return isinstance(call, ast.Attribute) and call.attr in CLOCKS and ast.unparse(call.value) == "time"


def _messages(tree: ast.Module, errors: set[str]) -> Iterator[str]:
    """The beginning of the message of each error that is made, up to its first value."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Call) and node.args and ast.unparse(node.func).rpartition(".")[2] in errors:
            first = node.args[0].values[0] if isinstance(node.args[0], ast.JoinedStr) else node.args[0]
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                yield first.value


def test_files_stay_short():
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in SOURCES}
    assert {path: count for path, count in lines.items() if count > MAX_FILE_LINES} == {}


@pytest.mark.xdist_group("parsed files")
def test_functions_stay_short(trees):
    lengths = [(path, *each) for path, tree in trees.items() for each in _lengths(tree)]
    assert len(lengths) > 1000
    assert [each for each in lengths if each[2] > MAX_FUNCTION_LINES] == []


@pytest.mark.xdist_group("parsed files")
def test_gpl_programs_are_never_imported(trees):
    imported = {path: {name.split(".")[0] for name in _imports(tree)} for path, tree in trees.items()}
    assert {path: names & GPL for path, names in imported.items() if names & GPL} == {}


@pytest.mark.xdist_group("parsed files")
def test_clocks_are_injected(trees):
    readers = [
        f"{path}:{node.lineno}" for path, tree in trees.items() for node in ast.walk(tree) if _reads_the_clock(node)
    ]
    assert readers
    allowed = {ROOT / "tools", ROOT / "nxtdrive" / "transports"}
    assert [each for each in readers if not any(Path(each).is_relative_to(folder) for folder in allowed)] == []


def test_the_driver_has_few_names_at_its_root_and_all_of_them_work():
    import nxtdrive

    assert 0 < len(nxtdrive.__all__) <= MAX_ROOT_NAMES
    for name in nxtdrive.__all__:
        assert getattr(nxtdrive, name) is not None


@pytest.mark.xdist_group("parsed files")
def test_messages_of_errors_continue_after_a_colon(trees):
    """`nxtdrive: there is no camera 7.`, or `target.face: there is no cascade 'nobody'`."""
    import nxtdrive.errors

    begun = [message for tree in trees.values() for message in _messages(tree, set(nxtdrive.errors.__all__))]
    assert len(begun) > 100
    assert [each for each in begun if each.split(" ")[0].istitle()] == []


@pytest.mark.xdist_group("parsed files")
def test_no_text_that_a_user_reads_names_a_page_of_the_repository(trees):
    """An installed nxtdrive has no docs/ and no examples/: help and messages say themselves what to do."""
    named = []
    for path, tree in trees.items():
        if path.relative_to(ROOT).parts[:2] not in (("tools", "dev"), ("tools", "rig")):
            documentation = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
            for node in ast.walk(tree):
                if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in documentation:
                    named += [
                        (path, each) for each in re.findall(r"\S*\b(?:docs|examples|tests)/\w+|\w+\.md\b", node.value)
                    ]
    assert named == []


def test_every_error_is_found_where_people_look_for_it():
    import firmware_protocol.errors
    import nxtdrive.errors

    tree = {name for name, value in vars(firmware_protocol.errors).items() if isinstance(value, type)}
    assert tree == set(nxtdrive.errors.__all__)


def test_importing_the_driver_loads_no_heavy_library():
    heavy = ("usb", "serial", "cv2", "numpy", "statemachine", "pydantic", "pymunk", "rich")
    code = f"import sys, nxtdrive; print([name for name in {heavy!r} if name in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert loaded.stdout.strip() == "[]"


@pytest.mark.parametrize(
    "command",
    [
        ("lint-imports", "--no-cache"),
        ("ruff", "check", "."),
        ("ruff", "format", "--check", "."),
        ("mypy",),
    ],
    ids=lambda command: command[0] + (" format" if "format" in command else ""),
)
def test_static_checks_pass(command):
    program = Path(sys.executable).parent / command[0]
    checked = subprocess.run(
        [program, *command[1:]], cwd=ROOT, capture_output=True, text=True, check=False, timeout=600
    )
    assert checked.returncode == 0, checked.stdout + checked.stderr
