"""Make the vision of a mission: its camera with the detectors of its targets, or geometric vision."""

from __future__ import annotations

from typing import TYPE_CHECKING

from behaviors.mission import Mission
from firmware_protocol.errors import CameraError
from nxtdrive.mission.body import MissionClock
from nxtdrive.mission.camera import GEOMETRIC, simulated_webcam
from nxtdrive.mission.detectors import build_detectors

if TYPE_CHECKING:
    from behaviors.mission.robot import CameraTable
    from behaviors.ports import Vision
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Camera
    from nxtdrive.vision.geometry import Pinhole
    from nxtdrive.vision.target_vision import CameraVision, GeometricSensor


def mission_vision(
    mission: Mission, brick: Brick, camera: Camera, source: str, sensor: GeometricSensor | None = None
) -> Vision:
    """Return the vision for the targets of a mission.

    With the camera "geometric" they look at no frames, unless the world has no picture of a target's name.

    Args:
        mission: The mission.
        brick: The robot's.
        camera: The robot's.
        source: The camera's, as for `nxtdrive.mission.camera.open_mission_camera`.
        sensor: Geometric vision uses it in any case, in place of the simulated camera.

    Raises:
        ConfigError: A target's picture cannot be used.
    """
    if sensor or (source == GEOMETRIC and _has_pictures(brick, mission)):
        return geometric_vision(brick, mission, sensor)
    return camera_vision(camera, mission)


def _has_pictures(brick: Brick, mission: Mission) -> bool:
    """Return whether the simulated world has a picture of the name of each target."""
    frames = simulated_webcam(brick)
    return frames is not None and frames.pictures.issuperset(mission.mission.targets)


def geometric_vision(brick: Brick, mission: Mission, sensor: GeometricSensor | None = None) -> Vision:
    """Return the vision of a simulated robot that skips rendering and detection; for sweeps.

    Args:
        brick: A simulated one.
        mission: Its camera and the heights of its targets, as its file states them.
        sensor: Takes the place of the simulated camera's.

    Raises:
        CameraError: The brick is not simulated.
    """
    from nxtdrive.vision.target_vision import GeometricVision

    frames = sensor or simulated_webcam(brick)
    if frames is None:
        raise CameraError("geometric vision needs a simulated robot.", remedy="Use --nxt sim://.")
    heights_mm = {name: target.height_mm for name, target in mission.target.items()}
    return GeometricVision(
        frames, MissionClock(brick), heights_mm, pinhole(frames.size, mission.camera), mission.camera.latency_s
    )


def camera_vision(camera: Camera, mission: Mission) -> CameraVision:
    """Return the vision of a robot with a camera for the targets of a mission."""
    from nxtdrive.vision.target_vision import CameraVision

    return CameraVision(
        camera, build_detectors(mission), pinhole(camera.size, mission.camera), mission.camera.latency_s
    )


def pinhole(size: tuple[int, int], camera: CameraTable) -> Pinhole:
    """Return a robot's camera for frames of a size, width and height in pixels."""
    from nxtdrive.vision.geometry import Mounting, Pinhole

    mounting = Mounting(camera.yaw_deg, camera.tilt_deg, camera.roll_deg)
    return Pinhole.from_hfov(size[0], camera.hfov_deg, mounting).resized(*size)
