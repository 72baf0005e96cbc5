"""Implementations of `behaviors.ports.Vision`: a camera with detectors, and a simulated sensor without images."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from behaviors.ports import CameraLost, Clock, FloorRay, Glimpse, Pose, Sighting
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.vision.camera import Camera, EndOfFrames, Frame, ReplayCamera, frame_number, next_tick
from nxtdrive.vision.confirmation import Confirmation
from nxtdrive.vision.cut_off import Shape, marked
from nxtdrive.vision.detection import Detection, Quad, TargetDetector, box_of
from nxtdrive.vision.detectors.shared_frame import detect_each
from nxtdrive.vision.focus import detect_near
from nxtdrive.vision.frames import is_black
from nxtdrive.vision.free_floor import FreeFloorDetector
from nxtdrive.vision.frozen import FrozenFrames
from nxtdrive.vision.geometry import Pinhole
from nxtdrive.vision.visual_gyroscope import VisualGyroscope

READ_TIMEOUT_S = 3.0
"""Longest wait for a frame; a webcam that starts in the dark takes a second or two."""
GLANCE_TIMEOUT_S = 0.5
"""Longest wait of a glance for a frame; even in poor light a webcam gives five a second."""
BLACK = "the camera's frames are black. Open its shutter or take its cap off, and switch the light on."
FROZEN = "the camera hangs: it repeats the same frame while the robot moves. Pull its plug out and put it in again."

OnLook = Callable[[Frame, str, Sighting | None, Sequence[Detection]], None]
"""Called after each look: the frame, the target's name, the sighting and all detections in that frame."""


class NoFrame(CameraError, CameraLost):
    """No frame arrived in time, or it is black, or the same as before while the robot moves."""


class NoMoreFrames(NoFrame):
    """A recording is at its end."""

    permanent = True


class CameraVision:
    """Detectors on the frames of a camera; implements `behaviors.ports.Vision`.

    A confirmed target is searched for near its last place first, which takes about half of the time, then in the whole
    frame. It is always *detected*, never only tracked, so what has taken the place of a target is not taken for it.

    Args:
        camera: Source of the frames; the caller closes it.
        targets: Detector and size of each target, by name.
        pinhole: The camera's geometry.
        latency_s: Time from the exposure of a frame to its arrival; sightings have the time of exposure.
    """

    def __init__(
        self,
        camera: Camera,
        targets: Mapping[str, TargetDetector],
        pinhole: Pinhole,
        latency_s: float = 0.0,
    ) -> None:
        self._camera = camera
        self._targets = dict(targets)
        self._pinhole = pinhole
        self._latency_s = latency_s
        self._confirmations = {name: Confirmation() for name in targets}
        self._shapes = {name: Shape() for name in targets}
        self._floor = FreeFloorDetector()
        self._gyroscope = VisualGyroscope()
        self._frame: Frame | None = None
        self._frozen: FrozenFrames | None = None
        self._observers: list[OnLook] = []

    def on_look(self, observer: OnLook) -> None:
        """Call `observer` after each look, in the looking thread."""
        self._observers.append(observer)

    def watch_motion(self, pose: Callable[[], Pose]) -> None:
        """Take a camera that repeats its frame while the robot moves for one without frames; not a recording.

        Args:
            pose: Returns the robot's pose by the latest reading of its wheels.
        """
        if not isinstance(self._camera, ReplayCamera):
            self._frozen = FrozenFrames(pose, self._latency_s)

    def look(self, target: str) -> Sighting | None:
        """Return the sighting of `target` if it is confirmed in the next new frame.

        Raises:
            NoFrame: No frame came within `READ_TIMEOUT_S`, it is black, or the camera repeats it.
            ConfigError: There is no target of this name.
        """
        _check_known([target], self._targets)
        return self._look_for([target], self._next_frame(READ_TIMEOUT_S)).seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glimpse:
        """Return which of the targets are confirmed in the next new frame.

        Raises:
            NoFrame: No frame came within `GLANCE_TIMEOUT_S`, it is black, or the camera repeats it.
            ConfigError: There is no target of one of the names.
        """
        _check_known(targets, self._targets)
        frame = self._next_frame(GLANCE_TIMEOUT_S)
        height, width = frame.image.shape[:2]
        turned_deg = self._gyroscope.turned_deg(frame.image, self._pinhole.resized(width, height))
        return replace(self._look_for(targets, frame), turned_deg=turned_deg)

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        """Return how far the floor is free in the frame of the latest look; see `behaviors.ports.Vision`."""
        frame = self._frame
        if frame is None:
            return ()
        self._floor.keep(frame.image, frame.time_s - self._latency_s)
        if free_at_s is not None:
            self._floor.learn(free_at_s)
        if not self._floor.ready:
            return ()
        height, width = frame.image.shape[:2]
        return _floor_rays(self._floor.ends(frame.image), self._pinhole.resized(width, height))

    def _next_frame(self, timeout_s: float) -> Frame:
        try:
            frame = self._camera.read(timeout_s)
        except EndOfFrames as error:
            raise NoMoreFrames(str(error)) from error
        except CameraError as error:
            raise NoFrame(str(error)) from error
        if is_black(frame.image):
            raise NoFrame(BLACK)
        if self._frozen is not None and self._frozen.repeats(frame):
            raise NoFrame(FROZEN)
        self._frame = frame
        return frame

    def _look_for(self, targets: Sequence[str], frame: Frame) -> Glimpse:
        found = self._detect(frame, targets)
        sightings = {target: self._sighted(frame, target, found[target]) for target in targets}
        return _glimpse(frame.time_s - self._latency_s, sightings, self._confirmations)

    def _sighted(self, frame: Frame, target: str, found: Sequence[Detection]) -> Sighting | None:
        height, width = frame.image.shape[:2]
        pinhole, height_mm = self._pinhole.resized(width, height), self._targets[target].height_mm
        exposed_s, shape = frame.time_s - self._latency_s, self._shapes[target]
        found = [shape.completed(one) for one in found]
        located = [_sighting(target, one, pinhole, height_mm, exposed_s) for one in found]
        sighting = self._confirmations[target].update(exposed_s, located)
        if sighting is not None:
            shape.learn(sighting)
        for observer in self._observers:
            observer(frame, target, sighting, found)
        return sighting

    def _detect(self, frame: Frame, targets: Sequence[str]) -> dict[str, list[Detection]]:
        """Return all detections of each target: those near its last place if there are any, else in the whole frame."""
        near = {}
        for target in targets:
            track = self._confirmations[target].track(frame.time_s - self._latency_s)
            near[target] = detect_near(self._targets[target].detector, frame.image, track.box) if track else []
        missed = {target: self._targets[target].detector for target, found in near.items() if not found}
        height, width = frame.image.shape[:2]
        everywhere = detect_each(missed, frame.image)
        return near | {target: marked(found, width, height) for target, found in everywhere.items()}


class GeometricSensor(Protocol):
    """Computes a detector's results without an image; provided by a simulation.

    Attributes:
        fps: Frames per second of the camera it replaces.
        size: Width and height of its frames in pixels.
        detector_s: Computing time of the detectors per frame.
    """

    fps: float
    size: tuple[int, int]
    detector_s: float

    @property
    def unplugged(self) -> bool:
        """Whether the camera delivers no frames now."""
        ...

    @property
    def dropped(self) -> bool:
        """Whether the latest frame never arrives."""
        ...

    def observe(self, name: str) -> Quad | None:
        """Return the target's corners in this frame, or None."""
        ...

    def floor_ends(self) -> NDArray[np.float64]:
        """Return the pixels, (n, 2) columns and rows, at which the floor ends in this frame.

        See `nxtdrive.vision.free_floor.FreeFloorDetector.ends`.
        """
        ...

    def turned_deg(self) -> float | None:
        """Return how far the camera turned since the frame of the last call, as this frame shows it.

        See `nxtdrive.vision.visual_gyroscope.VisualGyroscope.turned_deg`.
        """
        ...


class GeometricVision:
    """Detections computed from geometry, for sweeps over many missions; implements `behaviors.ports.Vision`.

    Args:
        sensor: Computes a detector's results.
        clock: A look waits on it for the next frame, as a camera would.
        heights_mm: Real height of each target, by name.
        pinhole: The camera's geometry according to the mission.
        latency_s: Time from the exposure of a frame to its arrival, according to the mission.
    """

    def __init__(
        self,
        sensor: GeometricSensor,
        clock: Clock,
        heights_mm: Mapping[str, float],
        pinhole: Pinhole,
        latency_s: float = 0.0,
    ) -> None:
        self._sensor = sensor
        self._latency_s = latency_s
        self._clock = clock
        self._heights_mm = dict(heights_mm)
        self._pinhole = pinhole
        self._given = -1
        self._knows_floor = False
        self._confirmations: dict[str, Confirmation] = {}

    def look(self, target: str) -> Sighting | None:
        """Return the sighting of `target` if it is confirmed in the next new frame."""
        glimpse = self._look_for([target])
        self._compute()
        return glimpse.seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glimpse:
        """Return which of the targets are confirmed in the next new frame.

        Raises:
            NoFrame: The camera is unplugged.
            ConfigError: There is no target of one of the names.
        """
        glimpse = replace(self._look_for(targets), turned_deg=self._sensor.turned_deg())
        self._compute()
        return glimpse

    def _look_for(self, targets: Sequence[str]) -> Glimpse:
        _check_known(targets, self._heights_mm)
        self._await_frame()
        if self._sensor.unplugged:
            raise NoFrame("The simulated camera is unplugged.")
        time_s = self._given / self._sensor.fps - self._latency_s
        sightings = {target: self._look_at(target, time_s) for target in targets}
        return _glimpse(time_s, sightings, self._confirmations)

    def free_floor(self, free_at_s: float | None) -> Sequence[FloorRay]:
        """Return how far the floor is free in the frame of the latest look; see `behaviors.ports.Vision`."""
        self._knows_floor |= free_at_s is not None
        if not self._knows_floor or self._sensor.unplugged:
            return ()
        return _floor_rays(self._sensor.floor_ends(), self._pinhole)

    def _look_at(self, target: str, time_s: float) -> Sighting | None:
        quad = self._sensor.observe(target)
        located = []
        if quad is not None:
            found = Detection(box_of(quad), 1.0, quad)
            located.append(_sighting(target, found, self._pinhole, self._heights_mm[target], time_s))
        return self._confirmations.setdefault(target, Confirmation()).update(time_s, located)

    def _compute(self) -> None:
        """Let the time pass that the detectors need for a frame."""
        if self._sensor.detector_s:
            self._clock.sleep(self._sensor.detector_s)

    def _await_frame(self) -> None:
        """Wait as a camera does: for the latest frame, or the next one if that was used before or never arrives."""
        while (number := frame_number(self._clock.now(), self._sensor.fps)) <= self._given or self._sensor.dropped:
            now_s = self._clock.now()
            self._clock.sleep(next_tick(now_s, self._sensor.fps) - now_s)
        self._given = number


def _glimpse(
    time_s: float, sightings: Mapping[str, Sighting | None], confirmations: Mapping[str, Confirmation]
) -> Glimpse:
    seen = {target: sighting for target, sighting in sightings.items() if sighting is not None}
    return Glimpse(time_s, seen, frozenset(target for target in sightings if confirmations[target].awaited))


def _sighting(target: str, found: Detection, pinhole: Pinhole, height_mm: float, time_s: float) -> Sighting:
    confidence = min(1.0, max(0.0, found.score)) if math.isfinite(found.score) else 0.0
    place = pinhole.locate(found, height_mm)
    edges_mm = None if found.bound else pinhole.edges_mm(found, height_mm)
    return Sighting(
        target, *place, confidence, time_s, found.box, found.cut, found.bound, edges_mm, _lower_deg(found, pinhole)
    )


def _lower_deg(found: Detection, pinhole: Pinhole) -> float:
    left, top, width, height = found.box
    bottom = min(top + height, pinhole.width * pinhole.aspect)
    _, below_deg = pinhole.directions(np.array([left + width / 2]), np.array([bottom]))
    return float(below_deg[0])


def _floor_rays(ends: NDArray[np.float64], pinhole: Pinhole) -> list[FloorRay]:
    """Return the rays of the pixels at which the floor ends, (n, 2), except where it goes on beyond the frame."""
    u, v = ends.T
    bearing_deg, end_deg = pinhole.directions(u, v)
    _, near_deg = pinhole.directions(u, np.full(len(u), pinhole.width * pinhole.aspect))
    angles = np.stack([bearing_deg, near_deg, end_deg], axis=1)
    return [FloorRay(*each) for each in angles[(v > 0.0) | (end_deg <= 0.0)].tolist()]


def _check_known(targets: Sequence[str], known: Mapping[str, object]) -> None:
    for target in targets:
        if target not in known:
            names = ", ".join(sorted(known)) or "none"
            raise ConfigError(f"there is no target {target!r}.", remedy=f"There are: {names}.")
