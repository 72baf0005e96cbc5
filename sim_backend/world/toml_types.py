"""Types of the keys in a world file."""

from __future__ import annotations

from typing import Annotated, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field, Strict

Entry = TypeVar("Entry")
Entries = Annotated[tuple[Entry, ...], Strict(False)]
"""A tuple that may be given as a list: TOML has no tuples."""
FARTHEST_MM = 1e6
"""A kilometre: larger numbers are mistakes, and those near the end of the floating-point range break computations."""
Coordinate = Annotated[float, Field(ge=-FARTHEST_MM, le=FARTHEST_MM)]
Point = Annotated[tuple[Coordinate, Coordinate], Strict(False)]
MIN_SIZE = 1e-3
"""A micrometre, or a gram: products of much smaller sizes and masses are 0."""
LONGEST_S = 1e6
"""Eleven days, more than any simulation runs."""
Positive = Annotated[float, Field(ge=MIN_SIZE, le=FARTHEST_MM)]
"""A mass, a speed or another quantity that is more than 0."""
Length = Positive
Size = Annotated[tuple[Length, Length], Strict(False)]
Name = Annotated[str, Field(min_length=1)]
Seconds = Annotated[float, Field(ge=0, le=LONGEST_S)]
Percent = Annotated[float, Field(ge=0, le=100)]
Direction = Annotated[float, Field(ge=-360, le=360)]
"""Degrees clockwise, on the map or from the robot's front."""
Offset = Annotated[float, Field(ge=-500, le=500)]
"""From the middle of the robot's axle; the body's radius is 500 mm at most."""
Mounting = Annotated[tuple[Offset, Offset], Strict(False)]
"""A position on the robot: forward and right of the middle of the axle."""
ROOM_M, PRINT_M = 20.0, 3.0
"""No room and no print is larger in metres."""
MAX_TIMES = 1_000_000
"""Once a second in the longest simulation."""


def in_other_unit(size_mm: tuple[float, float], metres_up_to: float) -> str:
    """Say how to write in millimetres a size that was probably meant in metres, or above that limit in centimetres."""
    unit, factor = ("metres", 1000) if max(size_mm) <= metres_up_to else ("centimetres", 10)
    return f"in {unit}, write [{factor * size_mm[0]:g}, {factor * size_mm[1]:g}]"


def _span(value: object) -> object:
    """Convert a number of seconds to a range of zero width; check the order of a given range."""
    match value:
        case int() | float() if 0 <= value <= LONGEST_S:
            return value, value
        case [int() | float() as shortest, int() | float() as longest] if 0 <= shortest <= longest <= LONGEST_S:
            return shortest, longest
    raise ValueError(f"must be seconds, or [shortest, longest] to draw from, {LONGEST_S:.0f} at most, not {value!r}")


Duration = Annotated[tuple[Seconds, Seconds], BeforeValidator(_span)]
"""Shortest and longest time in seconds; durations are drawn uniformly with the simulation's seed."""

PAINTS: dict[str, tuple[float, float, float]] = {
    "black": (5, 5, 5),
    "blue": (8, 15, 45),
    "green": (10, 40, 15),
    "yellow": (75, 60, 10),
    "red": (60, 8, 8),
    "white": (85, 85, 85),
    "grey": (45, 45, 45),
}
"""Reflected red, green and blue light, percent; typical of tape, paint and paper."""


TEXTURES = (
    "wall",
    "wallpaper",
    "bricks",
    "floor",
    "carpet",
    "wood",
    "cardboard",
    "carton",
    "crate",
    "red_box",
    "blue_box",
    "green_box",
    "yellow_box",
    "person_blue",
    "person_green",
)
"""Names of the procedural textures, which `sim_backend.camera.textures` draws."""


def _paint(value: object) -> object:
    if isinstance(value, str):
        if value not in PAINTS:
            raise ValueError(f"must be one of {', '.join(PAINTS)}, or [red, green, blue] in percent, not {value!r}")
        return PAINTS[value]
    return value


def paint_name(paint: tuple[float, float, float]) -> str:
    """Return a colour as a world file gives it: by name, or as [red, green, blue]."""
    text = "[{:g}, {:g}, {:g}]".format(*paint)
    return next((name for name, each in PAINTS.items() if each == paint), text)


Paint = Annotated[tuple[Percent, Percent, Percent], Strict(False), BeforeValidator(_paint)]
"""A colour by name, or as reflected red, green and blue light in percent."""


class Table(BaseModel):
    """A table of the world file; unknown keys and values of other types are rejected."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)
