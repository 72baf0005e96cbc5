"""The sorter with simulated bricks on its slide; docs/testing-your-robot.md explains the fixtures."""

import pytest
from color_sorter import BOXES_DEG, OTHERS_DEG, next_color, sort

from sim_backend.devices import ColorSensor, TouchSensor

SLIDE = (5, 5, 5)
PAINT = {"RED": (60, 8, 8), "YELLOW": (75, 60, 10), "GREEN": (10, 40, 15), "BLUE": (8, 15, 45), "WHITE": (85, 85, 85)}
"""Percent of red, green and blue light that a brick reflects."""
EVERY_S = 2.0


@pytest.fixture
def slide(sim_world):
    """Bricks slide past the sensor, one every two seconds; when all have passed, the button is pressed."""

    def let_pass(*colors):
        def reflected_percent():
            number, since = divmod(sim_world.time_s - 1, EVERY_S)
            passing = 0 <= number < len(colors) and 0.1 < since < 0.9
            return PAINT[colors[int(number)]] if passing else SLIDE

        sim_world.plug(3, ColorSensor(reflected_percent))
        sim_world.plug(1, TouchSensor(lambda: sim_world.time_s > 1 + EVERY_S * len(colors)))

    return let_pass


@pytest.mark.parametrize("color", sorted(BOXES_DEG))
def test_the_color_of_a_brick_is_recognised(color, slide, sim_brick):
    slide(color)
    assert next_color(sim_brick) == color
    assert next_color(sim_brick) is None


def test_the_chute_stands_at_its_box_before_the_next_brick_comes(slide, sim_world, sim_brick):
    colors = ("RED", "BLUE", "WHITE", "GREEN")
    slide(*colors)
    chute, stood = sim_world.simulation.brick.output.outputs[0].plant, []
    for number in range(len(colors)):
        sim_world.simulation.at(round(1000 * (EVERY_S * (number + 1) + 0.9)), lambda: stood.append(chute.angle))
    sort(sim_brick)
    assert stood == pytest.approx([BOXES_DEG.get(color, OTHERS_DEG) for color in colors], abs=10)


def test_bricks_are_counted_one_by_one_also_two_of_a_color(slide, sim_brick):
    slide("RED", "RED", "GREEN", "WHITE", "BLUE", "RED")
    assert sort(sim_brick) == {"RED": 3, "GREEN": 1, "WHITE": 1, "BLUE": 1}


def test_nothing_comes(slide, sim_brick):
    slide()
    assert next_color(sim_brick) is None
