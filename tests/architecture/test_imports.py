"""Import contracts: exhaustive layers, no import cycles, and the libraries that each package may use.

The layers are in pyproject.toml, under ``tool.importlinter``.
"""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]

DRIVER = {"usb", "libusb_package", "serial", "cv2", "numpy", "pydantic", "rich", "gi"}
LIBRARIES = {
    "firmware_protocol": set(),
    "input_files": {"cv2", "numpy", "PIL"},
    "behaviors": {"numpy", "pydantic", "statemachine"},
    "sim_backend": {"cv2", "numpy", "pydantic", "pydantic_core", "pymunk", "usb", "gi"},
    "nxtdrive": DRIVER | {"PIL", "gymnasium", "mcap", "onnxruntime", "pytest", "shtab"},
    "tools": DRIVER
    | {
        "anyio",
        "distributed",
        "matplotlib",
        "mcp",
        "pygame",
        "mkdocs",
        "segno",
        "starlette",
        "textual",
        "tomlkit",
        "uvicorn",
    }
    | {"bumble"}  # tools/rig: the Bluetooth of its guest
    | {"PIL", "selenium"}  # tools/dev: pictures of the page
    | {"onnx", "skimage"},  # tools/dev: photographs to look for
}
"""Package -> what it may import besides the standard library and the other packages."""


@pytest.fixture(scope="module")
def graph():
    """Every import, also those that only a type checker follows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT)
        return grimp.build_graph(
            *LIBRARIES, include_external_packages=True, exclude_type_checking_imports=False, cache_dir=None
        )


def _circle(graph: grimp.ImportGraph) -> list[str]:
    """Modules that form an import cycle, if any."""
    try:
        TopologicalSorter({name: graph.find_modules_directly_imported_by(name) for name in graph.modules}).prepare()
    except CycleError as error:
        return error.args[1]
    return []


def test_no_modules_import_each_other_in_a_circle(graph):
    assert _circle(graph) == []


def test_a_circle_of_imports_is_found():
    graph = grimp.ImportGraph()
    for importer, imported in [("a", "b"), ("b", "c"), ("c", "a"), ("c", "d")]:
        graph.add_import(importer=importer, imported=imported)
    assert set(_circle(graph)) == {"a", "b", "c"}


@pytest.mark.parametrize("package", LIBRARIES)
def test_packages_use_only_their_own_libraries(graph, package):
    used = {
        imported
        for module in {package, *graph.find_descendants(package)}
        for imported in graph.find_modules_directly_imported_by(module)
        if graph.is_module_squashed(imported)
    }
    assert used - LIBRARIES[package] - sys.stdlib_module_names == set()


def _names_tools(path: Path) -> bool:
    nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
    return any(isinstance(node, ast.ImportFrom) and (node.module or "").startswith("nxtdrive.tools") for node in nodes)


def test_only_the_command_line_imports_the_tools():
    # the tools themselves use relative imports, which the contracts follow
    paths = (path for package in LIBRARIES for path in (ROOT / package).rglob("*.py"))
    command_line = ROOT / "nxtdrive" / "cli"
    assert {path.parent for path in paths if _names_tools(path)} == {command_line, command_line / "commands"}


@pytest.mark.parametrize("package", LIBRARIES)
def test_a_new_module_fails_until_it_is_placed(package, tmp_path):
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for name in LIBRARIES:
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / package / "stray.py").touch()
    program = Path(sys.executable).parent / "lint-imports"
    checked = subprocess.run(
        [program, "--no-cache"], cwd=tmp_path, capture_output=True, text=True, check=False, timeout=60
    )
    assert checked.returncode == 1
    assert f"{package}.stray" in " ".join(checked.stdout.split())
