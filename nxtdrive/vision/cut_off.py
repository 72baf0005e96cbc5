"""Targets that the frame cuts off: on which sides, and their size in spite of it.

A detector that finds corners computes them from the visible part, even if they lie outside the frame. One that gives
a box gives only the visible part, whose height shrinks as the robot drives up to a low target: so such a size
is completed by the shape that the target had when it was last wholly in view, or counts as a bound.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import replace
from statistics import median

from behaviors.ports import Cut, Sighting
from nxtdrive.vision.detection import Detection

EDGE_SHARE = 0.01
"""A box that ends nearer to the frame's edge than this share of the frame's longer side ends there."""

VIEWS = 5
"""The shape is the median of that in this many views: in one of them something may have hidden a part."""


def marked(found: Iterable[Detection], width: int, height: int) -> list[Detection]:
    """Return detections in an image of this size, each with the sides at which the edge cuts it off."""
    return [_marked(one, _cut(one, width, height)) for one in found]


def _marked(one: Detection, cut: Cut) -> Detection:
    return replace(one, cut=cut, bound=True) if cut and one.quad is None else one


def _cut(one: Detection, width: int, height: int) -> Cut:
    left, top, box_width, box_height = one.box
    reach = EDGE_SHARE * max(width, height)
    ends = (
        (Cut.LEFT, left <= reach),
        (Cut.TOP, top <= reach),
        (Cut.RIGHT, left + box_width >= width - reach),
        (Cut.BOTTOM, top + box_height >= height - reach),
    )
    return Cut(sum(side.value for side, at_the_end in ends if at_the_end))


class Shape:
    """Width over height of one target, as it looked lately."""

    def __init__(self) -> None:
        self._ratios: deque[float] = deque(maxlen=VIEWS)

    def learn(self, sighting: Sighting) -> None:
        """Update with a sighting that is right."""
        _, _, width, height = sighting.box
        if not sighting.cut and width > 0 and height > 0:
            self._ratios.append(width / height)

    def completed(self, one: Detection) -> Detection:
        """Return a detection with the box of the whole target, as far as it can be determined.

        If only opposite sides cut it off, or none, the other length is whole, and both are known.
        """
        if not one.cut or not self._ratios:
            return one
        ratio = median(self._ratios)
        left, top, width, height = one.box
        aside, upright = bool(one.cut & (Cut.LEFT | Cut.RIGHT)), bool(one.cut & (Cut.TOP | Cut.BOTTOM))
        whole_width = max(width, round(height * ratio)) if aside else width
        whole_height = max(height, round(width / ratio)) if upright else height
        left -= _before(whole_width - width, one.cut, Cut.LEFT, Cut.RIGHT)
        top -= _before(whole_height - height, one.cut, Cut.TOP, Cut.BOTTOM)
        return replace(one, box=(left, top, whole_width, whole_height), bound=aside and upright)


def _before(missing: int, cut: Cut, first: Cut, second: Cut) -> int:
    """Return how much of the missing part lies before the box, where either side may cut it off."""
    if first in cut and second in cut:
        return missing // 2
    return missing if first in cut else 0
