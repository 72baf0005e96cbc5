"""Drive a robot at random, then make the decisions of another: the two environments of nxtdrive.gym."""

import gymnasium

import nxtdrive.gym  # registers them  # noqa: F401

wheels = gymnasium.make("nxtdrive/Wheels-v0", kinds=["open"], cost_per_s=0.01)
wheels.action_space.seed(1)
observation, info = wheels.reset(seed=1)
for _ in range(300):
    observation, reward, terminated, truncated, info = wheels.step(wheels.action_space.sample())
    if terminated or truncated:
        break
print("by wheels:", info["reached"], "in", round(info["seconds"]), "s; odometry", observation["odometry"])

decisions = gymnasium.make("nxtdrive/Decisions-v0", kinds=["clutter"], cost_per_s=0.01)
observation, info = decisions.reset(seed=2)
total, over = 0.0, False
while not over:
    observation, reward, terminated, truncated, info = decisions.step(0)  # the proposal
    total, over = total + reward, terminated or truncated
print("by decisions:", info["reached"], "in", round(info["seconds"]), "s; return", round(total, 2))
