"""Drive the course in front of the marker sheet, and record wheels, camera and sonar."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from behaviors.ports import StopReason
from firmware_protocol.errors import NXTError
from nxtdrive.mission.body import MissionBody, safety_sensors
from nxtdrive.motion.outputs import sample
from nxtdrive.motion.wheel_geometry import motor_signs
from nxtdrive.ports import output_port

from .sheet import Seen, find_sheet
from .track import Track, View

if TYPE_CHECKING:
    from behaviors.mission.robot import RobotTable
    from nxtdrive.brick import Brick
    from nxtdrive.motion.rover import Rover
    from nxtdrive.vision.camera import Camera

SLOW_DEG_S, FULL_TURN_DEG_S = 20.0, 25.0
"""Turn rates: with the sheet in view the frame must not blur."""
CREEP_MM_S = 100.0
"""Speed of the drives towards the sheet and back."""
SAMPLES, SAMPLE_S = 3, 0.02
"""Readings of the wheels between two frames, and the time between them: faster changes are not observed."""
FRAME_S = 3.0
"""Longest wait for a frame."""
MIDDLE, EDGE = 0.1, 0.38
"""How far from the middle of the frame the sheet's middle is when it is centred, and where a turn to one side ends, as
shares of the frame's width."""
NEAR_SHARE, FAR_SHARE = 0.58, 0.2
"""Width of the sheet in the frame from near and from far."""
MARKERS_TO_LOCATE, MARKERS_IN_VIEW = 2, 4
"""Minimum number of markers that show where the sheet is, and that it is in view, wholly or nearly."""
FRAMES_TO_LEAVE = 4
"""Frames in a row with fewer markers mean that the sheet leaves the view; in one frame the detector may miss some."""
APPROACHES = 2
"""How often the robot drives towards the sheet and back."""
AWAY_DEG = 150.0
"""After a turn by this, by the dimensions so far, the sheet has left the frame and comes back from the other side."""
FARTHEST_MM, BACK_MM = 800.0, 100.0
"""Longest drive towards the sheet, and how far behind its start the robot then drives back."""
REST_S = 0.6
"""How long the robot stands, still looking, after each turn and drive."""
TRIAL_MM = 120.0
"""How far the robot drives to distinguish forward from back."""
REMEDY = (
    "Hang the sheet flat and upright in good light, put the robot one metre in front of it with free floor all "
    "round, and start again."
)


class CalibrationRefused(NXTError):
    """The measurement is not good enough to be used."""


class Course:
    """Drives in front of the sheet and records.

    Args:
        brick: The brick.
        camera: Its camera.
        rover: The same brick as a vehicle, with the values so far.
        robot: The values so far.

    Attributes:
        track: What was recorded so far.
    """

    def __init__(self, brick: Brick, camera: Camera, rover: Rover, robot: RobotTable) -> None:
        self._brick, self._camera, self._rover = brick, camera, rover
        self._robot = robot
        self._ports = output_port(robot.left), output_port(robot.right)
        self._signs = motor_signs((robot.left_reversed, robot.right_reversed))
        self._body = MissionBody(rover, safety_sensors(robot))  # does without sensors that do not answer
        self.track = Track(camera.size)
        self._blocked = False
        self._lacking = self._unseen = 0

    def drive_all(self, say: Callable[[str], None]) -> float:
        """Drive the whole course; the robot is at rest afterwards.

        Returns:
            When the small turns and straight drives were over; full turns follow.

        Raises:
            CalibrationRefused: The sheet is not in view, or something is in the way.
        """
        try:
            say("looking for the sheet")
            self._centre()
            self._look_aside()
            for _ in range(APPROACHES):
                say("driving towards it")
                driven_mm = self.straight(CREEP_MM_S, lambda seen: self._share(seen) > NEAR_SHARE, FARTHEST_MM)
                self._look_aside()
                say("driving back")
                self.straight(-CREEP_MM_S, lambda seen: self._share(seen) < FAR_SHARE, driven_mm + BACK_MM)
                self._look_aside()
            settled_s = self._brick.now()
            say("turning full circles")
            for sign in (1, -1):
                self._circle(sign)
                self._turn_back(-sign)
            self._look_aside()
        finally:
            self._rover.stop()
        return settled_s

    def column(self) -> float:
        """Return where the middle of the sheet is at rest, as a share of the frame's width, positive right.

        Raises:
            CalibrationRefused: It is not in view.
        """
        return self._offset_share(self._found())

    def approaches(self) -> bool:
        """Drive a little forward and back, and return whether the sheet became larger on the way out."""
        before = self._share(self._found())
        self._rover.straight(TRIAL_MM)
        after = self._share(self._found())
        self._rover.straight(-TRIAL_MM)
        return after > before

    def _found(self) -> Seen:
        """Look at the sheet, at rest."""
        seen = self._rest()
        if not seen.markers:
            raise CalibrationRefused(
                "the camera sees no marker of the sheet.",
                remedy="Print it (nxtdrive calibrate --sheet sheet.pdf), hang it at the lens's height and put the "
                "robot one metre in front of it.",
            )
        return seen

    def _centre(self) -> None:
        """Turn until the sheet is in the middle of the frame."""
        off = self._offset_share(self._found())
        if abs(off) > MIDDLE:
            self._turn_back(1 if off > 0 else -1)
        else:
            self._rest()

    def _turn_back(self, sign: int) -> None:
        """Turn until the sheet, on that side of the frame, is in its middle or beyond: between two frames it moves."""
        self._turn(
            SLOW_DEG_S * sign,
            lambda seen: seen.markers >= MARKERS_TO_LOCATE and sign * self._offset_share(seen) < MIDDLE,
        )
        self._rest()

    def _look_aside(self) -> None:
        """Turn to both sides until the sheet is at the edge of the frame, and back."""
        for sign in (1, -1):
            self._turn(SLOW_DEG_S * sign, self._leaves(sign))
            self._rest()
        self._turn_back(1)

    def _leaves(self, sign: int) -> Callable[[Seen], bool]:
        """Return a function that says whether the sheet leaves the frame in a turn, to the right for sign 1."""
        whole, beyond = False, False

        def leaves(seen: Seen) -> bool:
            nonlocal whole, beyond
            whole = whole or seen.markers >= MARKERS_IN_VIEW
            gone = -sign * self._offset_share(seen)
            if seen.markers:
                beyond = gone > MIDDLE
            # from near, a tilted camera may never see it whole
            lost = (whole and self._lacking >= FRAMES_TO_LEAVE) or (beyond and self._unseen >= FRAMES_TO_LEAVE)
            return gone > EDGE or lost

        return leaves

    def _circle(self, sign: int) -> None:
        """Turn once round, until the sheet is back in the middle of the frame."""
        begin_deg = self._rover.pose().heading_deg

        def back(seen: Seen) -> bool:
            turned_deg = abs(self._rover.pose().heading_deg - begin_deg)
            return (
                turned_deg > AWAY_DEG and seen.markers >= MARKERS_IN_VIEW and sign * self._offset_share(seen) < MIDDLE
            )

        self._turn(FULL_TURN_DEG_S * sign, back, most_s=1.4 * 360 / FULL_TURN_DEG_S)

    def _turn(self, rate_deg_s: float, done: Callable[[Seen], bool], most_s: float = 12.0) -> None:
        end_s = self._brick.now() + most_s
        while not done(self._step(0.0, rate_deg_s)):
            if self._brick.now() >= end_s:
                raise CalibrationRefused(
                    "a turn did not bring the sheet to where it should be in the frame.",
                    remedy="Clear the floor round the robot, hang the sheet where the camera sees all of it from a "
                    "metre, and make sure that only the sheet has such markers. Is the left wheel's motor on port "
                    f"{self._robot.left} and the right one's on port {self._robot.right}? If not, or if the wheels or "
                    "the track are unusual, write that into the robot file first: [robot] left = ..., right = ..., "
                    "wheel_diameter_mm = ..., axle_track_mm = ... (roughly measured)",
                )
        self._rover.stop()

    def straight(self, speed_mm_s: float, done: Callable[[Seen], bool], most_mm: float) -> float:
        """Drive straight until `done`, the sheet leaves the frame as it comes nearer, or something is in the way.

        Args:
            speed_mm_s: Negative: back.
            done: Says of a view of the sheet whether that is far enough.
            most_mm: Longest distance.

        Returns:
            How far it drove.
        """
        begin = self._rover.pose()
        while True:
            seen = self._step(speed_mm_s, 0.0)
            here = self._rover.pose()
            driven_mm = math.hypot(here.x_mm - begin.x_mm, here.y_mm - begin.y_mm)
            if (
                (done(seen) and seen.markers >= MARKERS_IN_VIEW)
                or (speed_mm_s > 0 and self._lacking >= FRAMES_TO_LEAVE)
                or self._blocked
                or driven_mm >= most_mm
            ):
                break
        self._rest()
        return driven_mm

    def _rest(self) -> Seen:
        """Stand still for a moment, looking."""
        self._rover.stop()
        end_s = self._brick.now() + REST_S
        while True:
            seen = self._look()
            if self._brick.now() >= end_s:
                return seen

    def _step(self, speed_mm_s: float, turn_deg_s: float) -> Seen:
        if speed_mm_s > 0 and not self._body.can_drive_forward():
            raise CalibrationRefused(
                f"the robot cannot notice obstacles: {'; '.join(self._body.lost.values())}",
                remedy="Check the cables and ports. For a sensor that is missing, set the port in [robot] to 0.",
            )
        objection = self._rover.drive(speed_mm_s, turn_deg_s)
        if objection in (StopReason.CONTACT, StopReason.STALLED):
            raise CalibrationRefused(f"the robot was stopped: {objection}.", remedy="Clear the floor and start again.")
        self._blocked = objection is StopReason.OBSTACLE
        return self._look()

    def _look(self) -> Seen:
        """Read the wheels until the next frame, and find the sheet in it."""
        for _ in range(SAMPLES):
            self._count()
            self._brick.sleep(SAMPLE_S)
        frame = self._camera.read(FRAME_S)
        self._count()
        seen = find_sheet(frame.image)
        self._lacking = 0 if seen.markers >= MARKERS_IN_VIEW else self._lacking + 1
        self._unseen = 0 if seen.markers else self._unseen + 1
        if seen.markers:
            self.track.views.append(View(frame.time_s, seen))
        if self._robot.ultrasonic and (range_mm := self._rover.range_mm()) is not None:
            self.track.ranges.append((self._brick.now(), range_mm))
        return seen

    def _count(self) -> None:
        reading = sample(self._brick.link, *self._ports)
        left, right = (sign * angle for sign, angle in zip(self._signs, reading.angles_deg, strict=True))
        self.track.counts.append((reading.time_s, left, right))

    def _offset_share(self, seen: Seen) -> float:
        """Return how far right of the frame's middle the sheet is, as a share of the frame's width."""
        return float(seen.in_frame_px[:, 0].mean()) / self.track.size[0] - 0.5 if seen.markers else 0.0

    def _share(self, seen: Seen) -> float:
        """Return the sheet's width in the frame as a share of the frame's."""
        columns = seen.in_frame_px[:, 0]
        return float(columns.max() - columns.min()) / self.track.size[0] if seen.markers else 0.0
