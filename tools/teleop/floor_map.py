"""A map of the robot's path and echoes, drawn with letters.

It uses only what a real robot has: odometry and echoes. Where the wheels slip, the map is wrong.
"""

from __future__ import annotations

from behaviors.mission.robot import CameraTable
from behaviors.ports import Pose

CELL_MM = (100, 50)
"""Height and width of a character; terminals draw them twice as high as wide."""
FARTHEST_ECHO_MM = 1500.0
"""Beyond, the sonar's cone is wider than a robot, and an echo is not a place on a map."""

PATH, ECHO, TARGET = "·", "#", "T"
ARROWS = "↑↗→↘↓↙←↖"
"""The robot by its heading; the map's top is where it looked at the start."""


class FloorMap:
    """Cells with marks; later marks win, and echoes win over the path.

    Args:
        sonar_forward_mm: How far the ultrasonic sensor is in front of the axle.
        camera: Where its lens is; by default above the middle of the axle.
    """

    def __init__(self, sonar_forward_mm: float = 0.0, camera: CameraTable | None = None) -> None:
        self._sonar_forward_mm, self._camera = sonar_forward_mm, camera or CameraTable()
        self._path: set[tuple[int, int]] = set()
        self._echoes: set[tuple[int, int]] = set()
        self._target: tuple[int, int] | None = None

    def drive_over(self, pose: Pose) -> None:
        """Note the robot's position; this clears an echo noted there."""
        cell = _cell(pose.x_mm, pose.y_mm)
        self._path.add(cell)
        self._echoes.discard(cell)

    def add_echo(self, pose: Pose, distance_mm: float | None) -> None:
        """Note an echo ahead, or none."""
        if distance_mm is not None and distance_mm <= FARTHEST_ECHO_MM:
            self._echoes.add(_cell(*pose.ahead(self._sonar_forward_mm + distance_mm)))

    def add_target(self, pose: Pose, bearing_deg: float, distance_mm: float) -> None:
        """Note where the camera sees the target."""
        self._target = _cell(*self._camera.lens_at(pose).ahead(distance_mm, bearing_deg))

    def draw(self, pose: Pose, width: int, height: int) -> list[str]:
        """Draw lines of text with the robot in the centre.

        Args:
            pose: Where the robot is now.
            width: Characters in a line.
            height: Lines.
        """
        middle = _cell(pose.x_mm, pose.y_mm)
        marks = dict.fromkeys(self._path, PATH) | dict.fromkeys(self._echoes, ECHO)
        if self._target is not None:
            marks[self._target] = TARGET
        marks[middle] = ARROWS[round(pose.heading_deg / 45) % 8]
        up, left = middle[0] + height // 2, middle[1] - width // 2
        return ["".join(marks.get((up - row, left + column), " ") for column in range(width)) for row in range(height)]


def _cell(x_mm: float, y_mm: float) -> tuple[int, int]:
    """Return the cell of a point; forward is up, right is right."""
    return round(x_mm / CELL_MM[0]), round(y_mm / CELL_MM[1])
