"""Text in images: DejaVu Sans for Latin, Greek and Cyrillic, the system's fonts for other scripts.

``fonts/DejaVuSans.ttf`` is DejaVu Sans 2.37 without the other scripts, made by fonttools' ``pyftsubset``; its licence
is beside it. A character that no font has is drawn as a box.
"""

from __future__ import annotations

import shutil
import subprocess
import unicodedata
from collections.abc import Iterator
from contextlib import suppress
from functools import cache
from itertools import groupby
from pathlib import Path

from PIL import ImageFont

from firmware_protocol.printable import printable

BUNDLED = str(Path(__file__).with_name("fonts") / "DejaVuSans.ttf")
MISSING = "\U0010ffff"
"""No font has this: it is not a character."""
SYSTEM_FONTS = (
    "DejaVuSans.ttf",
    "msyh.ttc",
    "malgun.ttf",
    "seguisym.ttf",
    "Nirmala.ttc",
    "Nirmala.ttf",
    "arial.ttf",
    "PingFang.ttc",
    "Hiragino Sans GB.ttc",
    "Arial Unicode.ttf",
)
"""Fonts of Windows and macOS for other scripts; Pillow looks in the system's folders for them."""
FC_MATCH_S = 5.0
PROBE_PX = 24


@cache
def font(path: str, size_px: int) -> ImageFont.FreeTypeFont:
    """Return a font in a size.

    Raises:
        OSError: There is none of this name.
    """
    return ImageFont.truetype(path, size_px)


def parts(text: str, size_px: int) -> list[tuple[str, ImageFont.FreeTypeFont]]:
    """Return a text's parts, each with a font that has its characters; characters that cannot be shown are escaped."""
    shown, path = [], BUNDLED
    for character in unicodedata.normalize("NFC", printable(text)):
        if not unicodedata.combining(character):
            path = font_of(character)
        shown.append((path, character))
    return [("".join(each for _, each in run), font(path, size_px)) for path, run in groupby(shown, lambda of: of[0])]


def width_px(text: str, size_px: int) -> float:
    """Return the width of a text in pixels."""
    return sum(each.getlength(part) for part, each in parts(text, size_px))


@cache
def font_of(character: str) -> str:
    """Return the file of a font that has a character; the bundled one if none has it."""
    if has(BUNDLED, character):
        return BUNDLED
    return next((path for path in _others(character) if has(path, character)), BUNDLED)


@cache
def has(path: str, character: str) -> bool:
    """Return whether there is such a font, and it has a character."""
    with suppress(OSError):
        return _glyph(path, character) != _glyph(path, MISSING)
    return False


def _glyph(path: str, character: str) -> tuple[tuple[int, int], bytes]:
    mask = font(path, PROBE_PX).getmask(character)
    return mask.size, bytes(mask)


def _others(character: str) -> tuple[str, ...]:
    """Return the files of fonts that may have a character and others of its script."""
    script = unicodedata.name(character, "").partition(" ")[0]
    if script not in _fonts_by_script:
        _fonts_by_script[script] = (*_matching(ord(character)), *SYSTEM_FONTS)
    return _fonts_by_script[script]


_fonts_by_script: dict[str, tuple[str, ...]] = {}


def _matching(code: int) -> Iterator[str]:
    """Yield the font that fontconfig, where there is one, finds for a character."""
    program = shutil.which("fc-match")
    if program is None:
        return
    with suppress(OSError, subprocess.SubprocessError):
        command = [program, "--format=%{file}", f":charset={code:x}"]
        found = subprocess.run(command, capture_output=True, text=True, timeout=FC_MATCH_S, check=False)  # noqa: S603
        yield found.stdout.strip()
