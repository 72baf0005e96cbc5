"""Short motions of a robot that no mission drives."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from behaviors.ports import MotionResult, Pose
from firmware_protocol.errors import NXTError

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.link.scheduler import Motion
    from nxtdrive.motion.rover import Rover

CHECK_S = 0.02
"""How often a motion checks whether to abort."""


@dataclass(frozen=True, slots=True)
class RobotReading:
    """The robot at rest.

    Attributes:
        pose: By odometry, in the frame in which the robot is driven by hand.
        range_mm: Distance ahead; None without an echo or without a sonar.
        touching: Whether the bumper is pressed; False without one.
        battery_mv: Battery voltage.
    """

    pose: Pose
    range_mm: float | None
    touching: bool
    battery_mv: int


class ShortMotion:
    """A motion of the robot, then a reading of its sensors.

    Args:
        begin: Begins the motion; None only reads the sensors.

    Attributes:
        drives: Whether it moves the robot.
        over: Whether it has ended.
        result: Of the motion; None before its end and without one.
        reading: The robot afterwards; None before the end, or if the link was lost.
        problem: Why there is no reading, or empty.
    """

    kind = "motion"

    def __init__(self, begin: Callable[[Rover], Motion[MotionResult]] | None = None) -> None:
        self.drives = begin is not None
        self.over = False
        self.result: MotionResult | None = None
        self.reading: RobotReading | None = None
        self.problem = ""
        self._begin = begin
        self._ended, self._done = threading.Event(), threading.Event()

    def end(self) -> None:
        """Abort it; any thread."""
        self._ended.set()

    def wait(self, timeout_s: float) -> bool:
        """Wait for its end, for at most `timeout_s` of real time; returns whether it has ended. Any thread."""
        return self._done.wait(timeout_s)

    def perform(self, brick: Brick, rover: Rover) -> None:
        """Drive and read the sensors; the robot is at rest afterwards."""
        try:
            if self._begin is not None and not self._ended.is_set():
                motion = self._begin(rover)
                while not (motion.done or self._ended.is_set()):
                    brick.sleep(CHECK_S)
                motion.cancel()  # no effect if it is done
                self.result = motion.join()
            self.reading = RobotReading(rover.pose(), rover.range_mm(), rover.touching(), rover.battery_mv())
        except NXTError as error:
            self.problem = str(error)
        finally:
            self.over = True
            self._done.set()
