"""Generates a mission file with every key and its meaning from the models that validate mission files."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pydantic import BaseModel

_ATTRIBUTE = re.compile(r"^    (\w+): (.+(?:\n        .+)*)", re.MULTILINE)

_HEAD = """\
# A mission: what to look for, in this order, and how to behave.
# Lengths in mm, times in s, angles in degrees; positive turns are to the right.
# A line that starts with "# key =" shows a default; remove the "# " to change it.

[mission]
name = "my mission"
targets = ["box"]          # names of the [target.NAME] tables below, in order
profile = "adaptive"       # weighs what to do after a failure; "thesis" follows the fixed rule of 2017
rounds = 1                 # how often to go through the list for what was given up
# time_limit_s = 600       # end then, whatever has been reached

[target.box]
detector = "color"         # a patch of strong colour:
color = "red"              #   red, orange, yellow, green, cyan, blue or magenta
height_mm = 100            # real height of the patch; distances are measured by it

# Other kinds of target:
#
# [target.lena]
# detector = "picture"     # something flat you have photographs of
# pictures = ["lena.png"]  # beside this file
# height_mm = 297
#
# [target.dock]
# detector = "marker"      # a printed ArUco or AprilTag marker
# family = "aruco_4x4_50"
# id = 7
# height_mm = 150
#
# [target.face]
# detector = "haar"        # one of OpenCV's cascades, or an XML file of yours
# cascade = "haarcascade_frontalface_alt2"
# height_mm = 180
"""


def template() -> str:
    """Return the text of a valid mission file."""
    from behaviors.mission import AdaptiveParameters, CameraTable, RobotTable, ThesisParameters

    parts = [_HEAD]
    tables: dict[str, type[BaseModel]] = {
        "adaptive": AdaptiveParameters,
        "thesis": ThesisParameters,
        "robot": RobotTable,
        "camera": CameraTable,
    }
    for title, model in tables.items():
        parts.append("\n".join([f"[{title}]", *_defaults(model), ""]))
    return "\n".join(parts)


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return the meaning of each field, from the ``Attributes:`` sections of the class and its bases."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        _, _, attributes = inspect.cleandoc(cls.__doc__ or "").partition("Attributes:\n")
        described = {name: re.sub(r"\s+", " ", text) for name, text in _ATTRIBUTE.findall(attributes)}
        found |= {name: text for name, text in described.items() if name in model.model_fields}
    for name, field in model.model_fields.items():
        if field.description:
            found.setdefault(name, field.description)
    return found


def _defaults(model: type[BaseModel]) -> Iterator[str]:
    about = meanings(model)
    for name, field in model.model_fields.items():
        # a key without default stays commented out when the first "# " is removed
        default = f"# {name} =" if field.default is None else f"{name} = {json.dumps(field.default)}"
        yield f"# {default}".ljust(32) + f"# {about.get(name, '')}"
