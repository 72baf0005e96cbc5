"""Assemble a mission: an open robot, its hints, and where wanted the record of the run."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.executive import Executive, Report
from behaviors.observers import Observers, error_text
from nxtdrive.brick import Brick, open_brick
from nxtdrive.link.interrupting import interruptible
from nxtdrive.mission.body import MissionClock, mission_ports
from nxtdrive.mission.camera import default_camera, open_mission_camera, watch_frames
from nxtdrive.mission.review.reviewed_run import ReviewedRun
from nxtdrive.mission.review.run_review import RunReview
from nxtdrive.mission.truth import simulated_room_of, truth_of
from nxtdrive.mission.vision import mission_vision
from nxtdrive.recording.recording import Recording
from nxtdrive.recording.run_folder import CAMERA, JOURNAL, MISSION, SUMMARY, VIDEO, new_run_folder, summary
from nxtdrive.recording.video import VIDEO_FPS, Follow
from nxtdrive.signals import held
from nxtdrive.transports.address import Address
from nxtdrive.transports.record import brick_address
from nxtdrive.transports.sim import simulated
from nxtdrive.version import installed_version
from nxtdrive.vision.target_vision import CameraVision, OnLook

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from behaviors.pause import Pause
    from behaviors.ports import Vision
    from behaviors.profiles.profile import MakeProfile
    from nxtdrive.vision.camera import Camera, Frame

WatchFrames = Callable[[Callable[["Frame"], None]], None]
"""Registers a function to be called with the camera's frames."""
HINTS = "hints"
"""Name of the hints as an observer, and in the summary."""


@dataclass(frozen=True, slots=True)
class OpenRobot:
    """A brick and its camera, open.

    Attributes:
        brick: The brick.
        camera: The camera.
        address: The brick's, as it was given.
        source: The camera's, as for `nxtdrive.vision.sources.open_camera`.
    """

    brick: Brick
    camera: Camera
    address: str
    source: str

    def watch(
        self,
        observer: Callable[[Frame], None],
        fps: float = VIDEO_FPS,
        wanted: Callable[[int], bool] = lambda _: True,
    ) -> None:
        """Call `observer` with the camera's frames; see `nxtdrive.mission.camera.watch_frames`."""
        watch_frames(self.camera, self.brick, observer, fps, wanted)

    def vision(self, mission: Mission) -> Vision:
        """Return the vision of a mission; see `nxtdrive.mission.vision.mission_vision`."""
        return mission_vision(mission, self.brick, self.camera, self.source)


@contextmanager
def open_robot(nxt: str | Address, camera: str | None = None, *, reconnect: bool = True) -> Iterator[OpenRobot]:
    """Open a brick and its camera; at the end of the block the motors are off and both are closed.

    Args:
        nxt: The brick's address.
        camera: As for `nxtdrive.vision.sources.open_camera`; by default the simulated robot's own, else webcam 0.
        reconnect: Reopen a lost link in the background; requests fail at once, and the suspended mission does the
            waiting.

    Raises:
        BrickNotFound: No brick there.
        LinkError: A brick, but no link to it.
        CameraError: The camera cannot be opened.
    """
    with open_brick(nxt) as brick:
        if reconnect:
            brick.link.reconnect_timeout_s = 0.0
            # probing a simulated link without faults, which is never lost, would shift the simulation by milliseconds
            transport = simulated(brick.link.transport)
            brick.link.reconnecting = transport is None or transport.may_be_lost
        source = camera or default_camera(brick)
        with closing(open_mission_camera(source, brick)) as opened:
            yield OpenRobot(brick, opened, str(nxt), source)


class MissionRun:
    """A mission on an open robot; it begins with `pursue`.

    Args:
        mission: What to do.
        robot: What does it.
        observers: Called with each record of the journal; further ones may be added before `pursue`.
        file: The mission's file, for the commands in hints; None for the built-in one.
        say_hint: Called with each hint as soon as there is one.
        make_profile: Makes the profile; None for the one that the mission names.
        pause: With it an operator pauses and ends the mission.

    Attributes:
        observers: As given.
        robot: As given.
        recording: The record of the run, once `record` was called.

    Raises:
        ConfigError: A target's picture cannot be used.
    """

    def __init__(
        self,
        mission: Mission,
        robot: OpenRobot,
        observers: Observers,
        *,
        file: Path | None = None,
        say_hint: Callable[[str], None] = lambda _: None,
        make_profile: MakeProfile | None = None,
        pause: Pause | None = None,
    ) -> None:
        self.observers = observers
        self.recording: Recording | None = None
        self.robot, self._mission, self._pause = robot, mission, pause
        self._report: Report | None = None
        self._error = ""
        self._vision = robot.vision(mission)
        ports = mission_ports(robot.brick, mission, self._vision)
        self._executive = Executive(mission, ports, observers, make_profile, pause)
        by_name = not isinstance(self._vision, CameraVision)
        world = brick_address(Address.parse(robot.address)).target
        run = ReviewedRun(mission, truth_of(robot.brick), file, by_name, robot.source, world)
        self._review = RunReview(run, say_hint)

    def on_look(self, observer: OnLook) -> None:
        """Call `observer` after each look at a frame; geometric vision has no frames and never calls it."""
        if isinstance(self._vision, CameraVision):
            self._vision.on_look(observer)

    def record(self, parent: Path, *, video: bool = True, watch: WatchFrames | None = None) -> Recording:
        """Record the run in a new folder, which is complete when `pursue` ends.

        Args:
            parent: Where to make the folder.
            video: Whether to keep the camera's frames.
            watch: Registers a function to be called with the camera's frames; the robot's own by default.

        Raises:
            ConfigError: The folder cannot be made.
        """
        room = simulated_room_of(self.robot.brick)
        folder, clock = new_run_folder(parent, self._mission.mission.name), MissionClock(self.robot.brick)
        recording = self.recording = Recording(folder, clock, video=video, room=room.outlines if room else None)
        self.observers.attempt(MISSION, recording.folder.write_mission, self._mission)
        self.on_look(self.observers.guarded(CAMERA, recording.look))
        (watch or self.robot.watch)(self.observers.guarded(CAMERA, recording.frame))
        self.observers.add(JOURNAL, recording)
        return recording

    def pursue(self) -> Report:
        """Run the mission to its end; motors are off and the record is complete when it returns or raises.

        Returns:
            The report, with hints and arrivals.
        """
        self.observers.add(HINTS, self._review)
        self.on_look(self.observers.guarded(HINTS, lambda frame, *_: self._review.see(frame)))
        brick, review = self.robot.brick, self._review
        try:
            with interruptible(brick.link, self._pause.check if self._pause else None):
                review.compare_brick(brick)
                report = self._executive.run()
            self._report = replace(report, hints=tuple(review.hints), arrivals=tuple(review.run.arrivals))
            return self._report
        except BaseException as reason:
            self._error = error_text(reason)
            raise
        finally:
            if self.recording:
                with held():
                    self.recording.finish(self._report, self._error, self._details(), self.observers)

    def write_video(self, follow: Follow) -> None:
        """Make the video of the camera's frames, after `pursue`; a failure is noted in the summary.

        Args:
            follow: Passes the frames on, such as to show progress.
        """
        if self.recording is None or CAMERA in self.observers.failures:
            return
        self.observers.attempt(VIDEO, self.recording.write_video, follow)
        if VIDEO in self.observers.failures:
            folder = self.recording.folder
            self.observers.attempt(SUMMARY, folder.write_summary, self._report, self._error, self._details())

    def summary(self) -> dict[str, object]:
        """Return the summary as plain values, as ``summary.json`` has it."""
        return summary(self._report, self._error, self._details())

    def _details(self) -> dict[str, object]:
        return {
            "nxtdrive": installed_version(),
            "mission": self._mission.mission.name,
            "nxt": self.robot.address,
            "camera": self.robot.source,
            "arrivals": self._review.run.arrivals,
            HINTS: self._review.hints,
            **self.observers.summary(),
        }
