"""Where sonar and lens are on the robot, for the page's map."""

from __future__ import annotations

from behaviors.mission import Mission
from behaviors.mission.robot import CameraTable, RobotTable


def robot_shape(mission: Mission | None) -> dict[str, float]:
    """Return the places of sonar and lens by a mission's description, or by common builds if it has none."""
    robot, camera = (mission.robot, mission.camera) if mission else (RobotTable(), CameraTable())
    return {
        "sonar_forward_mm": robot.sonar_forward_mm,
        "forward_mm": camera.forward_mm,
        "right_mm": camera.right_mm,
        "yaw_deg": camera.yaw_deg,
        "hfov_deg": camera.hfov_deg,
    }
