"""The record of a run, kept while it runs and completed when it ends, however it ends."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from behaviors.executive import Report
from behaviors.journal import Record
from behaviors.observers import Observers
from behaviors.ports import Sighting
from nxtdrive.drawing.sheet import encoded
from nxtdrive.recording.map_picture import draw_map
from nxtdrive.recording.map_scene import Line
from nxtdrive.recording.output_file import write_file
from nxtdrive.recording.run_folder import JOURNAL, MAP, SUMMARY, VIDEO, RunFolder
from nxtdrive.recording.video import VideoRecorder
from nxtdrive.vision.annotate import annotate

if TYPE_CHECKING:
    from nxtdrive.vision.camera import Frame
    from nxtdrive.vision.detection import Detection


class Recording:
    """A run's folder, map and video; receives records, looks and frames.

    Args:
        folder: The folder to write to.
        video: Whether to make the video.
        room: Returns the true room of a simulated run, for the map; called now and at the end.
    """

    def __init__(
        self, folder: RunFolder, *, video: bool = True, room: Callable[[], Sequence[Line]] | None = None
    ) -> None:
        self.folder = folder
        self._room = room or tuple
        self._room_at_start = self._room()
        self._video = VideoRecorder(folder.path / VIDEO) if video else None
        self._video_lock = threading.Lock()
        self._caption = ""

    def __call__(self, record: Record) -> None:
        """Write a record into the journal."""
        self.folder(record)
        self._caption = f"{record.state}  {record.target}  {record.time_s:.1f} s"

    def look(self, frame: Frame, _target: str, sighting: Sighting | None, found: Sequence[Detection]) -> None:
        """Add a frame to the video, with what a look found in it."""
        self._show(frame, sighting, found, looked=True)

    def frame(self, frame: Frame) -> None:
        """Add a frame that no look used, as while the robot waits; may be called from the camera's thread."""
        self._show(frame, None, (), looked=False)

    def _show(self, frame: Frame, sighting: Sighting | None, found: Sequence[Detection], *, looked: bool) -> None:
        with self._video_lock:
            if self._video:
                drawn = annotate(frame.image, sighting, found, self._caption)
                # of two frames of the same moment, keep the one with the boxes
                self._video.add(drawn, frame.time_s, instead=looked)

    def finish(self, report: Report | None, error: str, details: dict[str, object], observers: Observers) -> None:
        """Close journal and video, draw the map and write the summary; each step is tried even if another fails.

        Args:
            report: The mission's result; None when it broke.
            error: Why it broke, or an empty string.
            details: Further entries of the summary.
            observers: Collects failures, under the names of the files.
        """
        observers.attempt(JOURNAL, self.folder.close)
        observers.attempt(VIDEO, self._close_video)
        observers.attempt(MAP, self._write_map)
        observers.attempt(SUMMARY, self.folder.write_summary, report, error, {**details, **observers.summary()})

    def _write_map(self) -> None:
        drawn = draw_map(self.folder.records, self.folder.mission, self._room_at_start, self._room())
        path = self.folder.path / MAP
        write_file(path, encoded(drawn, path))

    def _close_video(self) -> None:
        with self._video_lock:
            if self._video:
                self._video.close()
                self._video = None

    def files(self) -> list[Path]:
        """Return the files in the folder."""
        return sorted(self.folder.path.glob("*"))
