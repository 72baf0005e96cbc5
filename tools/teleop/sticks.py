"""Convert the deflections of sticks to speed and turn rate, without a gamepad library."""

from __future__ import annotations

from dataclasses import dataclass

DEADZONE = 0.24
"""Deflection that counts as none: a worn stick rests off its centre.

Source: 7849 of 32767, XINPUT_GAMEPAD_LEFT_THUMB_DEADZONE in XInput.h."""
EXPO = 0.5
"""Share of the cube in the response: half-way of the stick is less than half speed, so that a thumb can aim."""
STEPS = 20
"""Speeds between none and full. A thumb trembles; neither motors nor the rule for stuck wheels should see it."""


@dataclass(frozen=True, slots=True)
class Sticks:
    """Deflections of a gamepad, -1..1, as SDL counts them: right and down are positive.

    Attributes:
        left_x: Left stick.
        left_y: Left stick.
        right_x: Right stick.
        cross_x: Directional pad, -1, 0 or 1.
        cross_y: Directional pad, -1, 0 or 1.
    """

    left_x: float = 0.0
    left_y: float = 0.0
    right_x: float = 0.0
    cross_x: float = 0.0
    cross_y: float = 0.0

    @property
    def ahead(self) -> float:
        """Share of the highest speed, -1..1, forward positive."""
        return response(-_strongest(self.left_y, self.cross_y))

    @property
    def turn(self) -> float:
        """Share of the highest turn rate, -1..1, right positive; the stick that is deflected farther is used."""
        return response(_strongest(self.left_x, self.right_x, self.cross_x))


def response(deflection: float) -> float:
    """Map a deflection to a share of the speed, both -1..1: zero in the dead zone, then a gentle rise to full speed."""
    beyond = (min(1.0, abs(deflection)) - DEADZONE) / (1.0 - DEADZONE)
    if beyond <= 0.0:
        return 0.0
    share = round(((1.0 - EXPO) * beyond + EXPO * beyond**3) * STEPS) / STEPS
    return share if deflection > 0 else -share


def _strongest(*deflections: float) -> float:
    return max(deflections, key=abs)
