"""Targets by photograph: a box drawn on the camera's picture becomes a target of a mission."""

from __future__ import annotations

import re
import threading
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import cv2
import tomlkit
from pydantic import AfterValidator, BaseModel, ConfigDict

from behaviors.mission.targets import Height
from firmware_protocol.errors import ConfigError
from input_files.toml_file import parse_toml, toml_key, toml_string
from nxtdrive.recording.output_file import write_file
from nxtdrive.vision.detection import Box, Image, overlap
from nxtdrive.vision.detectors.picture import PictureDetector

from .missions import is_device

if TYPE_CHECKING:
    from collections.abc import Callable

KEPT = 20
"""Pictures that boxes can still be drawn on."""
MIN_OVERLAP = 0.5
"""The detector must find the box again where it was drawn: intersection over union."""
BOM = "\ufeff"
NAME = re.compile(r"\w[\w -]{0,39}")
"""Of a target that is added."""


def _check_name(name: str) -> str:
    if not NAME.fullmatch(name):
        raise ValueError("must be 1 to 40 letters, digits, spaces, - and _, and begin with a letter or a digit")
    return name


class NewTarget(BaseModel):
    """A target to add.

    Attributes:
        text: The mission's text; empty for a new mission.
        name: Of the target.
        height_mm: Real height of the box's content.
        picture: Number of the picture.
        box: Left, top, width, height in pixels.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    text: str
    name: Annotated[str, AfterValidator(_check_name)]
    height_mm: Height
    picture: int
    box: Box


class Photographs:
    """Pictures taken on request, and the targets made of them.

    Args:
        folder: Where the targets' pictures go: beside the missions.
        latest: Returns the camera's latest frame, or None.
    """

    def __init__(self, folder: Path, latest: Callable[[], Image | None]) -> None:
        self._folder = folder
        self._latest = latest
        self._pictures: dict[int, Image] = {}
        self._numbers = count(1)
        self._lock = threading.Lock()

    def take(self) -> tuple[int, bytes]:
        """Keep the current picture; returns its number, and it as PNG.

        Raises:
            ValueError: The camera gives none.
        """
        image = self._latest()
        if image is None:
            raise ValueError("The camera has given no picture yet.")
        with self._lock:
            number = next(self._numbers)
            self._pictures[number] = image
            self._pictures.pop(number - KEPT, None)
        return number, _png(image)

    def add(self, target: NewTarget) -> dict[str, str]:
        """Save the box's content beside the missions; return its file and the mission's text with the target.

        Raises:
            ValueError: The box or the text cannot be used; the message says why.
            OSError: The picture cannot be written.
        """
        image = self._pictures.get(target.picture)
        if image is None:
            raise ValueError("This picture is no longer kept. Take another one.")
        picture = cut_out(image, target.box)
        text_for(target, "picture.png")  # a text that cannot be used leaves no file behind
        file = self._write(target.name, _png(picture))
        return {"file": file, "text": text_for(target, file)}

    def _write(self, name: str, png: bytes) -> str:
        """Write a new file that is called as the target is, with a number if there is one already."""
        stem = f"{name}-target" if is_device(name) else name.replace(" ", "-")
        for number in count(1):
            path = self._folder / (f"{stem}.png" if number == 1 else f"{stem}-{number}.png")
            try:
                path.touch(exist_ok=False)
            except FileExistsError:
                continue
            write_file(path, png)
            return path.name
        raise AssertionError


def cut_out(image: Image, box: Box) -> Image:
    """Return the box's content, if the picture detector finds it again in the image.

    Raises:
        ValueError: It does not; the message says why.
    """
    left, top, width, height = box
    rows, columns = image.shape[:2]
    if not (0 <= left < left + width <= columns and 0 <= top < top + height <= rows):
        raise ValueError("The box does not lie in the picture. Draw it again.")
    picture = image[top : top + height, left : left + width].copy()
    try:
        found = PictureDetector([picture]).detect(image)
    except ConfigError as error:
        raise ValueError(str(error)) from None
    if not any(overlap(box, detection.box) >= MIN_OVERLAP for detection in found):
        raise ValueError(
            "The detector does not find this box again in the same picture. Draw it around something flat with a "
            "pattern, seen from the front, without the background."
        )
    return picture


def text_for(target: NewTarget, file: str) -> str:
    """Return the mission's text with the target at the end, its comments and its form kept.

    Raises:
        ValueError: The text is not a mission to which a target can be added.
    """
    key, quoted = toml_key(target.name), toml_string(target.name)
    table = f'[target.{key}]\ndetector = "picture"\npictures = ["{file}"]\nheight_mm = {target.height_mm:g}\n'
    if not target.text.strip():
        return f'[mission]\nname = "find {target.name}"\ntargets = [{quoted}]\n\n{table}'
    try:
        return f"{_with_name(target.text.removeprefix(BOM), target.name, table)}\n\n{table}"
    except ValueError as error:
        raise ValueError(
            f"The target cannot be added to this text ({error}). Correct its mistakes, or choose another name."
        ) from None


def _with_name(text: str, name: str, table: str) -> str:
    """Return a mission's text with a name at the end of its targets, to which a table can be added.

    Raises:
        ValueError: The text is not TOML, has no list of targets, or has the table already.
    """
    mission = parse_toml(text).get("mission")
    if not (isinstance(mission, dict) and isinstance(mission.get("targets"), list)):
        raise ValueError("it has no list of targets under [mission]")  # noqa: TRY004 - as for other mistakes in it
    parse_toml(f"{text}\n\n{table}")
    document: Any = tomlkit.parse(text)
    document["mission"]["targets"].append(name)
    return tomlkit.dumps(document).rstrip()


def _png(image: Image) -> bytes:
    return bytes(cv2.imencode(".png", image)[1].tobytes())
