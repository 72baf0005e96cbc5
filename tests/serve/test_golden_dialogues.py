"""The dialogues of the thesis's figures, replayed by a client that handles only lines and numbers."""

from __future__ import annotations

from pathlib import Path

import pytest

GOLDEN = Path(__file__).parents[1] / "golden" / "line_protocol"

FIGURE_1, FIGURE_7 = (
    (GOLDEN.parent / "console" / name).read_text(encoding="utf-8").splitlines()
    for name in ("figure1.txt", "figure7.txt")
)


def replay(ask, path):
    """Ask what the file asks, insist on its answers, print what the thesis's agent prints."""
    lines, target = ["[client2] Connecting to NXT"], ""
    dialogue = path.read_text(encoding="utf-8").splitlines()
    for request, reply in zip(dialogue[::2], dialogue[1::2], strict=True):
        assert request.startswith("> ")
        verb, _, argument = request[2:].rstrip(")").partition("(")
        if verb == "arrive":
            if target and argument != target:
                lines.append("[client2] change target!")
            target = argument
            lines.append(f"[client2] Arriving at {target}")
        answer = ask(request[2:])
        assert reply == f"< {answer}", f"{request} was answered {answer}"
        if verb == "arrive":
            lines.append({0: "[client2] Continue...", 2: "[client2] Failed"}[answer])
    return lines


@pytest.mark.slow
@pytest.mark.parametrize("camera", [False, True], ids=["geometric", "camera"])
def test_figure_1_an_arrival_fails(serve, camera):
    served = serve("figure1", "lena", camera=camera)
    assert replay(served.client().ask, GOLDEN / "figure1.txt") == FIGURE_1


@pytest.mark.slow
@pytest.mark.parametrize(
    "camera", [pytest.param(False, id="geometric"), pytest.param(True, id="camera", marks=pytest.mark.nightly)]
)
def test_figure_7_the_target_is_changed(serve, camera):
    served = serve("figure7", camera=camera)
    assert replay(served.client().ask, GOLDEN / "figure7.txt")[-5:] == FIGURE_7


def test_verb_and_argument_may_also_be_written_with_a_space_and_crlf(serve):
    def ask(request):
        return client.ask(request.rstrip(")").replace("(", " ") + "\r")

    client = serve("figure1", "lena").client()
    assert replay(ask, GOLDEN / "figure1.txt") == FIGURE_1
