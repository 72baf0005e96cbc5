"""Generate a mission file with every key and its meaning from the models that validate mission files."""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from input_files.toml_file import toml_string
from nxtdrive.cli.templates.target import RED_BOX, USUAL_STOP_MM, TemplateTarget
from nxtdrive.cli.templates.world import toml_path

if TYPE_CHECKING:
    from pydantic import BaseModel

_ATTRIBUTE = re.compile(r"^    (\w+): (.+(?:\n        .+)*)", re.MULTILINE)

_HEAD = """\
# A mission: what to look for, in this order, and how to behave.
# Lengths in mm, times in s, angles in degrees; positive turns are to the right.
# A line that starts with "# key =" shows a default; remove the "# " to change it.
# A key that starts with "# # " has no default.

[mission]
name = {title}
targets = [{name}]{pad}# names of the [target.NAME] tables below, in order
profile = "adaptive"       # weighs what to do after a failure; "thesis" follows fixed rules
# rounds = 1               # maximum number of rounds through the list, unless [adaptive] has more
# time_limit_s = 600       # end after this time, whatever has been reached

{target}

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
# [target.sheet]
# detector = "qr"          # a printed QR code
# text = "7"               # its whole text; short texts are read from farther away
# height_mm = 160          # of the code, without the white around it
#
# [target.bin]
# detector = "color"       # a patch of strong colour, in a room without others of that colour
# color = "red"
# height_mm = 300
#
# [target.face]
# detector = "haar"        # one of OpenCV's cascades, or your XML file
# cascade = "haarcascade_frontalface_alt2"
# height_mm = 200
#
# [target.cup]
# detector = "onnx"        # an object that a neural network finds, given as an ONNX file
# model = "yolox_s.onnx"   # beside this file
# label = "cup"            # one of the model's labels
# height_mm = 100          # may be left out: the robot then measures it by driving
"""


_TABLES = {
    "color": """\
[target.{name}]
detector = "color"         # a patch of strong colour:
color = {color}              #   {colors}
height_mm = {height_mm:<15g}# real height of the patch; distances are computed from it""",
    "picture": """\
[target.{name}]
detector = "picture"       # something flat you have photographs of
pictures = [{file}]
height_mm = {height_mm:<15g}# real height of the print; distances are computed from it""",
    "marker": """\
[target.{name}]
detector = "marker"        # a printed ArUco or AprilTag marker
family = "aruco_4x4_50"
id = {id}
height_mm = {height_mm:<15g}# with its black border; distances are computed from it""",
    "qr": """\
[target.{name}]
detector = "qr"            # a printed QR code
text = {text}
height_mm = {height_mm:<15g}# of the code, without the white around it; distances are computed from it""",
}
"""Table of the target, by its detector."""


def template(target: TemplateTarget = RED_BOX, folder: Path = Path()) -> str:
    """Return the text of a valid mission file.

    Args:
        target: What it looks for.
        folder: Where the file will lie; the picture's path is relative to it if it can be.
    """
    from behaviors.mission import AdaptiveParameters, ThesisParameters
    from behaviors.mission.robot import CameraTable, ColorName, RobotTable

    options: dict[str, object] = {"colors": ", ".join(get_args(ColorName))}
    options |= {key: toml_string(value) if isinstance(value, str) else value for key, value in target.options.items()}
    options |= {"file": toml_path(target.picture, folder)} if target.picture is not None else {}
    table = _TABLES[str(target.options["detector"])].format(name=target.name, height_mm=target.height_mm, **options)
    name = toml_string(target.name)
    pad = " " * max(1, 15 - len(name))
    parts = [_HEAD.format(title=toml_string(f"find {target.name}"), name=name, pad=pad, target=table)]
    tables: dict[str, type[BaseModel]] = {
        "adaptive": AdaptiveParameters,
        "thesis": ThesisParameters,
        "robot": RobotTable,
        "camera": CameraTable,
    }
    for title, model in tables.items():
        set_here = {"arrive_mm": target.stop_mm} if target.stop_mm != USUAL_STOP_MM else {}
        parts.append("\n".join([f"[{title}]", *_keys(model, set_here), ""]))
    return "\n".join(parts)


def meanings(model: type[BaseModel]) -> dict[str, str]:
    """Return the meaning of each field, from the ``Attributes:`` sections of the class and its bases."""
    found: dict[str, str] = {}
    for cls in reversed(model.__mro__):
        _, _, attributes = inspect.cleandoc(cls.__doc__ or "").partition("Attributes:\n")
        described = {name: re.sub(r"\s+", " ", text) for name, text in _ATTRIBUTE.findall(attributes)}
        found |= {name: text for name, text in described.items() if name in model.model_fields}
    return found


def _keys(model: type[BaseModel], set_here: Mapping[str, object]) -> Iterator[str]:
    about = meanings(model)
    for name, field in model.model_fields.items():
        if name in set_here:
            line = f"{name} = {json.dumps(set_here[name])}".ljust(32)
            yield f"{line}# {about.get(name, '')} All of it is in view there."
            continue
        # a key without default stays commented out when the first "# " is removed
        default = f"# {name} =" if field.default is None else f"{name} = {json.dumps(field.default)}"
        yield f"# {default}".ljust(32) + f"# {about.get(name, '')}"
