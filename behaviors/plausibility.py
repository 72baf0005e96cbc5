"""Whether the sonar and the apparent size agree on how far away a target is.

A target's distance by its apparent size is wrong by the factor by which its ``height_mm`` is wrong; the sonar does not
depend on it.
"""

from __future__ import annotations

from behaviors.ports import Edges

TOLERANCE_MM = 250.0
"""Default tolerance: sonar and lens are not at the same place, and both are uncertain by 5 % within a metre."""
TOLERANCE_SHARE = 1 / 3
"""Farther away, this share of the distance is tolerated: a box of a slanted picture is uncertain, and so is the height
of a target that was measured by eye."""

EDGE_MM = 10.0
"""The upper edge of a low target is known to this."""
FLOOR_TOLERANCE_MM = 30.0
"""A low target's lower edge is this near to the floor; one that is not where its size says looks higher."""


def passes_over(
    echo_ahead_mm: float, distance_mm: float, edges_mm: Edges | None, lens_mm: float, sonar_mm: float
) -> bool:
    """Return whether an echo is from behind a target that stands on the floor and is lower than the sonar.

    Args:
        echo_ahead_mm: How far in front of the lens the echo comes from.
        distance_mm: How far in front of the lens the target is by its apparent size.
        edges_mm: Its edges by its apparent size; None where that is not known.
        lens_mm: The lens above the floor.
        sonar_mm: The sonar above the floor.
    """
    if edges_mm is None:
        return False
    bottom_mm, top_mm = (lens_mm + edge_mm for edge_mm in edges_mm)
    return top_mm <= sonar_mm + EDGE_MM and abs(bottom_mm) <= FLOOR_TOLERANCE_MM and echo_ahead_mm > distance_mm


def contradicts(range_mm: float | None, distance_mm: float, tolerance_mm: float = TOLERANCE_MM) -> bool:
    """Return whether the sonar contradicts a distance by apparent size.

    Args:
        range_mm: The sonar's echo from straight ahead; None, without an echo, contradicts nothing.
        distance_mm: How far away the target is by its apparent size; the target is straight ahead.
        tolerance_mm: Differences up to this are tolerated, or up to a third of the distance if that is more.
    """
    if range_mm is None:
        return False
    return abs(range_mm - distance_mm) > max(tolerance_mm, TOLERANCE_SHARE * distance_mm)
