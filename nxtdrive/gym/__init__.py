"""Gymnasium environments of random missions: one that decides after failures, one that drives the wheels.

Needs the extra ``gym``. See docs/gym.md.
"""

from nxtdrive.host.environment import install_extra

try:
    import gymnasium
except ImportError as error:
    raise ModuleNotFoundError(f"nxtdrive.gym needs the extra nxtdrive[gym]: {install_extra('gym')}") from error

from nxtdrive.gym.decisions import DecisionEnv
from nxtdrive.gym.wheels import WheelEnv

__all__ = ["DecisionEnv", "WheelEnv"]

gymnasium.register(id="nxtdrive/Decisions-v0", entry_point="nxtdrive.gym.decisions:DecisionEnv")
gymnasium.register(id="nxtdrive/Wheels-v0", entry_point="nxtdrive.gym.wheels:WheelEnv")
