"""The best estimate for a target whose size is not in view, since the frame cuts it off."""

from __future__ import annotations

from dataclasses import replace

from behaviors.ports import Cut, Sighting

BEAM_DEG = 10.0
"""A target within this bearing is in the sonar's beam and gives an echo."""


def estimated(sighting: Sighting, echo_ahead_mm: float | None, remembered: tuple[float, float] | None) -> Sighting:
    """Return a sighting with the best estimate of its place, where it only bounds that.

    An echo is of the target if that extends below the frame: a nearer object would hide its lower part. Without
    one the target is where it was, unless the frame shows that it is nearer or less far to the side.

    Args:
        sighting: With its distance corrected.
        echo_ahead_mm: How far in front of the lens the echo comes from, or None.
        remembered: Bearing and distance, from the lens, of where it was seen last; None if it was not.
    """
    if not sighting.bound:
        return sighting
    bearing_deg, distance_mm = sighting.bearing_deg, sighting.distance_mm
    if remembered is not None:
        bearing_deg = _aside(sighting, remembered[0])
        distance_mm = min(distance_mm, remembered[1])
    echo = echo_ahead_mm is not None and Cut.BOTTOM in sighting.cut and abs(sighting.bearing_deg) <= BEAM_DEG
    if echo:
        distance_mm = limit_to_echo(sighting, echo_ahead_mm).distance_mm
    bound = remembered is None and not echo
    return replace(sighting, bearing_deg=bearing_deg, distance_mm=distance_mm, bound=bound)


def limit_to_echo(sighting: Sighting, echo_ahead_mm: float | None) -> Sighting:
    """Return a sighting of a target of unknown size, no farther than an echo: its source is the target, or hides it.

    Args:
        sighting: With its distance by a guessed size.
        echo_ahead_mm: How far in front of the lens the echo comes from, or None.
    """
    if echo_ahead_mm is None or abs(sighting.bearing_deg) > BEAM_DEG:
        return sighting
    return limit_distance(sighting, echo_ahead_mm)


def limit_distance(sighting: Sighting, most_mm: float) -> Sighting:
    """Return a sighting of a target of unknown size, no farther than this: what is nearer is smaller in proportion."""
    if most_mm >= sighting.distance_mm:
        return sighting
    share, edges_mm = most_mm / sighting.distance_mm, sighting.edges_mm
    edges_mm = None if edges_mm is None else (edges_mm[0] * share, edges_mm[1] * share)
    return replace(sighting, distance_mm=most_mm, edges_mm=edges_mm)


def _aside(sighting: Sighting, remembered_deg: float) -> float:
    """Return the remembered bearing if the hidden part may reach that far, else that of the visible part."""
    farther_left, farther_right = Cut.LEFT in sighting.cut, Cut.RIGHT in sighting.cut
    if remembered_deg < sighting.bearing_deg:
        return remembered_deg if farther_left else sighting.bearing_deg
    return remembered_deg if farther_right else sighting.bearing_deg
