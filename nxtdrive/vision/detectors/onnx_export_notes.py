"""How to read a model's outputs, as far as Ultralytics' exporter says it in the metadata.

Source: `Exporter` in ultralytics/engine/exporter.py and `RTDETRDecoder` in nn/modules/head.py of Ultralytics 8.4.
"""

from __future__ import annotations

import ast
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class ExportNotes:
    """What the metadata say of the outputs.

    Attributes:
        chosen: The model itself chooses the places: each is one row of corners, score and label.
        oriented: Boxes are rotated; the last number of a place is the angle.
        rt_detr: Boxes are centre and size as shares of a frame that is stretched to the input's shape.
    """

    chosen: bool = False
    oriented: bool = False
    rt_detr: bool = False


def export_notes(metadata: Mapping[str, str]) -> ExportNotes:
    """Return what a model's metadata say of its outputs."""
    arguments: object = None
    with suppress(ValueError, SyntaxError, MemoryError, RecursionError, TypeError):
        arguments = ast.literal_eval(metadata.get("args", "")[:10_000])
    nms = isinstance(arguments, dict) and arguments.get("nms") is True
    return ExportNotes(
        chosen=nms or metadata.get("end2end") == "True",
        oriented=metadata.get("task") == "obb",
        rt_detr=metadata.get("head") == "RTDETRDecoder",
    )
