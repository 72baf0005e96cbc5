"""One calibration from the first look to the robot file."""

from __future__ import annotations

import datetime
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from behaviors.mission.robot import RobotFile, RobotTable, brick_id
from firmware_protocol.printable import printable
from nxtdrive.mission.body import build_rover

from . import SHEET_HEIGHT_MM
from .camera_and_wheels import CAMERA_KEYS, WHEEL_KEYS, Estimate, believed_values, estimate, misfit_px
from .course import CalibrationRefused, Course
from .motor_directions import dead_zone_percent, is_reversed
from .sonar_place import SheetRefused, estimate_sonar, size_doubt
from .verdict import check, described, measured, rounded

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Camera

    from .track import Track

METHOD = "marker sheet"
CONE_UNSURE_DEG = 6.0
"""A beam whose angle is less certain keeps the one that it had."""


@dataclass(frozen=True, slots=True)
class ReportLine:
    """One value in the report.

    Attributes:
        key: Its name in the robot file, with its table; for a value that is only reported, with what was calibrated.
        before: The value before; None for one that was not known.
        after: The measured value.
        standard_error: Its uncertainty; None where it is certain.
    """

    key: str
    before: object
    after: object
    standard_error: float | None


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """The result of a calibration.

    Attributes:
        file: The new robot file.
        lines: Its new values.
        misfit_px: By how much the markers were missed with the previous values, and with the new file; None if only
            the motors were calibrated.
        views: Frames in which the sheet was seen.
        remark: A further sentence on the values before and after.
    """

    file: RobotFile
    lines: list[ReportLine]
    misfit_px: tuple[float, float] | None
    views: int
    remark: str = ""


def calibrate(
    brick: Brick,
    camera: Camera,
    before: RobotFile,
    what: Collection[str],
    today: datetime.date,
    say: Callable[[str], None] = lambda _: None,
    sheet_height_mm: float = SHEET_HEIGHT_MM,
) -> CalibrationResult:
    """Calibrate before the marker sheet; the robot is at rest afterwards.

    Args:
        brick: The brick.
        camera: Its camera.
        before: The robot file so far.
        what: Some of `behaviors.mission.robot.CALIBRATED`; the others keep their values.
        today: The date for the file.
        say: Called with what is being done.
        sheet_height_mm: The middle of the sheet above the floor.

    Raises:
        CalibrationRefused: The measurement cannot be used; the error says what to do.
    """
    robot, new = before.robot, _Values(today)
    wanted = _possible(what, robot)
    new.tables["calibration"] |= identified(brick, before)
    if "motors" in wanted:
        say("turning each wheel")
        robot, power = _motors(brick, camera, robot)
        directions = {"left_reversed": robot.left_reversed, "right_reversed": robot.right_reversed}
        new.add("motors", "robot", directions, {}, dead_zone_percent=float(power))
    course, found, remark = None, None, ""
    if {"camera", "wheels", "sonar"} & wanted:
        course = Course(brick, camera, build_rover(brick, robot), robot)
        settled_s = course.drive_all(say)
        say("computing")
        found = estimate(course.track, robot, before.camera, settled_s)
        own = {name: found.values[name] for name in (*CAMERA_KEYS, *WHEEL_KEYS)}
        check(found, camera.size[0], misfit_px(course.track, own, found.values))
        _add(new, wanted, found, sheet_height_mm)
        remark = _add_sonar(new, course.track, found) if "sonar" in wanted else ""
    file = described(before, new.tables)
    lines = list(new.lines(before, file))
    if course is None or found is None:
        return CalibrationResult(file, lines, None, 0)
    earlier_px, now_px = (
        misfit_px(course.track, believed_values(each.robot, each.camera), found.values) for each in (before, file)
    )
    return CalibrationResult(file, lines, (earlier_px, now_px), found.views, remark)


def _possible(what: Collection[str], robot: RobotTable) -> set[str]:
    """Return what of that this robot has.

    Raises:
        CalibrationRefused: Only the sonar is wanted, and it has none.
    """
    possible = set(what) if robot.ultrasonic else set(what) - {"sonar"}
    if not possible:
        raise CalibrationRefused("the robot has no sonar: ultrasonic is 0.", remedy="Write its port into [robot].")
    return possible


def identified(brick: Brick, before: RobotFile) -> dict[str, object]:
    """Return what a robot file says of its brick.

    Raises:
        CalibrationRefused: The file so far describes another one.
    """
    device = brick.info()
    if before.calibration.describes_another(device.bluetooth_address):
        raise CalibrationRefused(
            f"the robot file describes the brick {before.calibration.brick_id}, and this one is "
            f"{brick_id(device.bluetooth_address)}.",
            remedy="Choose another file with --robot.",
        )
    return {"format": 1, "brick_id": brick_id(device.bluetooth_address), "brick_name": printable(device.name)}


class _Values:
    """New values for a robot file.

    Args:
        today: The date for the file.

    Attributes:
        tables: The values by their table.
    """

    def __init__(self, today: datetime.date) -> None:
        self.tables: dict[str, dict[str, object]] = {"camera": {}, "robot": {}, "calibration": {}}
        self._errors: dict[str, float] = {}
        self._groups: list[str] = []
        self._today = today

    def add(
        self, group: str, table: str, values: Mapping[str, object], errors: Mapping[str, float], **others: float
    ) -> None:
        """Add the values of a group with their standard errors, and others that are only reported."""
        self.tables[table] |= values
        self.tables["calibration"][group] = measured(METHOD, errors, self._today, **others)
        self._errors |= errors
        self._groups.append(group)

    def lines(self, before: RobotFile, after: RobotFile) -> Iterator[ReportLine]:
        """Yield the report's lines."""
        for name in ("camera", "robot"):
            old, new = getattr(before, name), getattr(after, name)
            for key in self.tables[name]:
                yield ReportLine(f"{name}.{key}", getattr(old, key), getattr(new, key), self._errors.get(key))
        for group in self._groups:
            known = getattr(before.calibration, group)
            for key, value in getattr(after.calibration, group).measured.items():
                yield ReportLine(f"{group}.{key}", known.measured.get(key) if known else None, value, None)


def _add(new: _Values, what: Collection[str], found: Estimate, sheet_height_mm: float) -> None:
    """Add the values of camera and wheels found in front of the sheet."""
    errors = found.standard_errors
    if "camera" in what:
        values = rounded(found.values, CAMERA_KEYS)
        values["height_mm"] = round(sheet_height_mm + found.values["above_mm"], 1)
        new.add("camera", "camera", values, {key: errors[key] for key in CAMERA_KEYS})
    if "wheels" in what:
        # the track is the one that fits how far the robot turns, which includes slip
        values = {**rounded(found.values, WHEEL_KEYS), "turn_slip_percent": 0.0}
        new.add("wheels", "robot", values, {key: errors[key] for key in WHEEL_KEYS})


def _add_sonar(new: _Values, track: Track, found: Estimate) -> str:
    """Add the sonar's values; return what is to be said: why it keeps those that it had, or doubts of the sheet.

    Raises:
        CalibrationRefused: They cannot be used, and there are no others; or the sheet's size is wrong.
    """
    try:
        solution = estimate_sonar(track, found.values)
    except CalibrationRefused as refusal:
        if isinstance(refusal, SheetRefused) or not new.tables["camera"] | new.tables["robot"]:
            raise
        return f"The sonar was not calibrated: {refusal}"
    values, sure = {"sonar_forward_mm": round(solution.forward_mm, 1)}, {"sonar_forward_mm": solution.standard_error_mm}
    if solution.cone_deg is not None and solution.cone_deg[1] < CONE_UNSURE_DEG:
        values["sonar_cone_deg"], sure["sonar_cone_deg"] = solution.cone_deg
    new.add("sonar", "robot", values, sure, noise_mm=round(solution.noise_mm, 1))
    doubt = size_doubt(solution.scale)
    return doubt and f"Check the sheet: {doubt}"


def _motors(brick: Brick, camera: Camera, robot: RobotTable) -> tuple[RobotTable, int]:
    """Return how the motors are mounted, and the least power at which they turn."""
    plain = robot.model_copy(update={"left_reversed": False, "right_reversed": False})
    course = Course(brick, camera, build_rover(brick, plain), plain)
    left = is_reversed(brick, robot.left, 1, course.column)
    right = is_reversed(brick, robot.right, -1, course.column)
    robot = robot.model_copy(update={"left_reversed": left, "right_reversed": right})
    if left and right and not Course(brick, camera, build_rover(brick, robot), robot).approaches():
        raise CalibrationRefused(
            f"the motor on port {robot.left} drives the right wheel and that on port {robot.right} the left one.",
            remedy=f'Exchange the cables, or set left = "{robot.right}" and right = "{robot.left}" in [robot].',
        )
    return robot, dead_zone_percent(brick, robot)
