"""A mission: what to look for, with which robot, and the parameters of its behaviour.

The tables of a mission file, each with its keys, ranges and defaults. Units are in the keys' names.
"""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from behaviors.mission.robot import CalibrationTable, CameraTable, ColorName, ColorTable, RobotTable, Table
from behaviors.mission.targets import MAX_TARGETS, OnnxTarget, Target
from behaviors.plausibility import TOLERANCE_MM
from behaviors.profile_names import ADAPTIVE, THESIS, profile_in_mission

LENS_BEHIND_SONAR_MM = 40.0
"""How far the lens is behind the sonar on common builds; counts while a mission does not give the lens's place."""


class ThesisParameters(Table):
    """Parameters of the thesis profile; where the thesis gives none, the reading of docs/thesis.md.

    The adaptive profile also uses `continue_every_s`, and `advances` and `advance_mm` if it does not choose viewpoints.

    Attributes:
        wait_s: Time at rest when the target was recognised but not reached.
        turn_deg: Turn to the right before moving off when it was not recognised.
        advances: Number of advances in one move_to.
        advance_mm: Length of one advance.
        max_researches: Searches for one target after the first.
        look_every_deg: Turn between two looks of a search; one full turn to the right in all.
        looks_per_stop: Maximum number of frames searched at each stop.
        settle_s: Rest before a look, so that the camera stops swinging.
        continue_every_s: Longest time that one call of arrive drives before it answers "continue".
        lost_after_s: A target that is not seen for this long is lost.
        approach_limit_s: An approach that takes longer has failed.
        arrive_mm: Apparent distance at which the target is reached.
        cruise_mm_s: Speed of an approach.
    """

    wait_s: float = Field(default=15.0, ge=0, le=600)
    turn_deg: float = Field(default=90.0, ge=-360, le=360)
    advances: int = Field(default=10, ge=1, le=100)
    advance_mm: float = Field(default=150.0, ge=10, le=2000)
    max_researches: int = Field(default=2, ge=0, le=20)
    look_every_deg: float = Field(default=30.0, ge=5, le=180)
    looks_per_stop: int = Field(default=3, ge=1, le=20)
    settle_s: float = Field(default=0.3, ge=0, le=5)
    continue_every_s: float = Field(default=5.0, ge=0.5, le=60)
    lost_after_s: float = Field(default=2.0, ge=0.2, le=30)
    approach_limit_s: float = Field(default=45.0, ge=1, le=600)
    arrive_mm: float = Field(default=420.0, ge=100, le=2000)
    cruise_mm_s: float = Field(default=150.0, ge=20, le=400)


class AdaptiveParameters(Table):
    """Parameters of the adaptive profile; most were tuned on separate seeds, see docs/evaluation.md.

    Attributes:
        cruise_mm_s: Speed of an approach, and along a path where something may be near.
        travel_share: Along a path it drives at this many times that speed while there is no near echo.
        scan_deg_s: Turn rate while scanning where distant objects may be in view; faster blurs them.
        lost_after_s: A target that should be in view and is not seen for this long is lost.
        approach_limit_s: An approach that takes longer has failed.
        arrive_mm: Apparent distance at which the target is reached.
        sonar_tolerance_mm: An arrival counts only if the sonar's echo and the apparent distance differ by no more than
            this, or than a third of the distance if that is more. Without an echo it counts as well.
        search_budget_s: Longest search for a target without a sighting before another one is pursued.
        rounds: Maximum number of rounds through the list of targets, unless that of [mission] is larger.
        max_researches: Searches for one target after the first, in each round; without it there is no limit.
        repeats: Maximum number of choices of one recovery for one target at one place, and of choices there after one
            kind of failure.
        detours: Whether it goes round obstacles.
        chooses_viewpoints: Whether it chooses where to look from next; otherwise it moves off as the thesis does.
        remembers_others: Whether it remembers where it saw the other targets.
        sees_floor: Whether the map shows how far the camera sees free floor.
        in_order: Whether targets are pursued strictly in order. Otherwise one that was seen and can be reached sooner
            may come first.
        fixed_wait_s: Length of every wait; without it, each wait lasts as long as it is expected to pay off.
        chances: How often choices succeeded in your own runs: a file written by `nxtdrive chances`.
    """

    cruise_mm_s: float = Field(default=200.0, ge=70, le=400)
    travel_share: float = Field(default=1.5, ge=1, le=3)
    scan_deg_s: float = Field(default=36.0, ge=5, le=120)
    lost_after_s: float = Field(default=1.2, ge=0.2, le=30)
    approach_limit_s: float = Field(default=60.0, ge=1, le=600)
    arrive_mm: float = Field(default=420.0, ge=100, le=2000)
    sonar_tolerance_mm: float = Field(default=TOLERANCE_MM, ge=50, le=10000)
    search_budget_s: float = Field(default=42.0, ge=1, le=3600)
    rounds: int = Field(default=5, ge=1, le=20)
    max_researches: int | None = Field(default=None, ge=0, le=100)
    repeats: int = Field(default=2, ge=1, le=10)
    detours: bool = True
    chooses_viewpoints: bool = True
    remembers_others: bool = True
    sees_floor: bool = True
    in_order: bool = False
    fixed_wait_s: float | None = Field(default=None, ge=0, le=600)
    chances: dict[str, Annotated[list[Annotated[int, Field(ge=0)]], Field(min_length=2, max_length=2)]] | None = None

    @property
    def travel_mm_s(self) -> float:
        """Speed along a path while there is no near echo."""
        return self.travel_share * self.cruise_mm_s


class MissionTable(Table):
    """What to do.

    Attributes:
        name: A title, for displays and run folders.
        targets: Names of targets, in order.
        profile: How to behave: adaptive, thesis, an installed profile, or your own as module:Class.
        rounds: Maximum number of rounds through the list of targets; later rounds try again what was given up. The
            adaptive profile makes as many as [adaptive] says, if that is more.
        time_limit_s: When the mission ends, whatever has been reached.
        reconnect_timeout_s: A mission is suspended while the brick or the camera does not answer, and ends when that
            lasts longer than this.
        robot_file: A robot file in the folder of this one; keys of [robot] and [camera] in this file take precedence.
    """

    name: str = "mission"
    targets: list[str] = Field(min_length=1)
    profile: Annotated[str, AfterValidator(profile_in_mission)] = ADAPTIVE
    rounds: int = Field(default=1, ge=1, le=20)
    time_limit_s: float = Field(default=600.0, gt=0, le=86400)
    reconnect_timeout_s: float = Field(default=30.0, ge=0, le=3600)
    robot_file: str | None = None


class Mission(Table):
    """A whole mission file.

    Attributes:
        color: How colours look in the robot's camera, by their names.
        calibration: Where the values of the robot file come from that describes the robot.
    """

    mission: MissionTable
    target: dict[str, Target] = Field(max_length=MAX_TARGETS)
    thesis: ThesisParameters = ThesisParameters()
    adaptive: AdaptiveParameters = AdaptiveParameters()
    robot: RobotTable = RobotTable()
    camera: CameraTable = CameraTable()
    color: dict[ColorName, ColorTable] = Field(default={})
    calibration: CalibrationTable = CalibrationTable()

    @property
    def parameters_name(self) -> str:
        """Name of the table of the mission's profile; an external one usually inherits from the adaptive one."""
        return THESIS if self.mission.profile == THESIS else ADAPTIVE

    @property
    def parameters(self) -> ThesisParameters | AdaptiveParameters:
        """That table."""
        return self.thesis if self.parameters_name == THESIS else self.adaptive

    @property
    def guessed_heights(self) -> frozenset[str]:
        """Names of the targets whose height the mission does not give: theirs is that usual with the label."""
        return frozenset(
            name for name, target in self.target.items() if isinstance(target, OnnxTarget) and target.guessed
        )

    @property
    def sonar_ahead_mm(self) -> float:
        """How far the sonar is in front of the lens, by common builds unless the lens's place is known."""
        if "forward_mm" not in self.camera.model_fields_set:
            return LENS_BEHIND_SONAR_MM
        return self.robot.sonar_forward_mm - self.camera.forward_mm
