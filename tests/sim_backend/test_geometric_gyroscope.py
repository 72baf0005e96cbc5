"""Geometric vision measures turns as often and as accurately as the visual gyroscope does in rendered rooms."""

from statistics import fmean, median

import pytest

from sim_backend.simulation import Simulation
from sim_backend.world.event_tables import Event as DisturbingEvent
from tools.dev.gyroscope_accuracy import MOTIONS, make_room, measure, row


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", ["at rest", "turn by 2 deg", "turn by 8 deg", "drive 40 mm", "turn by 2 deg, brightness 0.35"]
)
def test_the_model_is_about_as_often_able_to_tell_as_the_gyroscope(name):
    measured = [each for number in range(12) for each in measure(make_room(number, 4, 3), MOTIONS[name], number)]
    seen, modelled = ([turn for turn in turns if turn is not None] for turns in zip(*measured, strict=True))
    assert len(modelled) / len(measured) == pytest.approx(len(seen) / len(measured), abs=0.25)
    assert median(modelled) == pytest.approx(median(seen), abs=0.1 + 0.1 * MOTIONS[name].turned_deg)


def test_a_turn_is_measured_from_one_call_to_the_next():
    simulation = Simulation("room")
    webcam, turns = simulation.webcam, []
    for step in range(40):
        simulation.world.place_robot((1500.0, 1400.0), 2.0 * step)
        simulation.advance(100)
        turns.append(webcam.turned_deg())
    measured = [turn for turn in turns if turn is not None]
    assert turns[0] is None
    assert len(measured) > 25
    assert fmean(measured) == pytest.approx(2.2, abs=0.15)


def test_a_fogged_lens_shows_no_turn():
    simulation = Simulation("room")
    simulation.world.perform(DisturbingEvent(name="it", when={"at_s": 0}, camera=True, fault="fogged"), None)
    shown = []
    for _ in range(20):
        simulation.advance(100)
        shown.append(simulation.webcam.turned_deg())
    assert shown == [None] * 20


def test_the_table_has_the_median_the_spread_and_what_is_far_off():
    measured = [(2.0, 2.1), (2.2, None), (2.4, 2.0), (9.0, 2.2), (None, None)]
    assert row("turn", measured) == "| turn | 5 | 80 % | 2.30 | 1.41 | 25.0 % | 60 % |"
    assert row("turn", [(None, 1.0)]) == "| turn | 1 | 0 % | - | - | - | 100 % |"
