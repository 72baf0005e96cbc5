"""Checks the exercises on a simulated robot.

pytest                      all of them
pytest -k exercise_2        one
FOLDER=solutions pytest     another folder than exercises, such as that of a pupil, or a copy of all this from a pupil
"""

import math
import os
import random
from contextlib import contextmanager
from pathlib import Path
from traceback import TracebackException
from types import ModuleType

import pytest

HANDED_IN = Path(__file__).parent / os.environ.get("FOLDER", "exercises")
FOLDER = HANDED_IN / "exercises" if (HANDED_IN / "exercises").is_dir() else HANDED_IN
SEEDS = range(2)
"""Exercises 2 to 4 are checked in two rooms, so that no number from one of them solves the exercise."""

LIMIT_S, REAL_LIMIT_S = 120, 30
"""Simulated and real seconds after which a check gives up, so that an endless loop does not hold up the others."""

SIDE_MM, NEAR_MM = 400, 40

pytestmark = [
    pytest.mark.sim_world(time_limit_s=LIMIT_S),
    pytest.mark.real_time_limit(REAL_LIMIT_S),
    pytest.mark.filterwarnings("error:the program sleeps"),  # the message says what to use instead of time.sleep
]

STRIPES = """
[floor]
size_mm = [3000, 1000]
color = "white"
[robot]
start_mm = [300, 500]
touch_port = 0
[[sensors]]
kind = "light"
port = 3
"""
STRIPE = '[[patches]]\ncolor = "black"\nalong_mm = [[{0}, 100], [{0}, 900]]\nwidth_mm = 40\n'


@contextmanager
def told(file):
    """Tell a pupil's mistake with its line, without the lines of nxtdrive that it came from."""
    try:
        yield
    except SyntaxError as error:
        raise pytest.fail.Exception(f"{file}, line {error.lineno}: {error.msg}", pytrace=False) from None
    except Exception as error:  # noqa: BLE001
        said = TracebackException.from_exception(error)
        lines = [f"{file}, line {frame.lineno}: " for frame in said.stack if frame.filename == str(FOLDER / file)]
        mistake = f"{lines[-1] if lines else ''}{type(error).__name__}: {said}"
        raise pytest.fail.Exception(mistake, pytrace=False) from None


def solution(name, function):
    """The pupil's function of a module."""
    file = f"{name}.py"
    if not (FOLDER / file).is_file():
        pytest.fail(f"There is no {file} in {FOLDER}.", pytrace=False)
    module = ModuleType(name)
    with told(file):
        exec(compile((FOLDER / file).read_bytes(), str(FOLDER / file), "exec"), module.__dict__)
    if not hasattr(module, function):
        pytest.fail(f"{file} has no function {function}.", pytrace=False)
    return told(file)(getattr(module, function))


def returned(number):
    """What a pupil's function returned, which must be a number."""
    if not isinstance(number, int | float):
        pytest.fail(f"The function returned {number!r}. End it with `return` and the number.", pytrace=False)
    return number


def trace(world, path):
    """Add where the robot is to a path, ten times a second."""
    path.append(world.truth.pose[:2])
    world.simulation.at(world.simulation.now_ms + 100, lambda: trace(world, path))


def test_exercise_1_a_square(sim_world, sim_brick):
    sim_world.place_robot(x_mm=2000, y_mm=1500)
    began, path = sim_world.truth.pose, []
    trace(sim_world, path)
    solution("square", "drive_square")(sim_brick.rover())
    ended = sim_world.truth.pose
    off_mm = abs(ended.x_mm - began.x_mm) + abs(ended.y_mm - began.y_mm)
    assert off_mm < 100, f"The robot ended {off_mm:.0f} mm from where it began. Four sides, four turns of 90 degrees?"
    (left, right), (top, bottom) = ((min(each), max(each)) for each in zip(*path, strict=True))
    width_mm, depth_mm = right - left, bottom - top
    assert width_mm == pytest.approx(SIDE_MM, abs=NEAR_MM), f"The square is {width_mm:.0f} mm wide, not {SIDE_MM}."
    assert depth_mm == pytest.approx(SIDE_MM, abs=NEAR_MM), f"The square is {depth_mm:.0f} mm deep, not {SIDE_MM}."
    corners = [(left, top), (right, top), (right, bottom), (left, bottom)]
    reached = sum(min(math.dist(corner, each) for each in path) < NEAR_MM for corner in corners)
    assert reached == 4, f"The robot was at {reached} of the 4 corners of its square."


@pytest.mark.parametrize("seed", SEEDS)
def test_exercise_2_stop_before_the_wall(seed, sim_world, sim_brick):
    sim_world.put_box("wall", x_mm=random.Random(seed).randint(1300, 2500), size_mm=(100, 1000))
    solution("wall", "stop_before_wall")(sim_brick, sim_brick.rover())
    sim_world.advance(0.1)  # it brakes; without stop() it drives on a little longer
    assert sim_world.truth.speed_mm_s < 10, "The robot still drives. Stop it."
    assert sim_world.truth.contacts == 0, "The robot touched the wall."
    left_mm = sim_brick.rover().range_mm()
    assert left_mm == pytest.approx(300, abs=50), f"The robot stopped {left_mm} mm from the wall, not 300."


@pytest.mark.parametrize("seed", SEEDS)
def test_exercise_3_feel_the_obstacle(seed, sim_world, sim_brick):
    far_mm = random.Random(seed).randint(900, 2000)
    sim_world.put_box("step", x_mm=400 + far_mm, height_mm=40, size_mm=(200, 600))
    free_mm = far_mm - 100 - 115  # half the step, and the robot's radius
    said_mm = returned(solution("bump", "feel_ahead")(sim_brick.rover()))
    assert said_mm == pytest.approx(free_mm, abs=60), f"The obstacle was {free_mm} mm away, and you say {said_mm:.0f}."
    assert sim_world.truth.distance_mm("step") > 150, "Go back 200 mm."
    assert abs(sim_world.truth.pose.heading_deg) == pytest.approx(180, abs=15), "Turn around."


@pytest.mark.parametrize("seed", SEEDS)
def test_exercise_4_count_the_lines(seed, tmp_path):
    from nxtdrive import open_brick
    from nxtdrive.testing import SimWorld

    draw = random.Random(seed)
    places_mm = sorted(draw.sample(range(500, 1700, 120), draw.randint(2, 7)))
    (tmp_path / "stripes.toml").write_text(STRIPES + "".join(map(STRIPE.format, places_mm)), encoding="utf-8")
    with SimWorld(tmp_path / "stripes.toml", time_limit_s=LIMIT_S) as world, open_brick(world.address) as brick:
        said = returned(solution("lines", "count_lines")(brick, brick.rover(touch=None)))
        assert world.truth.pose.x_mm > 1700, "Drive 1500 mm."
    assert said == len(places_mm), f"There were {len(places_mm)} lines, and you counted {said}."


@pytest.mark.sim_world(Path(__file__).parent / "fox-room.toml")
def test_exercise_5_a_mission_for_the_fox(sim_world, sim_brick):
    with told("fox.toml"):
        report = sim_world.run_mission(sim_brick, FOLDER / "fox.toml")
    found = [each.target for each in report.targets if each.outcome == "reached"]
    missing = [name for name in ("fox", "lena") if name not in found]
    said = f"The robot found {' and '.join(found) or 'nothing'}"
    assert not missing, f"{said}, and not {' and not '.join(missing)}."
    assert found == ["fox", "lena"], f"{said}, but the fox comes first."
