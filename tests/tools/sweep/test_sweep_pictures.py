"""Maps and plots of a sweep."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sweep_results import mission_result, target_result

from behaviors.executive import Ending
from firmware_protocol.errors import ConfigError
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.agents import NAMES
from nxtdrive.tools.sweep.plots import STYLES, check_plotting, counted, plot_bytes, title
from nxtdrive.tools.sweep.summary import wilson
from nxtdrive.tools.sweep.task import run_episode
from nxtdrive.tools.sweep.true_map import draw_true_map, true_map_page


@pytest.fixture(name="trace", scope="module")
def _trace():
    trace, _ = run_episode(generate_scenario("open", 100), "oracle", "geometric")
    return trace


@pytest.mark.slow
def test_a_map_says_what_it_shows(trace):
    page = true_map_page(trace, "open, seed 100, profile oracle")
    assert page.title == "open, seed 100, profile oracle"
    assert page.subtitle.startswith(f"achieved after {trace.duration_s:.1f} s; lena: reached at ")
    assert page.subtitle.endswith("; contacts: 0; positions are the simulator's, not the robot's estimates")
    assert [note.head.partition(" · ")[2] for note in page.notes] == [f"{name} reached" for name in trace.targets]
    assert {tag.text for tag in page.tags} == {"1", "2", *trace.targets}
    legend = {key.text for key in page.keys}
    assert {"path for the first target", "path for the second target", "arrival that counts"} <= legend
    assert {"from the start, a dot each 0.5 m", "the robot at the end"} <= legend
    for absent in ("arrival that does not count", "touched something", "person who stood there, when"):
        assert absent not in legend


@pytest.mark.slow
def test_a_map_of_a_failed_mission_says_which_targets_were_not_reached(trace):
    records = [entry for entry in trace.entries if entry.record.data.get("to") != "reached"]
    page = true_map_page(replace(trace, entries=records, ending=Ending.TIME_UP), "x")
    assert page.subtitle.startswith(
        f"time up after {trace.duration_s:.1f} s; lena: not reached; rilakkuma: not reached"
    )


@pytest.mark.slow
def test_a_map_says_when_a_person_stood_in_the_way():
    trace, _ = run_episode(generate_scenario("doorway", 12010), "oracle", "geometric")
    page = true_map_page(trace, "x")
    assert "person who stood there, when" in {key.text for key in page.keys}
    assert any(re.fullmatch(r"\d+ to \d+ s", tag.text) for tag in page.tags)


@pytest.mark.slow
def test_no_number_covers_the_arrow_of_the_start(trace):
    x_mm, y_mm, heading_deg = trace.samples[0].pose
    angle = math.radians(heading_deg)
    front = x_mm + 240 * math.cos(angle), y_mm + 240 * math.sin(angle)
    assert any(math.dist(front, kept) < 1 for kept in true_map_page(trace, "x").keep)


@pytest.mark.slow
def test_a_map_is_drawn(trace):
    assert np.asarray(draw_true_map(trace, "x")).min() < 100


RESULTS = [
    mission_result(target_result(10.0), target_result(), kind=kind, seed=seed, agent=agent)
    for kind in ("open", "far")
    for seed in (7, 8)
    for agent in ("a", "b")
]


@pytest.mark.parametrize(
    # the intervals of Wilson 1927 as in Newcombe 1998 (Statistics in Medicine 17, table I) and two by hand
    ("reached", "number", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_the_interval_of_a_share_is_wilsons(reached, number, low, high):
    assert wilson(reached, number) == pytest.approx((low, high), abs=6e-5)


def test_a_full_share_has_an_interval_up_to_one():
    low, high = wilson(20, 20)
    assert (low, high) == (pytest.approx(1 - wilson(0, 20)[1]), 1.0)


@given(st.integers(1, 2000), st.floats(0.0, 1.0))
def test_the_interval_of_a_share_holds_the_share(number, share):
    for reached in (0, round(share * number), number):
        low, high = wilson(reached, number)
        assert 0.0 <= low <= reached / number <= high <= 1.0


def test_a_plot_says_how_many_missions_on_which_seeds():
    assert title(RESULTS) == "8 simulated missions: 2 classes, seeds 7 to 8"
    assert title(RESULTS[:1]) == "1 simulated mission: class open, seed 7"
    assert counted(RESULTS) == (8, 16)


def test_agents_are_distinguishable_without_colour():
    assert len({(dashes, marker) for _, dashes, marker in STYLES}) == len(STYLES) == len(NAMES)


@pytest.mark.parametrize("name", ["plot.jpgg", "plot"])
def test_a_format_that_cannot_be_plotted_is_refused_before_the_sweep(name, tmp_path):
    pytest.importorskip("matplotlib")
    with pytest.raises(ConfigError, match=f"{name} cannot be drawn: its name must end in .png, .svg or .pdf"):
        check_plotting(tmp_path / name)
    check_plotting(tmp_path / "plot.SVG")


@pytest.mark.parametrize(("suffix", "begins"), [(".png", b"\x89PNG"), (".SVG", b"<?xml")])
@pytest.mark.slow
def test_a_plot_is_drawn_in_the_format_of_its_suffix(suffix, begins):
    pytest.importorskip("matplotlib")
    content = plot_bytes(RESULTS, suffix)
    assert content.startswith(begins)
    assert len(content) > 5000
