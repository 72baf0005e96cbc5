"""Wrap angles, so that a small turn to the left is not taken for nearly a full turn to the right."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:  # the driver uses this module as well, and must not load numpy for it
    import numpy as np
    from numpy.typing import NDArray

Angle = TypeVar("Angle", float, "NDArray[np.float64]")


def wrapped_deg(angle_deg: Angle) -> Angle:
    """Return the same direction between -180 and 180 degrees; of an array, that of each element."""
    return (angle_deg + 180.0) % 360.0 - 180.0
