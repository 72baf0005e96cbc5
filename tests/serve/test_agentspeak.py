"""The thesis's agent in AgentSpeak, as an external program: python-agentspeak in a separate process, over a socket."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples" / "agentspeak"
GOLDEN = ROOT / "tests" / "golden" / "line_protocol"

FIGURE_1, FIGURE_7 = (
    (GOLDEN.parent / "console" / name).read_text(encoding="utf-8").replace("[client2] ", "").splitlines()
    for name in ("figure1.txt", "figure7.txt")
)

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("agentspeak") is None,
    reason="python-agentspeak (GPLv3+) is not installed: pip install agentspeak",
)

CLIENTS = pytest.mark.parametrize(
    ("name", "options"),
    [("client.asl", []), ("client_portable.asl", []), ("client_portable.asl", ["--unmodified"])],
    ids=["with failure plans", "portable", "portable, unmodified library"],
)


def run_agent(served, agent, *options):
    """Run an agent to its end; its exit code and what it said, without its name in front."""
    _, port = served.server.address
    done = subprocess.run(
        [sys.executable, EXAMPLES / "run_agent.py", "--port", str(port), *options, agent],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    said = [re.fullmatch(r"(?:\[client2\]|client2) (.*)", line)[1] for line in done.stdout.splitlines()]
    return done.returncode, said, done.stderr


def golden(name):
    """A golden dialogue as the server tells it."""
    lines = (GOLDEN / name).read_text(encoding="utf-8").splitlines()
    requests = [line[2:].replace("(", " ").rstrip(")") for line in lines[::2]]
    return list(zip(requests, (int(line[2:]) for line in lines[1::2]), strict=True))


@pytest.mark.slow
@CLIENTS
def test_figure_1_an_arrival_fails(serve, tmp_path, name, options):
    text = (EXAMPLES / name).read_text(encoding="utf-8")
    for present, wanted in (("targets([lena, rilakkuma])", "targets([lena])"), ("researches(2)", "researches(0)")):
        assert present in text
        text = text.replace(present, wanted)
    agent = tmp_path / "client.asl"
    agent.write_text(text, encoding="utf-8")
    served = serve("figure1", "lena")
    code, said, errors = run_agent(served, agent, *options)
    assert (code, said) == (0, FIGURE_1), errors
    assert served.dialogue == [*golden("figure1.txt"), ("bye", 1)]


@pytest.mark.nightly
@CLIENTS
def test_figure_7_the_target_is_changed(serve, name, options):
    served = serve("figure7")
    code, said, errors = run_agent(served, EXAMPLES / name, *options)
    assert code == 0, errors
    at = said.index("change target!")
    assert said[at - 2 : at + 3] == FIGURE_7
    assert said[:at].count("Failed") == 3, "one search and two re-searches"
    expected = golden("figure7.txt")
    assert served.dialogue[: len(expected)] == expected
    assert served.dialogue[-2:] == [("arrive rilakkuma", 1), ("bye", 1)]
    assert served.at_rest


def test_the_unmodified_library_needs_the_portable_agent(serve):
    served = serve("figure7")
    code, said, errors = run_agent(served, EXAMPLES / "client.asl", "--unmodified")
    assert code == 1, "it runs no failure plan; when it does, client_portable.asl is not needed any more"
    assert said[-1] == "Failed"
    assert "recovery plans are ignored" in errors
