"""Results of missions for tests."""

from behaviors.executive import Ending
from nxtdrive.tools.sweep.metrics import TargetResult
from nxtdrive.tools.sweep.mission_result import MissionResult


def target_result(time_s=None, *, target="lena", wrong_stops=0, spl=1.0, sct=1.0):
    """Return the result of an existing target, reached at `time_s` if that is given."""
    success = time_s is not None
    weights = (each if success else 0.0 for each in (spl, 1.0, sct))
    return TargetResult(target, True, success, wrong_stops, time_s, None, time_s or 9.0, 900.5, 900.5, *weights)


def mission_result(*targets, **values):
    """Return the result of a mission with these targets."""
    rewards = [float(target.success) for target in targets]
    known = {
        **{"episode_index": 0, "kind": "open", "seed": 100, "agent": "adaptive", "vision": "geometric"},
        **{"success": all(rewards), "sum_reward": sum(rewards), "max_reward": max(rewards, default=0.0), "done": True},
        **{"ending": Ending.ACHIEVED, "error": "", "duration_s": 9.0, "contacts": 0, "targets": list(targets)},
    }
    return MissionResult(**{**known, **values})


def broken_result(**values):
    """Return the result of a mission that broke."""
    return mission_result(ending=Ending.BROKEN, success=False, done=False, error="RuntimeError: lost", **values)
