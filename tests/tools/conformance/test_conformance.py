"""The simulated brick against recorded conversations with LEGO's firmware."""

import tomllib
from functools import cache
from itertools import islice
from pathlib import Path

import pytest

from nxtdrive.tools.conformance.recording import load
from nxtdrive.tools.conformance.replay import replay
from nxtdrive.tools.conformance.summary import category_of as category

GOLDEN = Path(__file__).parents[2] / "golden"
WRITTEN = GOLDEN / "firmware.jsonl"
"""Conversations about one subject each."""
RULES = load(GOLDEN / "rules.jsonl")
"""Short conversations, each named after the rule that it shows."""
RANDOM = {
    "1.05": GOLDEN / "firmware_random.jsonl.gz",
    "1.29": GOLDEN / "firmware_random.jsonl.gz",
    "1.32": GOLDEN / "firmware_1_32.jsonl.gz",
}
"""Conversations drawn at random."""

FIRMWARES = ("1.05", "1.29")
SCENARIOS = {firmware: load(WRITTEN, firmware) for firmware in FIRMWARES}
CASES = [(firmware, name) for firmware in FIRMWARES for name in SCENARIOS[firmware]]
CATEGORIES = ("btframe", "fs", "i2c", "malformed", "mod", "motor", "names", "prog", "sensor", "sound")
KNOWN = tomllib.loads((GOLDEN / "known_differences.toml").read_text(encoding="utf-8"))
SAMPLE = 3


@cache
def random_scenarios(firmware):
    return load(RANDOM[firmware], firmware)


def random_names(firmware, wanted):
    return (name for name in random_scenarios(firmware) if category(name) == wanted)


def different(firmware, names):
    scenarios = random_scenarios(firmware)
    return {name for name in names if replay(name, scenarios[name].steps, firmware).differences}


@pytest.mark.slow
@pytest.mark.parametrize(("firmware", "name"), CASES)
def test_it_answers_and_moves_as_the_firmware_did(firmware, name):
    assert replay(name, SCENARIOS[firmware][name].steps, firmware).differences == []


@pytest.mark.parametrize("rule", RULES)
def test_it_follows_the_rule_as_the_firmware_does(rule):
    assert replay(rule, RULES[rule].steps, RULES[rule].firmware).differences == []


def test_the_fact_sheet_says_how_many_rules_there_are():
    text = (Path(__file__).parents[3] / "docs" / "firmware.md").read_text(encoding="utf-8")
    assert f"| `rules.jsonl` | {len(RULES)} short conversations" in text


@pytest.mark.xdist_group("random conversations")
@pytest.mark.parametrize("wanted", CATEGORIES)
@pytest.mark.parametrize("firmware", RANDOM)
def test_a_sample_of_random_conversations_goes_as_with_the_firmware(firmware, wanted):
    known = KNOWN[firmware]
    names = list(islice((name for name in random_names(firmware, wanted) if name not in known), SAMPLE))
    assert len(names) == SAMPLE
    assert different(firmware, names) == set()


@pytest.mark.slow
@pytest.mark.xdist_group("random conversations")
@pytest.mark.parametrize("wanted", CATEGORIES)
@pytest.mark.parametrize("firmware", [pytest.param("1.05", marks=pytest.mark.nightly), "1.29", "1.32"])
def test_random_conversations_go_as_with_the_firmware_but_for_the_known_ones(firmware, wanted):
    names = set(random_names(firmware, wanted))
    assert different(firmware, names) == names & KNOWN[firmware].keys()


@pytest.mark.xdist_group("random conversations")
def test_no_scenario_is_left_out():
    assert len(CASES) == 160 * len(FIRMWARES)
    for firmware, count in {"1.05": 600, "1.29": 600, "1.32": 200}.items():
        assert len(random_scenarios(firmware)) == count
        assert sum(len(list(random_names(firmware, wanted))) for wanted in CATEGORIES) == count


def test_a_difference_is_named_by_its_field():
    steps = SCENARIOS["1.29"]["identity"].steps
    assert "firmware_minor" in replay("identity", steps, "1.05").differences[0].text
