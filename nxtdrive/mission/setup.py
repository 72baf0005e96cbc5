"""Implements the ports of a mission: opens its robot and camera.

The behaviour uses only the ports of `behaviors.ports`, which are implemented here: a rover as the body, a camera with
detectors as the eyes, the link's clock as the clock.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.mission import BUILT_IN, Mission, MissionError, load_mission
from behaviors.mission_targets import ColorTarget, Target
from behaviors.profile_names import BUILT_IN_PROFILES
from behaviors.robot_description import ROBOT_VARIABLE, RobotFile, RobotFileError, load_robot_file
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.mission.body import MissionBody, MissionClock
from nxtdrive.motion.obstacle_monitor import SafetyLimits
from nxtdrive.transports.record import recorded
from nxtdrive.transports.sim import SimTransport

if TYPE_CHECKING:
    from behaviors.ports import Eyes
    from behaviors.robot_description import CameraTable, ColorName, ColorTable, RobotTable
    from nxtdrive.brick import Brick
    from nxtdrive.motion.rover import Rover
    from nxtdrive.vision.camera import Camera, Frame
    from nxtdrive.vision.detection import TargetDetector
    from nxtdrive.vision.eyes import CameraEyes, GeometricSensor
    from nxtdrive.vision.geometry import Pinhole

SIMULATED, GEOMETRIC, FIRST_WEBCAM = "sim", "geometric", "0"
"""Cameras by name: the simulated robot's, the same without pictures, and the first webcam."""

PICTURES = Path(str(resources.files("sim_backend"))) / "pictures"
"""The built-in pictures; a mission may name them without having copies."""


def usual_robot() -> Path | None:
    """Return the robot file of the environment, if it names one."""
    named = os.environ.get(ROBOT_VARIABLE)
    return Path(named) if named else None


def read_robot_file(path: Path | None) -> RobotFile:
    """Read a robot file; without a path, one without values.

    Raises:
        ConfigError: The file has mistakes; the message lists all of them.
    """
    try:
        return RobotFile() if path is None else load_robot_file(path)
    except RobotFileError as error:
        raise ConfigError(str(error)) from None


def load(path: Path | None, robot: Path | None = None) -> Mission:
    """Read a mission file; without a path, the built-in one.

    Args:
        path: The mission file.
        robot: The robot file; by default the one that the mission names, or else ``$NXT_ROBOT``.

    Raises:
        ConfigError: A file has mistakes; the message lists all of them.
    """
    try:
        mission = load_mission(path or BUILT_IN, [PICTURES], robot=robot, usual_robot=usual_robot())
    except MissionError as error:
        raise ConfigError(str(error)) from None
    return with_profile(mission, mission.mission.profile)


def with_profile(mission: Mission, profile: str) -> Mission:
    """Return the mission with a profile, whose class can be loaded.

    Raises:
        ConfigError: It cannot.
    """
    if profile not in BUILT_IN_PROFILES:
        from behaviors.profiles.registry import find_profile

        try:
            find_profile(profile)
        except MissionError as error:
            raise ConfigError(str(error)) from None
    return mission.model_copy(update={"mission": mission.mission.model_copy(update={"profile": profile})})


def build_rover(brick: Brick, robot: RobotTable) -> Rover:
    """Return the vehicle that a mission or a robot file describes."""
    return brick.rover(
        left=robot.left,
        right=robot.right,
        wheel_diameter_mm=robot.wheel_diameter_mm,
        axle_track_mm=robot.axle_track_mm,
        reversed=(robot.left_reversed, robot.right_reversed),
        wheel_mismatch_percent=robot.wheel_mismatch_percent,
        turn_slip_percent=robot.turn_slip_percent,
        ultrasonic=robot.ultrasonic or None,
        touch=robot.touch or None,
        compass=robot.compass or None,
        safety=SafetyLimits(stop_distance_mm=robot.stop_distance_mm),
    )


def build_body(brick: Brick, mission: Mission) -> MissionBody:
    """Return the robot that a mission describes, as the mission's port."""
    robot = mission.robot
    has = {"sonar": robot.ultrasonic, "bumper": robot.touch}
    return MissionBody(build_rover(brick, robot), [sensor for sensor, port in has.items() if port])


def build_detectors(mission: Mission) -> dict[str, TargetDetector]:
    """Return a detector for each target of a mission.

    Raises:
        ConfigError: A picture or a cascade cannot be used; one line for each such target.
    """
    targets = {name: mission.target[name] for name in mission.mission.targets}
    detectors, mistakes = make_detectors(targets, mission.color)
    if mistakes:
        raise ConfigError("\n  ".join(mistakes))
    return detectors


def detector_spec(target: Target, colors: Mapping[ColorName, ColorTable]) -> dict[str, object]:
    """Return the options of a target's detector; of a colour also how it looks, if the robot file says so."""
    shade = colors.get(target.color) if isinstance(target, ColorTarget) else None
    height_mm = {"height_mm": target.height_mm}  # also one that is guessed, which is in no dump
    return {**target.model_dump(exclude_none=True), **height_mm, **(shade.model_dump() if shade else {})}


def make_detectors(
    targets: Mapping[str, Target], colors: Mapping[ColorName, ColorTable]
) -> tuple[dict[str, TargetDetector], list[str]]:
    """Make a detector for each target; returns those that can be made, and a line for each that cannot."""
    from nxtdrive.vision.detectors import make_detector

    detectors, mistakes = {}, []
    for name, target in targets.items():
        try:
            detectors[name] = make_detector(detector_spec(target, colors))
        except ConfigError as error:
            mistakes.append(f"target.{name}: {error}")
    return detectors, mistakes


def default_camera(brick: Brick) -> str:
    """Return the camera of a robot for which none was named: the simulated one's own, else the first webcam."""
    return SIMULATED if _simulated_webcam(brick) is not None else FIRST_WEBCAM


def open_mission_camera(source: str, brick: Brick) -> Camera:
    """Open the camera of a mission.

    Args:
        source: As for `nxtdrive.vision.sources.open_camera`, or "geometric": the simulated robot's, for pictures only.
        brick: Its transport gives the time and, when simulated, the frames.

    Raises:
        CameraError: It cannot be opened.
    """
    from nxtdrive.vision.sources import open_camera, simulated_camera

    clock = MissionClock(brick)
    if source in (SIMULATED, GEOMETRIC):
        return simulated_camera(_simulated_webcam(brick), clock, brick.link.transport.address)
    return open_camera(source, clock=clock)


def watch(
    camera: Camera,
    brick: Brick,
    observer: Callable[[Frame], None],
    fps: float,
    wanted: Callable[[int], bool] = lambda _: True,
) -> None:
    """Call `observer` with the camera's frames, also between looks; a recording as camera has none then.

    Args:
        camera: As `open_mission_camera` gave it.
        brick: As given to it.
        observer: Called with frames in order of time; for a webcam, in a thread of its own.
        fps: Frames per second, for a simulated camera.
        wanted: Whether the simulated camera's frame of a number is needed; others are not rendered. Rendering draws
            the noise of later frames, so this must be the same in each run of a mission that looks at them.
    """
    from nxtdrive.vision.camera import Frame, SimulatedCamera
    from nxtdrive.vision.live import LiveCamera

    if isinstance(camera, LiveCamera):
        camera.on_frame(observer)
    elif isinstance(camera, SimulatedCamera) and isinstance(transport := recorded(brick.link.transport), SimTransport):
        number = -1

        def due() -> bool:
            nonlocal number
            number += 1
            return wanted(number)

        transport.on_frame(lambda image, time_s: observer(Frame(image, time_s, number)), fps, due)


def finds_by_geometry(brick: Brick, targets: Iterable[str]) -> bool:
    """Return whether the simulated world has pictures of all these names, which `geometric_eyes` can find."""
    frames = _simulated_webcam(brick)
    return frames is not None and frames.pictures.issuperset(targets)


def geometric_eyes(brick: Brick, mission: Mission, sensor: GeometricSensor | None = None) -> Eyes:
    """Return eyes of a simulated robot for the targets of a mission that skip rendering and detecting; for sweeps.

    Args:
        brick: A simulated one.
        mission: Its camera and the heights of its targets, as its file states them.
        sensor: Takes the place of the simulated camera's.

    Raises:
        CameraError: The brick is not simulated.
    """
    from nxtdrive.vision.eyes import GeometricEyes

    frames = sensor or _simulated_webcam(brick)
    if frames is None:
        raise CameraError("Geometric eyes need a simulated robot.", remedy="Use --nxt sim://.")
    heights_mm = {name: target.height_mm for name, target in mission.target.items()}
    return GeometricEyes(
        frames, MissionClock(brick), heights_mm, pinhole(frames.size, mission.camera), mission.camera.latency_s
    )


def camera_eyes(camera: Camera, mission: Mission) -> CameraEyes:
    """Return eyes for the targets of a mission."""
    from nxtdrive.vision.eyes import CameraEyes

    return CameraEyes(
        camera, build_detectors(mission), pinhole(camera.size, mission.camera), latency_s=mission.camera.latency_s
    )


def pinhole(size: tuple[int, int], camera: CameraTable) -> Pinhole:
    """Return a robot's camera for frames of a size, width and height in pixels."""
    from nxtdrive.vision.geometry import Mounting, Pinhole

    mounting = Mounting(camera.yaw_deg, camera.tilt_deg, camera.roll_deg)
    return Pinhole.from_hfov(size[0], camera.hfov_deg, mounting).resized(*size)


def _simulated_webcam(brick: Brick) -> Any:  # noqa: ANN401 - it serves both kinds of eyes
    transport = recorded(brick.link.transport)
    return transport.webcam if isinstance(transport, SimTransport) else None
