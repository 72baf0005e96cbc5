"""Puts a mission, a robot and a camera together.

The mind (`behaviors`) knows only ports; here they are filled: a `Rover` as its body, detectors on a camera as its eyes,
the transport's clock as its clock.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import resources
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.mission import BUILT_IN, Mission, MissionError, load_mission
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.motion.obstacle_monitor import SafetyLimits
from nxtdrive.transports.record import recorded
from nxtdrive.transports.sim import SimTransport

if TYPE_CHECKING:
    from behaviors.ports import Eyes
    from nxtdrive.brick import Brick
    from nxtdrive.motion.rover import Rover
    from nxtdrive.vision.camera import Camera, Frame
    from nxtdrive.vision.detection import TargetDetector
    from nxtdrive.vision.eyes import CameraEyes

SIMULATED, GEOMETRIC, FIRST_WEBCAM = "sim", "geometric", "0"
"""Cameras by name: the simulated robot's, the same robot's eyes without pictures, the first webcam."""

PICTURES = Path(str(resources.files("sim_backend"))) / "pictures"
"""The built-in pictures; a mission may name them without having them."""


def load(path: Path | None) -> Mission:
    """Read a mission; the built-in one without a path.

    Raises:
        ConfigError: The file has mistakes; the message lists all of them.
    """
    try:
        return load_mission(path or BUILT_IN, [PICTURES])
    except MissionError as error:
        raise ConfigError(str(error)) from None


def build_rover(brick: Brick, mission: Mission) -> Rover:
    """The robot a mission describes."""
    robot = mission.robot
    return brick.rover(
        left=robot.left,
        right=robot.right,
        wheel_diameter_mm=robot.wheel_diameter_mm,
        axle_track_mm=robot.axle_track_mm,
        ultrasonic=robot.ultrasonic or None,
        touch=robot.touch or None,
        compass=robot.compass or None,
        safety=SafetyLimits(stop_distance_mm=robot.stop_distance_mm),
    )


def build_detectors(mission: Mission) -> dict[str, TargetDetector]:
    """A detector for each target of a mission.

    Raises:
        ConfigError: A picture or a cascade cannot be used; a line for each target that is concerned.
    """
    from nxtdrive.vision.detectors import make_detector

    detectors, mistakes = {}, []
    for name in dict.fromkeys(mission.mission.targets):
        try:
            detectors[name] = make_detector(mission.target[name].model_dump())
        except ConfigError as error:
            mistakes.append(f"target.{name}: {error}")
    if mistakes:
        raise ConfigError("\n".join(mistakes))
    return detectors


def default_camera(brick: Brick) -> str:
    """Which camera a brick's robot carries when nobody says: the simulated one's own, else the first webcam."""
    return SIMULATED if _simulated_webcam(brick) is not None else FIRST_WEBCAM


def open_mission_camera(source: str, brick: Brick) -> Camera:
    """Open the camera of a mission.

    Args:
        source: ``sim``, or whatever `nxtdrive.vision.sources.open_camera` takes.
        brick: Its transport gives the time and, when simulated, the frames.

    Raises:
        CameraError: It cannot be opened.
    """
    if source != SIMULATED:
        from nxtdrive.vision.sources import open_camera

        return open_camera(source, clock=brick)
    from nxtdrive.vision.camera import SimulatedCamera

    frames = _simulated_webcam(brick)
    if frames is None:
        raise CameraError(
            f"{brick.link.transport.address} has no simulated camera.",
            remedy="Name a camera: --camera 0 is the first webcam; `nxtdrive sim serve` prints its camera's URL.",
        )
    return SimulatedCamera(frames, brick, frames.size)


def watch(camera: Camera, brick: Brick, observer: Callable[[Frame], None], fps: float) -> None:
    """Have `observer` see what the camera sees also while nobody looks; recordings have nothing to show then.

    Args:
        camera: As `open_mission_camera` gave it.
        brick: As given to it.
        observer: Called with frames in the order of time, for a webcam in a thread of its own.
        fps: How often, where that can be chosen.
    """
    from nxtdrive.vision.camera import Frame, SimulatedCamera
    from nxtdrive.vision.live import LiveCamera

    if isinstance(camera, LiveCamera):
        camera.on_frame(observer)
    elif isinstance(camera, SimulatedCamera) and isinstance(transport := recorded(brick.link.transport), SimTransport):
        numbers = count()
        transport.on_frame(lambda image, time_s: observer(Frame(image, time_s, next(numbers))), fps)


def geometric_eyes(brick: Brick) -> Eyes:
    """Eyes of a simulated robot that skip rendering and detecting; for sweeps.

    Raises:
        CameraError: The brick is not simulated.
    """
    from nxtdrive.vision.eyes import GeometricEyes

    frames = _simulated_webcam(brick)
    if frames is None:
        raise CameraError("Geometric eyes need a simulated robot.", remedy="Use --nxt sim://.")
    return GeometricEyes(frames, brick)


def camera_eyes(camera: Camera, mission: Mission) -> CameraEyes:
    """Eyes over a camera for the targets of a mission."""
    from nxtdrive.vision.eyes import CameraEyes
    from nxtdrive.vision.geometry import Pinhole

    pinhole = Pinhole.from_hfov(camera.size[0], mission.camera.hfov_deg)
    return CameraEyes(camera, build_detectors(mission), pinhole)


def _simulated_webcam(brick: Brick) -> Any:  # noqa: ANN401 - it serves both kinds of eyes
    transport = recorded(brick.link.transport)
    return transport.webcam if isinstance(transport, SimTransport) else None
