"""The Gymnasium environments keep Gymnasium's rules, repeat themselves for a seed, and reward by the ground truth."""

from __future__ import annotations

import re
import subprocess
import sys
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from firmware_protocol.errors import ConfigError
from nxtdrive.gym import DecisionEnv, WheelEnv
from nxtdrive.gym.decisions import candidate_number
from nxtdrive.host.environment import install_extra
from nxtdrive.simulated.scenario import generate_scenario
from nxtdrive.tools.sweep.runner import plan
from nxtdrive.tools.sweep.task import evaluate

EXAMPLE = Path(__file__).parents[3] / "examples" / "gym" / "random_driver.py"
ENVIRONMENTS = {
    "decisions": lambda: DecisionEnv(kinds=["block_permanent"], seeds=[104, 106]),
    "wheels": lambda: WheelEnv(seeds=range(3)),
    "wheels with images": lambda: WheelEnv(seeds=range(3), vision="camera"),
}
CASES = [pytest.param(name, marks=[pytest.mark.slow] * (name != "wheels")) for name in ENVIRONMENTS]


@pytest.mark.parametrize("name", CASES)
def test_gymnasiums_checker_accepts_it(name):
    env = ENVIRONMENTS[name]()
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "A Box observation space (has an|m.*unconventional shape)")
        check_env(env, skip_render_check=True, skip_close_check=True)
    env.close()


def _played(env, seed, steps):
    env.action_space.seed(seed)
    seen = [env.reset(seed=seed)]
    for _ in range(steps):
        seen.append(env.step(env.action_space.sample()))
        if seen[-1][2] or seen[-1][3]:
            break
    env.close()
    return seen


@pytest.mark.parametrize(("name", "steps"), [pytest.param("decisions", 1, marks=pytest.mark.slow), ("wheels", 40)])
def test_a_seed_gives_the_same_episode_again(name, steps):
    first, again = (_played(ENVIRONMENTS[name](), 5, steps) for _ in range(2))
    assert data_equivalence(first, again, exact=True)
    assert not data_equivalence(first, _played(ENVIRONMENTS[name](), 6, steps), exact=True)


@pytest.mark.nightly
def test_taking_what_is_proposed_is_the_profiles_own_mission():
    kind, seed = "wall_start", 102
    (task,) = plan([kind], [seed], ["adaptive"], "geometric")
    result = evaluate(task)
    env = DecisionEnv(kinds=[kind])
    _, info = env.reset(options={"kind": kind, "seed": seed})
    total, over = 0.0, False
    while not over:
        begun_s = info["seconds"]
        _, reward, terminated, truncated, info = env.step(0)
        over = terminated or truncated
        total += reward + info["seconds"] - begun_s
    env.close()
    assert sorted(target.target for target in result.targets if target.success) == info["reached"]
    assert info["seconds"] == pytest.approx(result.duration_s, abs=0.1)
    assert 1 <= round(total, 6) <= len(info["reached"])


@pytest.mark.slow
def test_an_action_without_a_candidate_is_what_the_profile_proposes():
    env = DecisionEnv()
    observation, _ = env.reset(options={"kind": "wall_start", "seed": 103})
    assert 0 < observation["action_mask"].sum() < len(observation["action_mask"])
    *_, info = env.step(np.int64(len(observation["action_mask"]) - 1))
    assert info["taken"] == 0
    env.close()


def test_an_action_takes_the_candidate_of_its_number_or_the_first():
    assert [candidate_number(number, 3) for number in (-100, -1, 0, 2, 3, np.int64(2**62))] == [0, 0, 0, 2, 0, 0]
    for action in (np.nan, np.inf, None, "x", "1", 1.5, [1, 2]):
        with pytest.raises(gymnasium.error.InvalidAction):
            candidate_number(action, 3)


def test_a_robot_that_stands_in_front_of_a_target_has_arrived_there_once():
    env = WheelEnv()
    env.reset(options={"kind": "open", "seed": 7})
    env.step(np.zeros(2, np.float32))
    env.reset(options={"kind": "open", "seed": 7})
    target = generate_scenario("open", 7).mission.mission.targets[0]
    episode = env._episode
    at = episode.simulation.truth.pictures[target]
    ahead = np.array([np.cos(np.radians(at.heading_deg)), np.sin(np.radians(at.heading_deg))])
    rewards = []
    place = np.array([at.x_mm, at.y_mm]) + 350 * ahead
    episode.simulation.world.robot.place((float(place[0]), float(place[1])), at.heading_deg + 180)
    for _ in range(4):
        *_, info = out = env.step(np.zeros(2, np.float32))
        rewards.append(out[1])
    assert info["reached"] == [target]
    assert [reward > 0.5 for reward in rewards] == [False, True, False, False]
    env.close()


def test_the_wheels_turn_as_the_action_says():
    env = WheelEnv()
    env.reset(options={"kind": "open", "seed": 7})
    for _ in range(5):
        observation, *_ = env.step(np.array([0.3, -0.3], np.float32))
    assert observation["odometry"][2] > 5
    env.close()


@pytest.mark.parametrize(
    "action",
    [
        [np.nan, 0.0],
        [0.5, np.inf],
        [10**400, 0],
        [0.5j, 0.5],
        np.array([0.5j, 0.5]),
        ["0.5", "0.5"],
        [0.5],
        [0.1, 0.2, 0.3],
        0.5,
        None,
        "ab",
        [[0.1], [0.2]],
    ],
)
def test_an_action_that_is_not_two_finite_numbers_is_refused_and_the_robot_stops(action):
    env = WheelEnv()
    env.reset(options={"kind": "open", "seed": 7})
    env.step(np.array([0.5, 0.5], np.float32))
    with pytest.raises(gymnasium.error.InvalidAction):
        env.step(action)
    env._episode.simulation.advance(2000)
    assert not env._episode.simulation.motors_turn()
    env.close()


@pytest.mark.parametrize("make", [DecisionEnv, WheelEnv])
def test_what_does_not_exist_is_refused(make):
    with pytest.raises(ConfigError, match="no class"):
        make(kinds=["nowhere"])
    with pytest.raises(ConfigError, match="not valid"):
        make(vision="x-ray")
    for cost in (float("nan"), float("inf"), "1", None):
        with pytest.raises(ConfigError, match="cost_per_s is a finite number"):
            make(cost_per_s=cost)
    seeds = ("x", float("nan"), 1.7, True, "7", -1)
    for options in ({"kind": "nowhere"}, {"kind": 5}, *({"seed": seed} for seed in seeds), {"knd": "open"}):
        with pytest.raises(ConfigError, match=r"no class|no seed|no option 'knd'"):
            make().reset(options=options)
    with pytest.raises(ConfigError, match=r"kinds is a list of classes, not 'open'. Write kinds=\['open'\]"):
        make(kinds="open")
    for drawn in ({"kinds": {"open"}}, {"kinds": []}, {"seeds": 5}, {"seeds": {5}}, {"seeds": np.arange(0)}):
        with pytest.raises(ConfigError, match=r"is a list|nothing to draw"):
            make(**drawn)
    with pytest.raises(gymnasium.error.ResetNeeded):
        make().step(make().action_space.sample())


def test_without_gymnasium_the_extra_to_install_is_named():
    program = "import sys; sys.modules['gymnasium'] = None; import nxtdrive.gym"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert f"ModuleNotFoundError: nxtdrive.gym needs the extra nxtdrive[gym]: {install_extra('gym')}" in done.stderr


@pytest.mark.parametrize(("kind", "advice"), [("cluter", "Did you mean 'clutter'?"), ("zzz", "Classes: open, far, ")])
def test_a_class_that_does_not_exist_is_refused_with_the_nearest(kind, advice):
    with pytest.raises(ConfigError, match=re.escape(f"there is no class '{kind}'. {advice}")):
        WheelEnv(kinds=[kind])


def test_a_profile_that_does_not_exist_is_refused():
    with pytest.raises(ConfigError, match="profile 'nobody' cannot be loaded"):
        DecisionEnv(profile="nobody")


def test_seeds_may_be_an_array():
    _, info = WheelEnv(seeds=np.arange(7, 8)).reset(seed=1)
    assert info["seed"] == 7


@pytest.mark.parametrize(("name", "action"), [pytest.param("decisions", 0, marks=pytest.mark.slow), ("wheels", (0, 0))])
def test_an_episode_that_has_ended_needs_a_reset(name, action, monkeypatch):
    env = ENVIRONMENTS[name]()
    env.reset(seed=1)
    if name == "wheels":
        monkeypatch.setattr(env, "_limit_s", lambda episode: 0.5)
    while not any(env.step(action)[2:4]):
        pass
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(action)
    env.reset(seed=1)
    env.step(action)
    env.close()


@pytest.mark.slow
def test_a_mission_that_needs_no_decision_ends_with_the_first_step():
    env = DecisionEnv(kinds=["open"])
    observation, info = env.reset(options={"seed": 3})
    assert info["decision"] is None
    assert not observation["action_mask"].any()
    assert env.step(0)[1:4] == (0.0, True, False)
    with pytest.raises(gymnasium.error.ResetNeeded):
        env.step(0)


def test_speeds_beyond_the_limits_count_as_these():
    env = ENVIRONMENTS["wheels"]()
    seen = []
    for action in ((1, -1), (7, -7)):
        env.reset(seed=1)
        seen.append([env.step(action) for _ in range(5)][-1])
    env.close()
    assert data_equivalence(*seen, exact=True)


def test_the_example_is_the_documents():
    text = (EXAMPLE.parents[2] / "docs" / "gym.md").read_text(encoding="utf-8")
    assert EXAMPLE.read_text(encoding="utf-8") in text


@pytest.mark.slow
def test_the_example_runs():
    done = subprocess.run([sys.executable, str(EXAMPLE)], capture_output=True, text=True, timeout=120, check=True)
    assert "by wheels" in done.stdout
    assert "by decisions" in done.stdout
