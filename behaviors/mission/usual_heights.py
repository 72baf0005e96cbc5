"""Heights of things by their names, for targets that were not measured."""

from __future__ import annotations

from pathlib import PurePath

OTHERS_MM = 250.0
"""Of labels that are not listed: between a cup and a chair."""

USUAL_HEIGHTS_MM = {
    "person": 1700.0,
    "face": 200.0,
    "bicycle": 1000.0,
    "bench": 850.0,
    "cat": 300.0,
    "dog": 500.0,
    "backpack": 450.0,
    "umbrella": 800.0,
    "handbag": 300.0,
    "suitcase": 600.0,
    "sports ball": 220.0,
    "bottle": 250.0,
    "wine glass": 200.0,
    "cup": 100.0,
    "bowl": 80.0,
    "banana": 120.0,
    "apple": 80.0,
    "orange": 80.0,
    "chair": 850.0,
    "couch": 850.0,
    "potted plant": 500.0,
    "bed": 600.0,
    "dining table": 750.0,
    "toilet": 750.0,
    "tv": 600.0,
    "laptop": 230.0,
    "mouse": 40.0,
    "remote": 60.0,
    "keyboard": 60.0,
    "cell phone": 150.0,
    "microwave": 300.0,
    "oven": 600.0,
    "refrigerator": 1700.0,
    "book": 240.0,
    "clock": 300.0,
    "vase": 300.0,
    "teddy bear": 300.0,
}
"""By COCO's labels, millimetres: rough, and only a first guess that driving improves."""

CASCADE_LABELS = {
    "haarcascade_frontalface": "face",
    "haarcascade_profileface": "face",
    "haarcascade_fullbody": "person",
}
"""Labels of what OpenCV's cascades find, by the beginning of their names; nothing usual is known of the others."""


def cascade_label(cascade: str) -> str:
    """Return the label of what a cascade finds, given by its name or file; empty if it is not known."""
    stem = PurePath(cascade).stem
    return next((label for begin, label in CASCADE_LABELS.items() if stem.startswith(begin)), "")


def default_height_mm(label: str) -> float:
    """Return the usual height of objects with a label."""
    return USUAL_HEIGHTS_MM.get(label.casefold(), OTHERS_MM)
