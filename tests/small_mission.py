"""Minimal missions."""

MISSION = """
[mission]
name = "small"
targets = ["lena"]
[target.lena]
detector = "picture"
pictures = ["lena.png"]
"""
"""In the world `open` it ends soon."""

COLOR_MISSION = """
[mission]
targets = ["box"]
[target.box]
detector = "color"
color = "red"
"""
"""It names no file."""


def with_table(mission, table, **values):
    """Return a mission with other values in one of its tables."""
    return mission.model_copy(update={table: getattr(mission, table).model_copy(update=values)})
