"""A client that only decides: ``choose`` runs the mission to the next decision, ``evidence`` describes it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from behaviors.journal import RecordKind
from behaviors.line_protocol import Request, Verb
from behaviors.profiles import registry
from behaviors.profiles.adaptive import AdaptiveProfile
from nxtdrive.brick import Brick
from nxtdrive.mission.line_server import sessions
from nxtdrive.mission.vision import geometric_vision
from nxtdrive.transports.sim import SimTransport
from sim_backend.simulation import Simulation

DECIDER = Path(__file__).parents[2] / "examples" / "decider" / "decider.py"


def evidence(client):
    """What the server tells of the open decision."""
    client.send("evidence\n")
    return json.loads(client.receive())


def leave(decision):
    """The candidate that leaves the target."""
    return next(each["number"] for each in decision["candidates"] if each["choice"] == "change_target")


def ending(served):
    """How the one mission ended, by its journal, and the error that ended it."""
    (end,) = (record for record in served.records if record.kind is RecordKind.END)
    return end.data["ending"], end.data["error"]


def test_without_a_mission_nothing_is_open_and_only_the_first_candidate_begins_one(serve):
    client = serve("open").client()
    assert evidence(client) == {"open": False}
    assert [client.ask(line) for line in ("choose 1", "why", "status")] == [-2, 12, 0]


@pytest.mark.parametrize("profile", ["adaptive", "thesis"])
def test_a_client_decides_a_mission_and_nothing_else(serve, profile):
    served = serve("figure7", profile=profile)
    client = served.client()
    assert client.ask("choose") == 0
    assert [client.ask(line) for line in ("why", "status", "select")][:2] == [13, 1]
    told = evidence(client)
    assert told == evidence(client)
    assert told["open"]
    assert [each["number"] for each in told["candidates"]] == list(range(len(told["candidates"])))
    assert client.ask(f"choose {len(told['candidates'])}") == -2
    assert evidence(client) == told
    answer = 0
    while answer == 0:
        answer = client.ask(f"choose {leave(evidence(client))}")
    assert answer in (1, 2)
    told = evidence(client)
    assert told["open"] is False
    assert set(told["targets"]) == {"lena", "rilakkuma"}
    assert client.ask("why") in (14, 15, 16)
    assert served.at_rest


def test_a_mission_can_be_begun_after_another_one(serve):
    client = serve("figure7", "rilakkuma").client()
    for _ in range(2):
        assert client.ask("choose") == 0
        assert client.ask(f"choose {leave(evidence(client))}") == 2
        assert evidence(client)["ending"] == "given_up"


@pytest.mark.parametrize("line", ["arrive lena", "move_to 90", "connect", "stop", "target rilakkuma"])
def test_what_drives_the_robot_otherwise_ends_the_mission(serve, line):
    served = serve("figure7", profile="adaptive")
    client = served.client()
    assert client.ask("choose") == 0
    client.ask(line)
    assert evidence(client)["open"] is False
    assert evidence(client)["ending"] == "interrupted"


def test_stop_breaks_off_the_mission_under_way(serve):
    served = serve("open", profile="adaptive")
    client = served.client()
    served.after(2.0, lambda: (client.send("stop\n"), None))
    assert client.ask("choose") == -7
    assert int(client.receive()) == 1
    assert client.ask("why") == 9
    told = evidence(client)
    assert (told["open"], told["ending"], set(told["targets"])) == (False, "interrupted", {"lena", "rilakkuma"})
    assert ending(served) == ("interrupted", "")
    assert served.at_rest


def test_a_client_that_leaves_a_mission_under_way_ends_it(serve):
    served = serve("open", profile="adaptive")
    client = served.client()
    left = threading.Event()
    served.after(2.0, lambda: (client.leave(), left.set()))
    client.send("choose\n")
    assert left.wait(60)
    other = served.client()
    while other.ask("status") == -6:
        pass
    assert ending(served) == ("interrupted", "")
    assert served.at_rest


def test_a_client_that_leaves_at_a_decision_ends_the_mission(serve):
    served = serve("figure7", profile="adaptive")
    client = served.client()
    assert client.ask("choose") == 0
    client.leave()
    other = served.client()
    while other.ask("status") == -6:
        pass
    assert evidence(other) == {"open": False}
    assert ending(served) == ("interrupted", "")
    assert served.at_rest


def test_a_bug_of_the_mission_is_not_answered_as_a_number_without_a_candidate(serve, monkeypatch, caplog):
    monkeypatch.setattr(AdaptiveProfile, "evidence", lambda *_: [].pop())
    client = serve("figure7", profile="adaptive").client()
    assert [client.ask(line) for line in ("choose", "why")] == [-7, 11]
    assert evidence(client) == {"open": False, "ending": "broken"}
    assert "internal error in choose" in caplog.text


@pytest.mark.parametrize(
    ("gather", "words"),
    [
        (lambda *_: [].pop(), "IndexError: pop from empty list. Correct it there"),
        (lambda *_: sys.exit(3), "SystemExit: 3. A profile must not end the program"),
    ],
)
def test_an_exception_in_your_own_profile_is_one_line(gather, words, serve, monkeypatch, caplog):
    monkeypatch.setattr(AdaptiveProfile, "evidence", gather)
    monkeypatch.setattr(registry, "external_profiles", {"odd:Odd": __name__.partition(".")[0]})
    served = serve("figure7", profile="adaptive")
    assert served.client().ask("choose") == -7
    (error,) = [record.data["error"] for record in served.records if record.data.get("value") == -7]
    assert error.startswith(f"profile 'odd:Odd' failed at {__file__}:")
    assert words in error
    assert "internal error" not in caplog.text


@pytest.mark.skipif(not hasattr(signal, "pthread_kill"), reason="needs signals to a thread")
def test_ctrl_c_in_a_program_that_lets_a_mission_run_leaves_the_motors_off(mission_for):
    simulation, mission = Simulation("figure7", seed=1), mission_for("rilakkuma", profile="adaptive")
    main = threading.main_thread().ident
    with Brick(SimTransport(simulation)) as brick:
        simulation.at(4000, lambda: signal.pthread_kill(main, signal.SIGINT))
        session = sessions(mission, brick, geometric_vision(brick, mission), [])()
        with pytest.raises(KeyboardInterrupt):
            session.answer(Request(Verb.CHOOSE))
        simulation.advance(500)
        before = simulation.truth.pose
        simulation.advance(2000)
        assert simulation.truth.pose == before


def test_another_client_gets_the_answer_busy(serve):
    served = serve("open")
    served.client().ask("connect")
    other = served.client()
    assert [other.ask(line) for line in ("evidence", "choose", "choose 3")] == [-6, -6, -6]


@pytest.mark.slow
def test_the_example_decides_a_mission(serve):
    served = serve("figure6", "lena", profile="adaptive")
    command = [sys.executable, str(DECIDER), str(served.server.address[1])]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode in (0, 1), done.stderr
    assert "->" in done.stdout
