"""The task of a robot's thread besides driving by hand; there is one at a time."""

from __future__ import annotations

import threading

from ..teleop.controls import Controls
from .calibration import ShownCalibration
from .mission_run import ShownMission
from .motions import ShortMotion

Task = ShownMission | ShownCalibration | ShortMotion

STOPPED = "The robot is stopped. A person must release the stop on the page first."


class TaskSlot:
    """Holds the task that runs or is about to; all methods may be called from any thread.

    Args:
        controls: They say whether the robot is stopped.

    Attributes:
        end_count: Number of calls of `end`. Reading a mission's file takes time, during which the mission can be
            ended already: note this number when a mission is asked for and give it to `start`, which refuses then.
    """

    def __init__(self, controls: Controls) -> None:
        self.end_count = 0
        self._controls = controls
        self._latest: Task | None = None
        self._lock = threading.Lock()

    @property
    def current(self) -> Task | None:
        """The task that runs or is about to, if there is one."""
        task = self._latest
        return None if task is None or task.over else task

    @property
    def mission(self) -> ShownMission | None:
        """The same if it is a mission."""
        return task if isinstance(task := self.current, ShownMission) else None

    def start(self, task: Task, end_count: int | None = None) -> None:
        """Make a task the current one.

        Args:
            task: The task.
            end_count: As it was when the task was asked for; None to start it in any case.

        Raises:
            ValueError: It cannot start now; the text says why.
        """
        with self._lock:
            if end_count not in (None, self.end_count):
                raise ValueError("It was ended before it began.")
            if self._controls.stopped and task.drives:
                raise ValueError(STOPPED)
            if (running := self.current) is not None:
                raise ValueError(f"A {running.kind} is running. End it first.")
            self._latest = task

    def check_hand_drive(self) -> None:
        """Check that nothing keeps the robot from being driven by hand.

        Raises:
            ValueError: Something does; the text says what.
        """
        if self._controls.stopped:
            raise ValueError(STOPPED)
        if (running := self.current) is not None and running.drives:
            raise ValueError(f"A {running.kind} is running. End it first, to drive by hand.")

    def end(self) -> None:
        """End the current task, if there is one."""
        with self._lock:
            self.end_count += 1
            task = self.current
        if task is not None:
            task.end()
