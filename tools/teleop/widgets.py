"""Parts of the screen: the camera's picture in half blocks, and the list of keys."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby

import numpy as np
from rich.color import Color
from rich.segment import Segment
from rich.style import Style
from textual.app import ComposeResult
from textual.events import Key
from textual.geometry import Size
from textual.screen import ModalScreen
from textual.strip import Strip
from textual.widget import Widget
from textual.widgets import Static

from nxtdrive.vision.detection import Image

from .floor_map import ARROWS, ECHO, PATH, TARGET
from .latest_frame import STALE_S, LatestFrame

HALF_BLOCK = "▀"
COLOR_STEP = 8
"""Colors are rounded to multiples of this, so that neighbours are often equal: less text for the terminal to take."""
MAX_SCREEN_SHARE = 0.6
"""Largest share of the height that the picture may take from the map below it."""

LEGEND = f"{PATH} path {ECHO} echo {TARGET} target {ARROWS[0]} robot"
"""Signs of the map."""

HELP = f"""\
arrows, WASD  drive; hold the key
Q  E          bend left, right
+  -          faster, slower
X             halt
space         STOP until Enter
Enter         release the stop
Esc  Ctrl-C   stop and quit
A key counts for half a second.

left stick    drive and steer
right stick   steer
RB  LB        faster, slower
B  A          STOP, release

map: {LEGEND}
boxes: green found, orange unsure"""


class CameraView(Widget):
    """The camera's latest picture, two pixels in each character cell."""

    def __init__(self, latest: LatestFrame) -> None:
        super().__init__(id="camera")
        self.border_title = "camera"
        self._latest = latest
        self._lines: list[Strip] = []
        self._aspect = latest.aspect

    def get_content_height(self, container: Size, _viewport: Size, width: int) -> int:
        """Take the height of the picture at this width, or most of the screen's."""
        return max(1, min(round(width * self._aspect / 2), round(container.height * MAX_SCREEN_SHARE)))

    def show(self, now_s: float) -> None:
        """Draw the latest frame; `now_s` is the time on the frames' clock."""
        width, height = self.content_size
        age_s, image = self._latest.age_s(now_s), self._latest.fitted(width, height * 2)
        if image is None or age_s is None:
            return
        stale = age_s > STALE_S
        self.set_class(stale, "alarm")
        self.border_subtitle = f"NO PICTURE for {age_s:.0f} s" if stale else ""
        self._lines = list(half_blocks(image // 3 if stale else image, width, height, self.rich_style))
        changed, self._aspect = self._aspect != self._latest.aspect, self._latest.aspect
        self.refresh(layout=changed)

    def render_line(self, y: int) -> Strip:
        """Return one line of the picture."""
        return self._lines[y] if y < len(self._lines) else Strip.blank(self.size.width)


def half_blocks(image: Image, width: int, height: int, around: Style) -> Iterator[Strip]:
    """Yield lines of characters that show a BGR image in their centre; each character is two pixels."""
    rows, columns = image.shape[:2]
    left, top = (width - columns) // 2, (height - (rows + 1) // 2) // 2
    padded = np.zeros(((rows + 1) // 2 * 2, columns, 3), np.uint8)
    padded[:rows] = image // COLOR_STEP * COLOR_STEP
    blank = Strip.blank(width, around)
    yield from (blank for _ in range(top))
    for upper, lower in zip(padded[::2].tolist(), padded[1::2].tolist(), strict=True):
        cells = groupby(zip(upper, lower, strict=True))
        line = [Segment(" " * left, around), *(_segment(up, low, sum(1 for _ in run)) for (up, low), run in cells)]
        yield Strip(line, left + columns).adjust_cell_length(width, around)
    yield from (blank for _ in range(height - top - len(padded) // 2))


def _segment(upper: list[int], lower: list[int], count: int) -> Segment:
    foreground, background = (Color.from_rgb(*color[::-1]) for color in (upper, lower))
    return Segment(HALF_BLOCK * count, Style.from_color(foreground, background))


class KeysScreen(ModalScreen[None]):
    """All keys; any key closes it and also does its work, but Enter does not release a stop."""

    CSS = """
    KeysScreen { align: center middle; }
    KeysScreen Static { width: auto; max-width: 100%; height: auto; max-height: 100%; padding: 0 1;
                        border: round $primary; background: $surface; overflow-y: auto; }
    """

    def compose(self) -> ComposeResult:
        """Lay out the list."""
        keys = Static(HELP, markup=False)
        keys.border_title = "keys"
        keys.border_subtitle = "any key closes"
        yield keys

    def on_key(self, event: Key) -> None:
        """Close; the key is passed on to the program, unless it may have been pressed just to close the list."""
        if event.key in ("question_mark", "enter"):
            event.stop()
        self.dismiss()
