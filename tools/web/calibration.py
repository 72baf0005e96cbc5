"""Calibrations that clients watch: progress, questions, the values found, and the robot file they are saved to."""

from __future__ import annotations

import datetime
import logging
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.mission.robot import RobotFile, RobotFileError, load_robot_file
from behaviors.pause import Pause
from firmware_protocol.errors import ConfigError, NXTError
from nxtdrive.link.interrupting import interruptible
from nxtdrive.mission.files import read_robot_file

from ..calibrate.colors import calibrate_color
from ..calibrate.ruler import calibrate_by_ruler
from ..calibrate.session import CalibrationResult, calibrate
from ..calibrate.verdict import write_robot_file
from .question_slot import QuestionSlot

if TYPE_CHECKING:
    from nxtdrive.mission.assembly import OpenRobot

    from .hub import Hub
    from .messages import StartCalibration

NOTHING: dict[str, Any] = {"values": [], "misfit_px": None, "views": 0, "remark": ""}
"""The state of a calibration without results yet, as clients see it."""
BUG = "This is a bug in nxtdrive. Please report it with the traceback in the terminal and the robot file."


class ShownCalibration:
    """One calibration; clients see what it does, answer its questions and may end it.

    Args:
        wanted: What is to be calibrated, and how.
        before: The robot file so far.
        show: Called with changes for the clients.

    Attributes:
        over: Whether it has ended.
        outcome: Its result; None before its end, or if that was refused.
    """

    kind, drives = "calibration", True

    def __init__(self, wanted: StartCalibration, before: RobotFile, show: Callable[[dict[str, Any]], None]) -> None:
        self.over = False
        self.outcome: CalibrationResult | None = None
        self._wanted, self._before, self._show = wanted, before, show
        self._pause = Pause()
        self._lines: list[str] = []
        self._question = QuestionSlot[str, float](self._pause)

    def end(self) -> None:
        """Abort it; any thread."""
        self._pause.end()
        self._question.wake()

    def answer(self, question: int, value: float) -> None:
        """Answer a question; one that is not open is ignored. Any thread."""
        self._question.answer(question, value)

    def perform(self, robot: OpenRobot) -> None:
        """Calibrate; the robot is at rest afterwards, and the result or the error has been sent to the clients."""
        self._show({"running": True, "lines": [], "problem": "", "saved": False, **NOTHING})
        problem = ""
        try:
            with interruptible(robot.brick.link, self._pause.check), self._pause.interrupting():
                self.outcome = self._calibrated(robot)
        except KeyboardInterrupt:
            problem = "It was ended before anything was found."
        except NXTError as error:
            problem = str(error)
        except Exception as defect:
            logging.getLogger(__name__).exception("the calibration broke")
            problem = f"{type(defect).__name__}: {defect}. {BUG}"
        finally:
            self.over = True
            with suppress(NXTError):  # a lost link; the brick ends the lease of its motors by itself
                robot.brick.stop_motors()
            found = NOTHING if self.outcome is None else _found(self.outcome)
            self._show({"running": False, "question": None, "problem": problem, **found})

    def _calibrated(self, robot: OpenRobot) -> CalibrationResult:
        today = datetime.datetime.now().astimezone().date()
        wanted = self._wanted
        if wanted.how == "color":
            return calibrate_color(robot.brick, robot.camera, self._before, today, wanted.color)
        if wanted.how == "ruler":
            return calibrate_by_ruler(robot.brick, self._before, today, self._await_ready, self._ask_number)
        return calibrate(robot.brick, robot.camera, self._before, wanted.what, today, self._say, wanted.sheet_height_mm)

    def _say(self, line: str) -> None:
        self._lines.append(line)
        self._show({"lines": list(self._lines)})

    def _await_ready(self, instruction: str) -> None:
        self._ask(instruction, number=False)

    def _ask_number(self, question: str) -> float:
        return self._ask(question, number=True)

    def _ask(self, text: str, *, number: bool) -> float:
        """Wait for an answer.

        Raises:
            KeyboardInterrupt: The calibration was ended instead.
        """
        self._say(text)
        answer = self._question.ask(
            text, lambda key: self._show({"question": {"question": key, "text": text, "number": number}})
        )
        self._show({"question": None})
        return answer


class Calibrations:
    """The calibrations of one robot, and its robot file.

    Args:
        hub: Gets all messages.
        file: The robot file; it need not exist.
        used: Called with the file when it has been written; missions use it from then on.
    """

    def __init__(self, hub: Hub, file: Path, used: Callable[[Path], None]) -> None:
        self._hub, self._file, self._used = hub, file, used
        self._latest: ShownCalibration | None = None
        self._state: dict[str, Any] = {"running": False, "lines": [], "question": None, "problem": ""}
        self._state |= {"saved": False, "file": str(file), "known": self._known(), **NOTHING}
        self._show({})

    def start(self, wanted: StartCalibration, begin: Callable[[ShownCalibration], None]) -> None:
        """Calibrate a robot.

        Args:
            wanted: What.
            begin: Lets the robot perform it.

        Raises:
            ValueError: It cannot start now, or the robot file has mistakes; the text says why.
        """
        try:
            before = read_robot_file(self._file if os.path.lexists(self._file) else None)
        except ConfigError as error:
            raise ValueError(str(error)) from None
        calibration = ShownCalibration(wanted, before, self._show)
        begin(calibration)
        self._latest = calibration

    def answer(self, question: int, value: float) -> None:
        """Answer a question; any thread."""
        if self._latest is not None:
            self._latest.answer(question, value)

    def save(self) -> None:
        """Write the last result to the robot file.

        Raises:
            ValueError: There is nothing to save, or it cannot be written.
        """
        if self._latest is None or self._latest.outcome is None:
            raise ValueError("Nothing has been measured that could be saved.")
        try:
            write_robot_file(self._file, self._latest.outcome.file)
            self._used(self._file)
        except OSError as error:
            raise ValueError(f"{self._file} cannot be written: {error.strerror}.") from None
        except NXTError as error:
            raise ValueError(str(error)) from None
        self._show({"saved": True, "known": self._known()})

    def _known(self) -> str:
        """Describe the robot file's contents."""
        if not os.path.lexists(self._file):
            return "there is none yet; the default values are used"
        try:
            return load_robot_file(self._file).calibration.summary
        except RobotFileError as error:
            return str(error)

    def _show(self, changed: dict[str, Any]) -> None:
        self._state = {**self._state, **changed}
        self._hub.show("calibration", self._state)


def _found(outcome: CalibrationResult) -> dict[str, Any]:
    values = [asdict(line) for line in outcome.lines]
    return {"values": values, "misfit_px": outcome.misfit_px, "views": outcome.views, "remark": outcome.remark}
