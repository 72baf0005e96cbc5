"""The plugin in users' test suites."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from nxtdrive.host.environment import install_extra

ROOT = Path(__file__).parents[2]
PLUGIN = "nxtdrive.pytest_plugin"


@pytest.fixture
def outcomes(pytester):
    """Runs a test file and counts how its tests ended."""

    def run(text, *arguments):
        pytester.makepyfile(text)
        result = pytester.runpytest_inprocess("-p", PLUGIN, "--strict-markers", *arguments)
        counts = result.parseoutcomes()
        # in this process the plugin has been imported before pytest could rewrite it, and pytest says so
        counts.pop("warnings", None)
        return counts, result.stdout.str()

    return run


def test_a_brick_that_is_left_open_fails_the_test(outcomes):
    counts, text = outcomes(
        """
        from nxtdrive import open_brick

        def test_leaves_it_open(sim_world):
            open_brick()

        def test_closes_it(sim_world):
            open_brick().close()

        def test_uses_the_fixture(sim_brick):
            assert sim_brick.battery_v > 7
        """
    )
    assert counts == {"passed": 3, "errors": 1}
    assert "1 link(s) to the simulated brick were left open" in text


ENDLESS = """
        import pytest

        @pytest.mark.real_time_limit(0.3)
        def test_{name}():
            while True:
                {body}

        def test_next():
            pass
        """


@pytest.mark.parametrize("body", ["pass", "sum(range(10))", "try: sum([])\n                except: pass"])
def test_a_loop_that_does_nothing_with_the_brick_is_ended(outcomes, body):
    counts, text = outcomes(ENDLESS.format(name="loops", body=body))
    assert counts == {"passed": 1, "failed": 1}
    said = r"\w+\.py, line [56]: The program still runs after 0\.3 s\. Does your loop ever end\?"
    assert re.search(said, text)
    assert "def interrupted" not in text, "the message is enough"


@pytest.mark.parametrize("given", ["", "()", "('x')", "(0)", "(1, 2)", "(minutes=1)"])
def test_a_limit_that_is_no_number_of_seconds_is_named(outcomes, given):
    test = f"import pytest\n\n@pytest.mark.real_time_limit{given}\ndef test_it(): pass\n"
    counts, text = outcomes(test)
    assert counts == {"failed": 1}
    assert "the marker real_time_limit needs a number of seconds above 0, as in real_time_limit(30)." in text
    assert "_ended_after" not in text


@pytest.mark.slow
def test_a_program_that_catches_all_that_should_end_it_ends_the_test_run(pytester):
    pytester.makepyfile(
        """
        import pytest

        @pytest.mark.real_time_limit(0.3)
        def test_loops(sim_brick):
            rover = sim_brick.rover()
            while True:
                try:
                    rover.drive(100, 0)
                    sim_brick.sleep(0.5)
                except:
                    pass
        """
    )
    ended = pytester.runpytest_subprocess("-p", PLUGIN, timeout=60)
    assert ended.ret == 1
    said = r"^\w+\.py, line \d+: The program still runs after 0\.3 s and catches what should end it"
    assert re.search(said, ended.stdout.str(), re.MULTILINE)


def test_a_program_over_its_real_time_limit_fails_its_test_though_it_catches_the_exception(outcomes):
    counts, text = outcomes(
        """
        import pytest

        @pytest.mark.real_time_limit(0.3)
        @pytest.mark.parametrize("position_mm", [0, 100])
        def test_loops(position_mm):
            try:
                while True:
                    pass
            except:
                pass
            assert position_mm == 100
        """
    )
    assert counts == {"failed": 2}
    assert len(re.findall(r"line [78]: The program still runs after 0\.3 s\. Does", text)) >= 2
    assert "assert 0 == 100" not in text


@pytest.mark.parametrize("limit", ["0.3", "1e12", "float('inf')"])
def test_a_test_within_its_real_time_limit_is_not_changed(outcomes, limit):
    body = ENDLESS.format(name="returns", body="return").replace("0.3", limit)
    assert outcomes(body)[0] == {"passed": 2}


def test_ctrl_c_ends_a_test_with_a_real_time_limit(outcomes):
    body = "__import__('_thread').interrupt_main()"
    with pytest.raises(KeyboardInterrupt):
        outcomes(ENDLESS.format(name="loops", body=body).replace("0.3", "60"))


def test_a_program_over_its_simulated_time_is_named_with_its_line_and_where_it_stands(outcomes):
    counts, text = outcomes(
        """
        import pytest

        def drive(rover):
            rover.straight(100)
            while rover.pose().x_mm < 500:
                rover.range_mm()

        @pytest.mark.sim_world(time_limit_s=20)
        def test_drives(sim_brick):
            drive(sim_brick.rover())
        """
    )
    assert counts == {"failed": 1}
    said = r"line [67]: The program still runs after 20 s of simulated time\. Does your loop ever end\? The robot "
    assert re.search(said + r"has stood still since [12]\.\d s\.", text)
    assert "another exception" not in text
    assert "firmware_protocol" not in text


def test_an_unknown_argument_of_the_marker_is_explained(outcomes):
    counts, text = outcomes(
        """
        import pytest

        @pytest.mark.sim_world(latency=30)
        def test_waits(sim_world):
            pass
        """
    )
    assert counts == {"errors": 1}
    assert "another exception" not in text
    assert "got an unexpected keyword argument 'latency'; it is sim_world(world, seed, firmware, latency_ms" in text


def test_the_motors_stop_when_a_test_ends(outcomes):
    counts, _ = outcomes(
        """
        worlds = []

        def test_drives(sim_world, sim_brick):
            worlds.append(sim_world)
            sim_brick.motor("A").run(300)

        def test_it_has_stopped():
            from firmware_protocol.direct import GetOutputState
            from firmware_protocol.enums import OutputPort

            [world] = worlds
            world.advance(1)
            assert world.left_open == []
            assert world.simulation.brick.output.outputs[0].control.actual_speed == 0
        """
    )
    assert counts == {"passed": 2}


def test_the_brick_is_simulated_unless_a_real_one_is_named(outcomes):
    text = """
        import pytest

        def test_either(nxt_brick):
            assert nxt_brick.battery_v > 5

        def test_simulated_only(nxt_brick, sim_world):
            assert nxt_brick.link.transport.address == sim_world.address

        @pytest.mark.real_brick
        def test_real_only(nxt_brick):
            assert "@" not in nxt_brick.link.transport.address
        """
    assert outcomes(text)[0] == {"passed": 2, "skipped": 1}
    # any address does; the simulator's own stands for a real brick here
    assert outcomes(text, "--nxt=sim://open")[0] == {"passed": 2, "skipped": 1}


def test_a_program_that_never_ends_fails_at_its_time_limit_and_the_next_one_runs(outcomes):
    counts, text = outcomes(
        """
        import pytest

        @pytest.mark.sim_world(time_limit_s=5)
        def test_never_ends(sim_world, sim_brick):
            try:
                while True:
                    sim_brick.sleep(0.1)
            finally:
                assert sim_world.time_s == pytest.approx(5, abs=0.1)

        @pytest.mark.sim_world(time_limit_s=5)
        def test_ends(sim_brick):
            sim_brick.sleep(4)
        """
    )
    assert counts == {"passed": 1, "failed": 1}
    assert "The program still runs after 5 s of simulated time." in text


def test_a_program_over_its_simulated_time_fails_its_test_though_it_catches_the_exception(outcomes):
    counts, text = outcomes(
        """
        import pytest

        @pytest.mark.sim_world(time_limit_s=5)
        @pytest.mark.parametrize("position_mm", [0, 100])
        def test_catches(sim_brick, position_mm):
            try:
                sim_brick.sleep(6)
            except Exception:
                pass
            assert position_mm == 100
        """
    )
    assert counts == {"failed": 2}
    assert text.count("line 7: The program still runs after 5 s of simulated time.") >= 2
    assert "assert 0 == 100" not in text


def test_a_terminated_test_run_ends(outcomes):
    counts, text = outcomes(
        """
        import os
        import signal

        def test_is_terminated(sim_brick):
            os.kill(os.getpid(), signal.SIGTERM)
            sim_brick.sleep(1)

        def test_does_not_begin(sim_brick):
            pass
        """
    )
    assert counts == {"failed": 1}
    assert "a signal has ended the program" in text


def test_every_test_has_a_world_of_its_own(outcomes):
    counts, _ = outcomes(
        """
        import pytest

        @pytest.mark.parametrize("number", range(2))
        def test_starts_afresh(sim_world, number):
            assert sim_world.time_s == 0
            sim_world.put_box("crate", x_mm=1000).advance(1)
        """
    )
    assert counts == {"passed": 2}


def test_fixtures_and_markers_are_explained(pytester):
    shown = pytester.runpytest_inprocess("-p", PLUGIN, "--fixtures", "--markers")
    shown.stdout.fnmatch_lines(["@pytest.mark.sim_world(world='empty'*", "@pytest.mark.real_brick:*"])
    shown = pytester.runpytest_inprocess("-p", PLUGIN, "--fixtures")
    for fixture in ("sim_world", "sim_brick", "nxt_brick"):
        shown.stdout.fnmatch_lines([f"{fixture} -- *pytest_plugin.py*"])


def test_the_plugin_costs_next_to_nothing_where_it_is_not_used():
    heavy = (
        "nxtdrive.brick",
        "sim_backend",
        "firmware_protocol",
        "numpy",
        "cv2",
        "pymunk",
        "pydantic",
        "serial",
        "usb",
    )
    code = f"import sys, {PLUGIN}; print([name for name in {heavy!r} if name in sys.modules])"
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert loaded.stdout.strip() == "[]"


def test_the_entry_point_is_called_as_its_module():
    points = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["entry-points"]
    assert points["pytest11"] == {PLUGIN: PLUGIN}


def _pytest_in(example, *options, **environment):
    arguments = ["-p", PLUGIN, "-p", "no:cacheprovider", "-q", *options]
    return subprocess.run(
        [sys.executable, "-m", "pytest", *arguments],
        cwd=ROOT / "examples" / example,
        env={**os.environ, "PYTEST_ADDOPTS": "", **environment},  # the examples' own options count
        capture_output=True,
        text=True,
        check=False,
        timeout=240,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "example", [pytest.param("careful-explorer", marks=pytest.mark.nightly), "lamp-detector", "patient-profile", "."]
)
def test_the_examples_own_tests_pass(example):
    done = _pytest_in(example, FOLDER="solutions")
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("package", ["websockets", "uvicorn"])
def test_without_the_packages_of_the_page_its_example_is_skipped_aloud(tmp_path, package):
    (tmp_path / "sitecustomize.py").write_text(f"import sys\n\nsys.modules[{package!r}] = None\n", encoding="utf-8")
    done = _pytest_in("phone-remote", PYTHONPATH=os.pathsep.join((str(tmp_path), os.environ.get("PYTHONPATH", ""))))
    assert "1 skipped" in done.stdout, done.stdout + done.stderr
    assert package in done.stdout
    assert install_extra("web") in done.stdout.replace("\n", "")


HANDED_IN = {
    "square": "def drive_square(rover):\n    while True:\n        rover.turn(90)\n",
    "bump": "def feel_ahead(rover):\n    rover.straight(100)\n",
    "wall": "def stop_before_wall(brick, rover)\n    rover.stop()\n",
    "lines": "def countlines(brick, rover):\n    pass\n",
}


@pytest.mark.slow
def test_what_a_pupil_got_wrong_is_reported(tmp_path):
    exercises = tmp_path / "exercises"
    exercises.mkdir()
    for name, text in HANDED_IN.items():
        (exercises / f"{name}.py").write_text(text, encoding="utf-8")
    said = _pytest_in("lesson", FOLDER=str(tmp_path)).stdout
    assert "8 failed" in said
    for sentence in (
        "square.py, line 3: The program still runs after 120 s of simulated time. Does your loop ever end?",
        "The function returned None. End it with `return` and the number.",
        "wall.py, line 1: expected ':'",
        "lines.py has no function count_lines.",
        "/fox.toml: cannot be read",
    ):
        assert sentence in said
    assert "importlib" not in said


@pytest.mark.slow
def test_a_pupil_may_hand_in_a_whole_copy_of_the_lesson(tmp_path):
    shutil.copytree(ROOT / "examples" / "lesson", tmp_path / "lesson", ignore=shutil.ignore_patterns("__pycache__"))
    for pupil in ("ann", "bob"):
        shutil.copytree(ROOT / "examples" / "lesson", tmp_path / "lesson" / "pupils" / pupil)
    done = _pytest_in(tmp_path / "lesson", "-k", "exercise_1", FOLDER="pupils/ann")
    assert "1 failed, 7 deselected" in done.stdout, done.stdout


SQUARES = [
    ("for _ in range(4): rover.turn(-90); rover.straight(distance_mm=400)", "1 passed"),
    ("for _ in range(2): rover.straight(400); rover.turn(180)", "The square is 3 mm deep, not 400."),
    ("for _ in range(3): rover.straight(400); rover.turn(120)", r"The square is 3\d\d mm deep, not 400\."),
    ("for angle in (90, 180, -90, 90): rover.straight(400); rover.turn(angle)", "at 3 of the 4 corners of its square"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("body", "sentence"), SQUARES)
def test_a_square_has_four_corners_and_may_begin_with_a_turn(tmp_path, body, sentence):
    (tmp_path / "square.py").write_text(f"def drive_square(rover):\n    {body}\n", encoding="utf-8")
    done = _pytest_in("lesson", "-k", "exercise_1", FOLDER=str(tmp_path))
    assert re.search(sentence, done.stdout), done.stdout


MISTAKES = [
    (
        "lines",
        "count_lines(brick, rover):\n    return brick.light(5).percent",
        "lines.py, line 2: LocalProtocolError: 5 is not a sensor port. Sensors are plugged into 1, 2, 3 or 4.",
    ),
    (
        "square",
        "drive_square(rover):\n    rover.straigth(400)",
        "square.py, line 2: AttributeError: 'Rover' object has no attribute 'straigth'",
    ),
    ("square", "drive_square():\n    pass", "TypeError: drive_square() takes 0 positional arguments"),
    (
        "wall",
        "stop_before_wall(brick, rover):\n    import time\n    while rover.drive(100, 0) is None:\n"
        "        time.sleep(0.1)",
        "wall.py, line 3: UserWarning: the program sleeps",
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "function", "sentence"), MISTAKES)
def test_a_mistake_is_told_with_the_pupils_own_line_alone(tmp_path, name, function, sentence):
    (tmp_path / f"{name}.py").write_text(f"def {function}\n", encoding="utf-8")
    said = _pytest_in("lesson", "--tb=short", "-k", f"test_exercise and {name}", FOLDER=str(tmp_path)).stdout
    assert sentence in said
    assert "nxtdrive" not in said
    assert "test_exercises.py:" not in said.partition("short test summary")[0]


@pytest.mark.slow
def test_a_robot_that_is_never_told_to_stop_does_not_solve_the_wall(tmp_path):
    program = "while rover.range_mm() > 320:\n        rover.drive(100, 0)\n        brick.sleep(0.05)"
    (tmp_path / "wall.py").write_text(f"def stop_before_wall(brick, rover):\n    {program}\n", encoding="utf-8")
    done = _pytest_in("lesson", "-k", "exercise_2", FOLDER=str(tmp_path))
    assert "The robot still drives. Stop it." in done.stdout, done.stdout
    assert "2 failed" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("targets", "sentence"),
    [
        (("lena", "fox"), "The robot found lena and fox, but the fox comes first."),
        (("fox",), "The robot found fox, and not lena."),
    ],
)
def test_a_mission_in_another_order_or_with_a_target_less_is_named(tmp_path, targets, sentence):
    tables = "".join(f'[target.{name}]\ndetector = "picture"\npictures = ["{name}.png"]\n' for name in targets)
    (tmp_path / "fox.toml").write_text(f"[mission]\ntargets = {list(targets)}\n{tables}", encoding="utf-8")
    assert sentence in _pytest_in("lesson", "-k", "exercise_5", FOLDER=str(tmp_path)).stdout


@pytest.mark.slow
def test_no_exercise_of_the_lesson_is_solved_when_it_is_handed_out():
    done = _pytest_in("lesson", FOLDER="exercises")
    assert "8 failed" in done.stdout
    assert "passed" not in done.stdout
    assert "exercise 3 is not solved yet" in done.stdout
