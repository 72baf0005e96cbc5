"""Everything a run leaves behind, kept while it runs and finished when it ends, however it ends."""

from __future__ import annotations

import threading
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import cv2

from behaviors.executive import Report
from behaviors.journal import Record
from behaviors.observers import Observers
from behaviors.ports import Sighting
from nxtdrive.recording.map_picture import draw_map
from nxtdrive.recording.run_folder import JOURNAL, MAP, SUMMARY, VIDEO, RunFolder
from nxtdrive.recording.video import VideoRecorder
from nxtdrive.vision.annotate import annotate

if TYPE_CHECKING:
    from nxtdrive.vision.camera import Frame
    from nxtdrive.vision.detection import Detection


class Recording:
    """A run's folder, map and video; hears records, looks and frames.

    Args:
        folder: Where everything goes.
        video: Whether to make the video.
    """

    def __init__(self, folder: RunFolder, *, video: bool = True) -> None:
        self.folder = folder
        self._video = VideoRecorder(folder.path / VIDEO) if video else None
        self._video_lock = threading.Lock()
        self._caption = ""

    def __call__(self, record: Record) -> None:
        """Hear of a record."""
        self.folder(record)
        self._caption = f"{record.state}  {record.target}  {record.time_s:.1f} s"

    def look(self, frame: Frame, _target: str, sighting: Sighting | None, found: Sequence[Detection]) -> None:
        """Hear of a look: the frame with what was seen in it."""
        self._show(frame, sighting, found, looked=True)

    def frame(self, frame: Frame) -> None:
        """Hear of a frame that nobody looked at, as while the robot waits; may come from the camera's thread."""
        self._show(frame, None, (), looked=False)

    def _show(self, frame: Frame, sighting: Sighting | None, found: Sequence[Detection], *, looked: bool) -> None:
        with self._video_lock:
            if self._video:
                drawn = annotate(frame.image, sighting, found, self._caption)
                # of the same moment, the frame with the boxes is the one to keep
                self._video.add(drawn, frame.time_s, instead=looked)

    def finish(self, report: Report | None, error: str, details: dict[str, object], observers: Observers) -> None:
        """Write summary and map and close the journal and the video; what fails does not keep the rest from being done.

        Args:
            report: What came of the mission; None when it broke.
            error: Why it broke, or an empty string.
            details: What else the summary tells.
            observers: Takes note of what fails, under the names of the files.
        """
        observers.attempt(JOURNAL, self.folder.close)
        observers.attempt(VIDEO, self._close_video)
        observers.attempt(MAP, self._write_map)
        observers.attempt(SUMMARY, self.folder.write_summary, report, error, {**details, **observers.summary()})

    def _write_map(self) -> None:
        path = self.folder.path / MAP
        if not cv2.imwrite(str(path), draw_map(self.folder.records)):
            raise OSError(f"{path} cannot be written")

    def _close_video(self) -> None:
        with self._video_lock:
            if self._video:
                self._video.close()
                self._video = None

    def files(self) -> list[Path]:
        """What there is in the folder."""
        return sorted(self.folder.path.iterdir())
