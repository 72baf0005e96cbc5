"""The record of a run, kept while it runs and completed when it ends, however it ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.executive import Report
from behaviors.journal import Record, RecordKind
from behaviors.observers import Observers
from behaviors.ports import Clock, Sighting
from nxtdrive.drawing.sheet import encoded
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import Look, looked, read_frames
from nxtdrive.recording.map.map_drawing import draw_map
from nxtdrive.recording.map.scene import Line
from nxtdrive.recording.output_file import write_file
from nxtdrive.recording.run_folder import CAMERA, JOURNAL, MAP, SUMMARY, VIDEO, RunFolder
from nxtdrive.recording.video import Follow, write_webm

if TYPE_CHECKING:
    from nxtdrive.vision.camera import Frame
    from nxtdrive.vision.detection import Detection


class Recording:
    """A run folder with map, frames and video; receives records, looks and frames.

    Args:
        folder: The folder to write to.
        clock: The mission's and the frames' clock.
        video: Whether to keep the camera's frames.
        room: Returns the true room of a simulated run, for the map; called now and at the end.

    Attributes:
        folder: As given.
    """

    def __init__(
        self,
        folder: RunFolder,
        clock: Clock,
        *,
        video: bool = True,
        room: Callable[[], Sequence[Line]] | None = None,
    ) -> None:
        self.folder = folder
        self._clock = clock
        self._start_s: float | None = None
        self._room = room or tuple
        self._room_at_start = self._room()
        self._camera = CameraFolder(folder.path / CAMERA) if video else None
        self._camera_lock = threading.Lock()

    def __call__(self, record: Record) -> None:
        """Write a record into the journal."""
        self.folder(record)
        if record.kind is RecordKind.START:
            self._start_s = self._clock.now() - record.time_s

    def look(self, frame: Frame, target: str, sighting: Sighting | None, found: Sequence[Detection]) -> None:
        """Keep a frame, with the result of a look at it."""
        self._keep(frame, looked(target, sighting, found))

    def frame(self, frame: Frame) -> None:
        """Keep a frame that no look used, as while the robot waits; may be called from the camera's thread."""
        self._keep(frame, None)

    def _keep(self, frame: Frame, look: Look | None) -> None:
        start_s = self._start_s
        if start_s is None or frame.time_s < start_s:
            return
        with self._camera_lock:
            if self._camera:
                self._camera.add(frame.image, frame.time_s - start_s, look)

    def finish(self, report: Report | None, error: str, details: dict[str, object], observers: Observers) -> None:
        """Close journal and frames, draw the map and write the summary; each step is tried even if another fails.

        Args:
            report: The mission's result; None when it broke.
            error: Why it broke, or an empty string.
            details: Further entries of the summary.
            observers: Collects failures, under the names of the files.
        """
        observers.attempt(JOURNAL, self.folder.close)
        observers.attempt(CAMERA, self._close_camera)
        observers.attempt(MAP, self._write_map)
        observers.attempt(SUMMARY, self.folder.write_summary, report, error, {**details, **observers.summary()})

    def _write_map(self) -> None:
        drawn = draw_map(self.folder.records, self.folder.mission, self._room_at_start, self._room())
        path = self.folder.path / MAP
        write_file(path, encoded(drawn, path))

    def _close_camera(self) -> None:
        with self._camera_lock:
            camera, self._camera = self._camera, None
            if camera:
                camera.close()

    def write_video(self, follow: Follow) -> None:
        """Write the video from the frames, if there are any; after `finish`, when the robot is at rest.

        Args:
            follow: Passes the frames on, such as to show progress.

        Raises:
            ConfigError: The file cannot be written.
            OSError: There is no room for it.
        """
        if frames := read_frames(self.folder.path):
            write_webm(frames, self.folder.records, self.folder.path / VIDEO, follow)

    def files(self) -> list[Path]:
        """Return what is in the folder."""
        return sorted(self.folder.path.glob("*"))
