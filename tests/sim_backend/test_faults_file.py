"""Faults from a TOML file: all of a link's faults can be written, and all mistakes are reported at once."""

import pytest

from firmware_protocol.errors import ConfigError
from sim_backend.faults_file import load_faults

ALL = """
drop_requests = [3, 17]
drop_replies = { every = 7 }
duplicate_replies = { every = 10, first = 5, numbers = [1] }
corrupt_replies = []
delay_replies_ms = { 4 = 500, 9 = 20 }
silent_ms = [[1000, 1500], [3000, 3001]]
unplugged_ms = [[20000, 23000]]
weak_ms = [[5000, 9000]]
weak_latency_ms = [200, 400]
weak_loss = 0.5
"""


@pytest.fixture
def faults(tmp_path):
    def load(text):
        path = tmp_path / "faults.toml"
        path.write_text(text)
        return load_faults(path)

    return load


def _hit(some):
    return [number for number in range(20) if number in some]


def test_every_kind_of_link_fault_can_be_described(faults):
    loaded = faults(ALL)
    assert _hit(loaded.drop_requests) == [3, 17]
    assert _hit(loaded.drop_replies) == [0, 7, 14]
    assert _hit(loaded.duplicate_replies) == [1, 5, 15]
    assert _hit(loaded.corrupt_replies) == []
    assert loaded.delay_replies_ms == {4: 500, 9: 20}
    assert [loaded.silent(now) for now in (999, 1000, 1499, 1500, 3000)] == [False, True, True, False, True]
    assert loaded.unplugged(0, 20000)
    assert loaded.weakened(0, 4999) is None
    drawn = [loaded.weakened(number, 5000) for number in range(200)]
    assert all(200 <= latency_ms <= 400 for latency_ms, *_ in drawn)
    assert 60 < sum(request_lost or reply_lost for _, request_lost, reply_lost in drawn) < 140


def test_an_empty_file_is_a_perfect_link(faults):
    loaded = faults("")
    assert _hit(loaded.drop_requests) == []
    assert not loaded.silent(0)


def test_all_mistakes_are_reported_at_once(faults):
    with pytest.raises(ConfigError) as caught:
        faults(
            "drop_request = [1]\ndrop_replies = [-1]\ncorrupt_replies = { evry = 3 }\n"
            'silent_ms = [[5, 1]]\nunplugged_ms = [[1]]\ndelay_replies_ms = { a = 1 }\nduplicate_replies = "all"\n'
        )
    message = str(caught.value)
    assert "7 mistakes" in message
    assert "did you mean 'drop_requests'?" in message
    assert "drop_replies.numbers[0]" in message
    assert "did you mean 'every'?" in message
    assert "[5, 1] ends before it begins" in message
    assert "unplugged_ms[0]" in message
    assert "delay_replies_ms.a: must be a whole number" in message


@pytest.mark.parametrize(("text", "says"), [("= 3", "not TOML"), (None, "No such file")])
def test_anything_that_is_not_a_file_of_faults_gives_one_sentence(faults, tmp_path, text, says):
    with pytest.raises(ConfigError, match=says):
        faults(text) if text else load_faults(tmp_path / "nowhere.toml")


def test_a_range_of_round_trips_begins_with_the_shortest(faults):
    with pytest.raises(ConfigError, match="the shortest round trip first"):
        faults("weak_latency_ms = [900, 300]")
