"""The mission: its file and the robot file, read and checked, and the parameters of the profiles."""

from __future__ import annotations

from behaviors.mission.loading import (
    BUILT_IN,
    MissionError,
    chosen_robot_file,
    described_by,
    load_mission,
    valid_targets,
)
from behaviors.mission.tables import AdaptiveParameters, Mission, MissionTable, ThesisParameters

__all__ = [
    "BUILT_IN",
    "AdaptiveParameters",
    "Mission",
    "MissionError",
    "MissionTable",
    "ThesisParameters",
    "chosen_robot_file",
    "described_by",
    "load_mission",
    "valid_targets",
]
