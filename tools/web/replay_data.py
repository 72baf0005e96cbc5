"""The data for the replay of a run, as plain values; the same for the server and for an exported page."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nxtdrive.recording.camera_index import RecordedFrame, RecordedFrames
from nxtdrive.recording.explanation import explain
from nxtdrive.recording.progress_lines import lines_of
from nxtdrive.recording.run_reader import PastRun

from .chart import chart, recoveries
from .decisions import explained
from .robot_shape import robot_shape


def replay_data(
    name: str, run: PastRun, camera: RecordedFrames | None, source: Callable[[RecordedFrame], str]
) -> dict[str, Any]:
    """Return a run for its replay.

    Args:
        name: Of its folder.
        run: The run.
        camera: Its frames, if it has any.
        source: Returns the URL of a frame.
    """
    frames, explanation = camera.frames if camera else (), explain(run)
    hints = [(run.records[-1].time_s, f"hint: {hint}") for hint in run.hints]
    return {
        "name": name,
        "mission": run.name,
        "profile": explanation.profile,
        "robot": robot_shape(run.mission),
        "chart": chart(),
        "recoveries": recoveries(),
        "records": [record.values() for record in run.records],
        "lines": [{"t": time_s, "text": text} for time_s, text in (*lines_of(run.records), *hints)],
        "decisions": explained(explanation),
        "pictures": [
            {"t": each.t, "src": source(each), "looks": [look.model_dump(mode="json") for look in each.looks]}
            for each in frames
        ],
    }
