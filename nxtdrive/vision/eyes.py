"""Implementations of `behaviors.ports.Eyes`: a camera with detectors, and a geometric sensor of the simulation."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from behaviors.ports import Blind, Clock, Glance, Sighting
from firmware_protocol.errors import CameraError, ConfigError
from nxtdrive.vision.camera import Camera, EndOfFrames, Frame, frame_number, next_tick
from nxtdrive.vision.confirm import Confirmation, Seen
from nxtdrive.vision.detection import Box, Detection, TargetDetector
from nxtdrive.vision.focus import detect_near
from nxtdrive.vision.geometry import Pinhole

READ_TIMEOUT_S = 3.0
"""Longest wait for a frame; a webcam that starts up in the dark takes a second or two."""
GLANCE_TIMEOUT_S = 0.5
"""Longest wait of a glance for a frame; even in poor light a webcam gives five a second."""

OnLook = Callable[[Frame, str, Sighting | None, Sequence[Detection]], None]
"""Called after each look: the frame, the target's name, the sighting and all detections in that frame."""

MakeConfirmation = Callable[[], Confirmation]


class NoPicture(CameraError, Blind):
    """No frame came in time."""


class NoMorePictures(NoPicture):
    """A recording is at its end."""

    permanent = True


class CameraEyes:
    """Eyes over a camera; implements `behaviors.ports.Eyes`.

    A confirmed target is searched near its last place first, which takes a fifth of the time, then in the whole frame.
    It is always *detected*, never only tracked, so a target that leaves is not hallucinated.

    Args:
        camera: Where the frames come from; the caller closes it.
        targets: The detector and size of each target, by name.
        pinhole: The camera's geometry; by default that of a common webcam.
        timeout_s: Longest wait of a look for a frame.
        confirmation: Makes the rule that confirms one target.
    """

    def __init__(
        self,
        camera: Camera,
        targets: Mapping[str, TargetDetector],
        pinhole: Pinhole | None = None,
        *,
        timeout_s: float = READ_TIMEOUT_S,
        confirmation: MakeConfirmation = Confirmation,
    ) -> None:
        self._camera = camera
        self._targets = dict(targets)
        self._pinhole = pinhole or Pinhole.from_hfov(640)
        self._timeout_s = timeout_s
        self._confirmations = {name: confirmation() for name in targets}
        self._observers: list[OnLook] = []

    def on_look(self, observer: OnLook) -> None:
        """Call `observer` after each look, in the thread that looks."""
        self._observers.append(observer)

    def look(self, target: str) -> Sighting | None:
        """Take the next fresh frame and say whether `target` is confirmed in it; raises as `glance` does."""
        return self._look_for([target], self._timeout_s).seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glance:
        """Take the next fresh frame and say which of the targets are confirmed in it.

        Raises:
            NoPicture: no frame came within `GLANCE_TIMEOUT_S`, or the shorter time these eyes wait.
            ConfigError: there is no target of one of the names.
        """
        return self._look_for(targets, min(GLANCE_TIMEOUT_S, self._timeout_s))

    def _look_for(self, targets: Sequence[str], timeout_s: float) -> Glance:
        for target in targets:
            if target not in self._targets:
                raise ConfigError(f"The eyes know no target {target!r}.", remedy=f"They know: {_list(self._targets)}.")
        try:
            frame = self._camera.read(timeout_s)
        except EndOfFrames as error:
            raise NoMorePictures(str(error)) from error
        except CameraError as error:
            raise NoPicture(str(error)) from error
        sightings = {target: self._look_at(frame, target) for target in targets}
        return _glance(frame.time_s, sightings)

    def _look_at(self, frame: Frame, target: str) -> Sighting | None:
        seen = self._see(frame, target)
        confirmed = self._confirmations[target].update(frame.time_s, seen)
        sighting = None if confirmed is None else _sighting(target, confirmed, frame.time_s)
        for observer in self._observers:
            observer(frame, target, sighting, [one.detection for one in seen])
        return sighting

    def _see(self, frame: Frame, target: str) -> list[Seen]:
        kind = self._targets[target]
        track = self._confirmations[target].track(frame.time_s)
        found = detect_near(kind.detector, frame.image, track.detection.box) if track else []
        pinhole = self._pinhole.resized(frame.image.shape[1])
        return [
            Seen(detection, *pinhole.locate(detection, kind.height_mm))
            for detection in found or kind.detector.detect(frame.image)
        ]


class GeometricSensor(Protocol):
    """Reports what a detector would see, without a picture; a simulation offers it.

    Attributes:
        fps: Frames per second of the camera it stands for.
    """

    fps: float

    @property
    def unplugged(self) -> bool:
        """Whether the camera gives no picture now."""
        ...

    def observe(self, name: str) -> tuple[float, float, Box] | None:
        """Bearing in degrees (positive right), distance in millimetres and box of the target in this frame, or None."""
        ...


class GeometricEyes:
    """Eyes by geometry alone, for sweeps over many missions; implements `behaviors.ports.Eyes`.

    Args:
        sensor: Reports what a detector would see.
        clock: A look waits on it for a fresh frame, as with a camera.
        confirmation: Makes the rule that confirms one target.
    """

    def __init__(self, sensor: GeometricSensor, clock: Clock, *, confirmation: MakeConfirmation = Confirmation) -> None:
        self._sensor = sensor
        self._clock = clock
        self._make = confirmation
        self._given = -1
        self._confirmations: dict[str, Confirmation] = {}

    def look(self, target: str) -> Sighting | None:
        """Take the next fresh frame and say whether `target` is confirmed in it."""
        return self.glance([target]).seen.get(target)

    def glance(self, targets: Sequence[str]) -> Glance:
        """Take the next fresh frame and say which of the targets are confirmed in it.

        Raises:
            NoPicture: the camera is unplugged.
        """
        self._await_frame()
        if self._sensor.unplugged:
            raise NoPicture("The simulated camera is unplugged.")
        time_s = self._given / self._sensor.fps
        return _glance(time_s, {target: self._look_at(target, time_s) for target in targets})

    def _look_at(self, target: str, time_s: float) -> Sighting | None:
        observed = self._sensor.observe(target)
        seen = []
        if observed is not None:
            bearing_deg, distance_mm, box = observed
            seen.append(Seen(Detection(box, 1.0), bearing_deg, distance_mm))
        confirmation = self._confirmations.setdefault(target, self._make())
        confirmed = confirmation.update(time_s, seen)
        return None if confirmed is None else _sighting(target, confirmed, time_s)

    def _await_frame(self) -> None:
        """Take the freshest frame, or the next one if that was used before, as a camera does."""
        while (number := frame_number(self._clock.now(), self._sensor.fps)) <= self._given:
            now_s = self._clock.now()
            self._clock.sleep(next_tick(now_s, self._sensor.fps) - now_s)
        self._given = number


def _glance(time_s: float, sightings: Mapping[str, Sighting | None]) -> Glance:
    seen = {target: sighting for target, sighting in sightings.items() if sighting is not None}
    return Glance(time_s, seen)


def _sighting(target: str, seen: Seen, time_s: float) -> Sighting:
    score = seen.detection.score
    confidence = min(1.0, max(0.0, score)) if math.isfinite(score) else 0.0
    return Sighting(target, seen.bearing_deg, seen.distance_mm, confidence, time_s, seen.detection.box)


def _list(names: Mapping[str, object]) -> str:
    return ", ".join(sorted(names)) or "none"
