"""JSON schemas of the messages in an MCAP file: Foxglove's, as far as they are used, and two of our own.

Lichtblick and Foxglove recognise a message by its schema's name. Source of names and fields: Foxglove's documentation
of its message schemas, https://docs.foxglove.dev/docs/sdk/schemas.
"""

from __future__ import annotations

from typing import Any

Schema = dict[str, Any]

NUMBER: Schema = {"type": "number"}
INTEGER: Schema = {"type": "integer"}
STRING: Schema = {"type": "string"}


def _object(**properties: Schema) -> Schema:
    return {"type": "object", "properties": properties}


def _list(items: Schema) -> Schema:
    return {"type": "array", "items": items}


TIME = {"title": "time", **_object(sec=INTEGER, nsec=INTEGER)}
VECTOR = _object(x=NUMBER, y=NUMBER, z=NUMBER)
ROTATION = _object(x=NUMBER, y=NUMBER, z=NUMBER, w=NUMBER)
POSE = _object(position=VECTOR, orientation=ROTATION)
POINT = _object(x=NUMBER, y=NUMBER)
COLOR = _object(r=NUMBER, g=NUMBER, b=NUMBER, a=NUMBER)
STAMPED = {"timestamp": TIME, "frame_id": STRING}

SCHEMAS: dict[str, Schema] = {
    "foxglove.CompressedImage": _object(**STAMPED, data={"type": "string", "contentEncoding": "base64"}, format=STRING),
    "foxglove.ImageAnnotations": _object(
        circles=_list(_object()),
        points=_list(_object(timestamp=TIME, type=INTEGER, points=_list(POINT), outline_color=COLOR, thickness=NUMBER)),
        texts=_list(
            _object(
                timestamp=TIME, position=POINT, text=STRING, font_size=NUMBER, text_color=COLOR, background_color=COLOR
            )
        ),
    ),
    "foxglove.FrameTransform": _object(
        timestamp=TIME, parent_frame_id=STRING, child_frame_id=STRING, translation=VECTOR, rotation=ROTATION
    ),
    "foxglove.PoseInFrame": _object(**STAMPED, pose=POSE),
    "foxglove.LaserScan": _object(
        **STAMPED, pose=POSE, start_angle=NUMBER, end_angle=NUMBER, ranges=_list(NUMBER), intensities=_list(NUMBER)
    ),
    "foxglove.Log": _object(timestamp=TIME, level=INTEGER, message=STRING, name=STRING, file=STRING, line=INTEGER),
    "nxtdrive.Battery": _object(timestamp=TIME, voltage=NUMBER),
    "nxtdrive.State": _object(timestamp=TIME, state=STRING, target=STRING),
}
"""By name; each also gets it as its title."""

TOPICS = {
    "/camera": "foxglove.CompressedImage",
    "/camera/boxes": "foxglove.ImageAnnotations",
    "/tf": "foxglove.FrameTransform",
    "/pose": "foxglove.PoseInFrame",
    "/sonar": "foxglove.LaserScan",
    "/battery": "nxtdrive.Battery",
    "/state": "nxtdrive.State",
    "/log": "foxglove.Log",
    "/decisions": "foxglove.Log",
}
"""Topic -> schema."""
