"""Write a run as an MCAP file, which robotics programs such as Lichtblick and Foxglove show.

Metres and radians as in ROS: x forward, y to the left, angles anticlockwise.
"""

from __future__ import annotations

import base64
import heapq
import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from behaviors.journal import Record, RecordKind
from behaviors.mission.robot import RobotTable
from input_files.plain import InputFileError, is_number, read_bytes
from nxtdrive.host.environment import require
from nxtdrive.recording.camera_index import MAX_FRAME_BYTES, RecordedFrame, RecordedFrames, sighting_of
from nxtdrive.recording.map.scene import pose_of
from nxtdrive.recording.mcap_schemas import SCHEMAS, TOPICS
from nxtdrive.recording.output_file import check_replaceable, draft_path
from nxtdrive.recording.progress_lines import lines_of
from nxtdrive.recording.run_reader import PastRun
from nxtdrive.recording.wording import state_words
from nxtdrive.vision.annotate import caption

if TYPE_CHECKING:
    from mcap.writer import Writer

MAP, ROBOT, CAMERA = "map", "robot", "camera"
"""Frames of reference: the robot's start, the robot, the camera's image."""
INFO, WARNING = 2, 3
"""Levels of a log."""
LINE_LOOP = 2
"""Type of an annotation's points."""
SEEN = {"r": 0.2, "g": 0.9, "b": 0.3, "a": 1.0}
FOUND = {"r": 1.0, "g": 0.75, "b": 0.0, "a": 1.0}
TEXT = {"r": 1.0, "g": 1.0, "b": 1.0, "a": 1.0}
SHADE = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.6}


@dataclass(frozen=True, slots=True)
class Message:
    """A message.

    Attributes:
        time_s: Mission time.
        topic: One of `TOPICS`.
        values: As its schema says, besides the time.
    """

    time_s: float
    topic: str
    values: dict[str, Any]

    @property
    def time_ns(self) -> int:
        """Mission time in nanoseconds."""
        return round(self.time_s * 1e9)


def write_mcap(run: PastRun, camera: RecordedFrames | None, path: Path) -> int:
    """Write a run; the file appears when it is complete.

    Args:
        run: Its journal and mission.
        camera: The frames; those that cannot be read are left out.
        path: The file to write.

    Returns:
        The number of messages.

    Raises:
        ConfigError: The library is not installed.
        OSError: It cannot be written, or is not a regular file.
    """
    require("mcap", "mcap", what="an MCAP file")
    from mcap.writer import Writer

    robot = run.mission.robot if run.mission else RobotTable()
    made = (each for record in run.records for each in _of_record(record, robot))
    recorded = sorted(made, key=lambda each: each.time_s)
    logged = [Message(time_s, "/log", _log(INFO, text)) for time_s, text in lines_of(run.records)]
    seen = (each for frame in camera.frames for each in _of_frame(camera, frame)) if camera else ()
    check_replaceable(path)
    part = draft_path(path, path.suffix)
    count = 0
    try:
        with open(part, "wb") as file:
            writer = Writer(file)
            writer.start(library="nxtdrive")
            channels = _channels(writer)
            for message in heapq.merge(recorded, logged, seen, key=lambda each: each.time_s):
                data = json.dumps({"timestamp": _stamp(message), **message.values}).encode()
                writer.add_message(channels[message.topic], message.time_ns, data, message.time_ns)
                count += 1
            writer.finish()  # type: ignore[no-untyped-call]
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)
    return count


def _channels(writer: Writer) -> dict[str, int]:
    """Declare all topics and return their numbers."""
    schemas = {
        name: writer.register_schema(name, "jsonschema", json.dumps({"title": name, **schema}).encode())
        for name, schema in SCHEMAS.items()
    }
    return {topic: writer.register_channel(topic, "json", schemas[name]) for topic, name in TOPICS.items()}


def _stamp(message: Message) -> dict[str, int]:
    seconds, nanoseconds = divmod(message.time_ns, 10**9)
    return {"sec": seconds, "nsec": nanoseconds}


def _of_record(record: Record, robot: RobotTable) -> Iterator[Message]:
    """Yield the messages of a record; values of an unknown form are left out."""
    now_s, data = record.time_s, record.data
    yield Message(now_s, "/state", {"state": record.state, "target": record.target})
    if pose := pose_of(record):
        place = _pose(pose.x_mm / 1000, -pose.y_mm / 1000, -math.radians(pose.heading_deg))
        yield Message(now_s, "/pose", {"frame_id": MAP, "pose": place})
        frames = {"parent_frame_id": MAP, "child_frame_id": ROBOT}
        moved = {"translation": place["position"], "rotation": place["orientation"]}
        yield Message(now_s, "/tf", {**frames, **moved})
    if "range_mm" in data:
        ranges = [range_mm / 1000] if is_number(range_mm := data["range_mm"]) else []
        beam = {"start_angle": 0.0, "end_angle": 0.0, "ranges": ranges, "intensities": []}
        yield Message(
            now_s, "/sonar", {"frame_id": ROBOT, "pose": _pose(robot.sonar_forward_mm / 1000, 0.0, 0.0), **beam}
        )
    if is_number(battery_mv := data.get("battery_mv")):
        yield Message(now_s, "/battery", {"voltage": battery_mv / 1000})
    if record.kind is RecordKind.CHOICE:
        choice = state_words(str(data.get("choice", "")))
        yield Message(now_s, "/decisions", _log(WARNING, f"{record.target}: {choice}, since {data.get('why', '')}"))


def _of_frame(camera: RecordedFrames, frame: RecordedFrame) -> Iterator[Message]:
    """Yield a frame, and the boxes in it; also none, which remove those of the frame before."""
    try:
        jpeg = read_bytes(camera.folder / frame.file, MAX_FRAME_BYTES)
    except InputFileError:
        return
    image = {"frame_id": CAMERA, "format": "jpeg", "data": base64.b64encode(jpeg).decode("ascii")}
    yield Message(frame.t, "/camera", image)
    yield Message(frame.t, "/camera/boxes", _boxes(frame))


def _boxes(frame: RecordedFrame) -> dict[str, Any]:
    stamp = _stamp(Message(frame.t, "", {}))
    points, texts = [], []
    for look in frame.looks:
        seen = sighting_of(look, frame.t)
        boxes = [(each.box, FOUND) for each in look.found if seen is None or each.box != seen.box]
        if seen is not None:
            boxes.append((seen.box, SEEN))
            place = {"x": seen.box[0], "y": seen.box[1] - 4}
            colors = {"text_color": TEXT, "background_color": SHADE}
            texts.append({"timestamp": stamp, "position": place, "text": caption(seen), "font_size": 12.0, **colors})
        for (left, top, width, height), color in boxes:
            corners = [(left, top), (left + width, top), (left + width, top + height), (left, top + height)]
            outline = {"points": [{"x": x, "y": y} for x, y in corners], "outline_color": color, "thickness": 2.0}
            points.append({"timestamp": stamp, "type": LINE_LOOP, **outline})
    return {"circles": [], "points": points, "texts": texts}


def _log(level: int, message: str) -> dict[str, Any]:
    return {"level": level, "message": message, "name": "nxtdrive", "file": "", "line": 0}


def _pose(x_m: float, y_m: float, yaw_rad: float) -> dict[str, dict[str, float]]:
    turned = {"x": 0.0, "y": 0.0, "z": math.sin(yaw_rad / 2), "w": math.cos(yaw_rad / 2)}
    return {"position": {"x": x_m, "y": y_m, "z": 0.0}, "orientation": turned}
