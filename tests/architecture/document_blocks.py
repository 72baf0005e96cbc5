"""The blocks of code in the documents, and how their commands are run on the simulated brick."""

from __future__ import annotations

import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import pytest

from nxtdrive.cli.main import DONE, main
from sim_backend.bundled import PICTURES

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), *EXAMPLES.glob("*/README.md")])
BLOCK = re.compile(r"^ *```(\w*)\n(.*?)^ *```", flags=re.DOTALL | re.MULTILINE)
COMMAND = re.compile(
    r"^ *(?:\w+=\S+ )?(?:(?:sudo|nxtdrive|\.venv\S+|\.|python3?|py|pip3?|dask|jason|javac?|for) .*|\.venv\S+$|pytest.*)"
)

IN_A_SHELL = re.compile(r"-m venv|-m pip |^pip3? |^\. |pytest|^for each|Scripts.python")
"""Commands that set up an environment, or collect tests; pip installs nothing and pytest runs none of them."""

PARSED = {
    r"-m tools\.rig ": "needs a virtual machine",
    r"^nxtdrive bench|tools\.dev\.faults(?!.*--only)": "take minutes; tests/tools/test_bench_*.py, tests/faults",
    r"^dask |--dask ": "needs a cluster; tests/tools/sweep/test_sweep_cluster.py has one",
}
"""Commands of which only the arguments are checked, by a pattern of them, with the reason."""

NOT_RUN = PARSED | {
    r"^sudo ": "changes the computer: its packages, kernel modules, USB devices",
    r"Scripts.activate|^for /D": "needs Windows",
    r"^(\.venv/bin/)?python (?!-m)(?!.*sim://)": "programs of the examples on a brick; their own tests call them",
    r"^jason |^javac? ": "needs Jason",
    r"-m build|twine |check_wheel_contents ": "test_distribution.py builds, and runs them on what was built",
}
"""Commands that are printed and not run, by a pattern of them, with the reason."""

LASTING = re.compile(r"^nxtdrive (web|serve|mcp|sim serve|run --web)")
"""Commands that go on until they are ended."""

IN_A_TERMINAL = re.compile(r"^nxtdrive teleop")
"""Commands that draw on a terminal until a key ends them."""

PROGRAM = re.compile(r"^(?P<environment>NXT=sim://\S+ )?(\.venv/bin/)?python (?P<words>\w+\.py( sim://\S+)?)")
"""Programs of the examples in the simulator."""

LONG = re.compile(
    r"^nxtdrive (run|explain-run|chances|what-if|calibrate --nxt|sweep(?! --map))|tools\.dev\.reality_table"
    r"|hide_and_seek|wall_follower"
)
"""Commands that drive whole missions, or need some."""

INSTALLED = ("lamp-detector", "patient-profile")
"""Examples that the documents' reader has installed."""

SHORTER = {"full": "open", "reality": "mounted"}
"""A class in the place of a suite."""


def blocks(*languages: str) -> Iterator[tuple[str, int, str]]:
    """Yield the page, number and text of each block in one of these languages."""
    for path in DOCUMENTS:
        for number, (language, text) in enumerate(BLOCK.findall(path.read_text(encoding="utf-8"))):
            if language in languages:
                yield path.relative_to(ROOT).as_posix(), number, text


def commands(text: str) -> list[str]:
    """Return the commands of a block, without comments."""
    lines = [line.strip() for line in text.splitlines() if COMMAND.match(line) and "──" not in line]
    plain = [
        each.removeprefix(".venv/bin/") if "bin/nxtdrive " in each else each
        for line in lines
        for each in line.split(" && ")
    ]
    return [shlex.join(shlex.split(each, comments=True)) if each.startswith("nxtdrive ") else each for each in plain]


def reason(command: str) -> str | None:
    """Return why a command is not run, or None."""
    return next((each for pattern, each in NOT_RUN.items() if re.search(pattern, command)), None)


def make_home(folder: Path) -> None:
    """Make what the documents speak of: a photograph, a mission and its room, programs."""
    shutil.copy(PICTURES / "fox.png", folder / "my-cat.jpg")
    shutil.copy(EXAMPLES / "careful-explorer" / "careful_explorer.py", folder)
    for example in INSTALLED:
        install_example(EXAMPLES / example, folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        new = ["mission", "new", "--picture", "my-cat.jpg", "--height-mm", "297", "my-mission.toml"]
        assert main(new) == DONE


def install_example(example: Path, folder: Path) -> None:
    """Copy an example to a folder of the path, with what pip would write beside it."""
    for file in (path for suffix in ("py", "toml", "png") for path in example.glob(f"*.{suffix}")):
        shutil.copy(file, folder)
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    info = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    metadata = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (info / "METADATA").write_text(metadata, encoding="utf-8")
    points = [
        f"[{group}]\n" + "".join(f"{name} = {place}\n" for name, place in places.items())
        for group, places in project["entry-points"].items()
    ]
    (info / "entry_points.txt").write_text("\n".join(points), encoding="utf-8")


def simulated(command: str) -> list[str]:
    """Return the words after `nxtdrive`, with the simulated robot in the place of a brick and its webcam."""
    command = re.sub(r" --camera \S+", "", command.replace("usb://", "sim://"))
    words = shlex.split(command.replace("detect try 0", "detect try my-cat.jpg"))[1:]
    words += ["--force"] if words[:2] == ["mission", "new"] else []  # what it writes may be here from `make_home`
    return [*words, "--once"] if words[0] == "monitor" else words


def shortened(words: Sequence[str], runs: Sequence[str]) -> list[str]:
    """Return a long command that takes less: one mission of a sweep, one decision of a what-if.

    Args:
        words: After `nxtdrive`.
        runs: Folders of runs, first of all one of the adaptive profile.
    """
    command, *rest = [each.replace("RUN", runs[0]) for each in words]
    if command == "what-if":
        one = ["--decision", rest[rest.index("--decision") + 1]] if "--decision" in rest else ["--sample", "1"]
        return [command, rest[0], *one, "--futures", "2"]
    if command != "sweep" or "--map" in rest:
        return [command, *rest]
    options = dict(pairwise(rest))
    classes = SHORTER.get(options.get("--suite", ""), options.get("--classes", "open").split(",")[0])
    seed = options.get("--seeds", "100").split("-")[0]
    agents = options.get("--agents", "thesis").split(",")
    agents = agents[:1] + [each for each in agents[1:] if ":" in each]
    kept = [word for name in ("--out", "--vision", "--plot") if name in options for word in (name, options[name])]
    kept += ["--resume"] if "--resume" in rest else []
    drawn = ["--classes", classes.replace("CLASSES", "open"), "--seeds", f"{seed}-{seed}"]
    return [command, *drawn, "--agents", ",".join(agents), *kept]
