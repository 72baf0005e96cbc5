"""Open the camera of a mission, and watch its frames."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nxtdrive.mission.body import MissionClock
from nxtdrive.transports.sim import simulated

if TYPE_CHECKING:
    from nxtdrive.brick import Brick
    from nxtdrive.vision.camera import Camera, Frame

SIMULATED, GEOMETRIC, FIRST_WEBCAM = "sim", "geometric", "0"
"""Cameras by name: the simulated robot's, the same without frames, and the first webcam."""


def default_camera(brick: Brick) -> str:
    """Return the default camera of a robot: the simulated robot's own, else the first webcam."""
    return SIMULATED if simulated_webcam(brick) is not None else FIRST_WEBCAM


def open_mission_camera(source: str, brick: Brick) -> Camera:
    """Open the camera of a mission.

    Args:
        source: As for `nxtdrive.vision.sources.open_camera`, or "geometric": the simulated robot's, to record the run.
        brick: Its transport gives the time and, when simulated, the frames.

    Raises:
        CameraError: It cannot be opened.
    """
    from nxtdrive.vision.sources import open_camera, simulated_camera

    clock = MissionClock(brick)
    if source in (SIMULATED, GEOMETRIC):
        return simulated_camera(simulated_webcam(brick), clock, brick.link.transport.address)
    return open_camera(source, clock=clock)


def watch_frames(
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
    elif isinstance(camera, SimulatedCamera) and (transport := simulated(brick.link.transport)):
        number = -1

        def due() -> bool:
            nonlocal number
            number += 1
            return wanted(number)

        transport.on_frame(lambda image, time_s: observer(Frame(image, time_s, number)), fps, due)


def simulated_webcam(brick: Brick) -> Any:  # noqa: ANN401 - both kinds of vision use it
    """Return the webcam of a simulated brick's robot; None for any other brick."""
    transport = simulated(brick.link.transport)
    return transport.webcam if transport else None
