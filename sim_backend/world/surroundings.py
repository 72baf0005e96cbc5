"""Conditions that simple sensors measure: floor colour, light, sound, temperature and magnetic north."""

from __future__ import annotations

import math
from itertools import pairwise

from sim_backend.plane import within
from sim_backend.world.sensor_tables import Patch
from sim_backend.world.toml_types import Point
from sim_backend.world.world_file import WorldFile

Rgb = tuple[float, float, float]

_NEAREST_MM = 100.0
"""Below this distance from a source the sound level is constant."""
_ONE_METRE_MM = 1000.0


class LocalConditions:
    """Conditions of a world at each place.

    Args:
        file: The world file.
    """

    def __init__(self, file: WorldFile) -> None:
        self._file = file
        self._on_top = tuple(reversed(file.patches))

    @property
    def ambient_percent(self) -> float:
        """Reading of a light sensor that looks ahead with its lamp off."""
        return self._file.light.ambient_percent

    @property
    def temperature_c(self) -> float:
        """Temperature, degrees Celsius."""
        return self._file.surroundings.temperature_c

    def paint(self, at_mm: Point) -> Rgb:
        """Return red, green and blue light that the floor reflects at a place, percent each."""
        for patch in self._on_top:
            if _covers(patch, at_mm):
                return patch.color
        return self._file.floor.color

    @property
    def light_changes(self) -> bool:
        """Whether the brightness for the camera depends on time or place."""
        return bool(self._file.light.drift_percent or self._file.shades)

    def brightness(self, at_mm: Point, now_ms: int) -> float:
        """Return the brightness for a camera at a place; 1 is a well-lit room."""
        light = self._file.light
        phase = 2.0 * math.pi * now_ms / 1000.0 / light.drift_s
        brightness = light.exposure * (1.0 + light.drift_percent / 100.0 * math.sin(phase))
        for shade in self._file.shades:
            share = max(0.0, 1.0 - math.dist(at_mm, shade.at_mm) / shade.radius_mm)
            brightness *= 1.0 + share * (shade.exposure - 1.0)
        return brightness

    def sound_db(self, at_mm: Point, now_ms: int) -> float:
        """Return the sound level at a place: the background and all active sources."""
        energy = _energy(self._file.surroundings.sound_db)
        for sound in self._file.sounds:
            since_s = now_ms / 1000.0 - sound.from_s
            if since_s >= 0 and (sound.for_s is None or since_s < sound.for_s):
                distance_mm = max(math.dist(at_mm, sound.at_mm), _NEAREST_MM)
                energy += _energy(sound.level_db) * (_ONE_METRE_MM / distance_mm) ** 2
        return 10.0 * math.log10(energy)

    def north_deg(self, at_mm: Point) -> float:
        """Return the direction of a compass needle at a place, on the map."""
        north_deg = self._file.surroundings.north_deg
        for magnet in self._file.magnets:
            share = 1.0 - math.dist(at_mm, magnet.at_mm) / magnet.radius_mm
            north_deg += magnet.deflection_deg * max(0.0, share)
        return north_deg


def _energy(level_db: float) -> float:
    return float(10.0 ** (level_db / 10.0))


def _covers(patch: Patch, at_mm: Point) -> bool:
    if patch.at_mm is None or patch.size_mm is None:
        corners = pairwise(patch.along_mm)
        return any(_distance_mm(at_mm, start, end) <= patch.width_mm / 2 for start, end in corners)
    return within(at_mm, patch.at_mm, patch.size_mm, patch.facing_deg)


def _distance_mm(point: Point, start: Point, end: Point) -> float:
    """Return the distance from a point to the line segment between two others."""
    dx, dy = end[0] - start[0], end[1] - start[1]
    square = dx**2 + dy**2
    share = ((point[0] - start[0]) * dx + (point[1] - start[1]) * dy) / square if square else 0.0
    share = min(max(share, 0.0), 1.0)
    return math.dist(point, (start[0] + share * dx, start[1] + share * dy))
