"""The worlds and pictures that come with the simulation."""

from __future__ import annotations

from pathlib import Path

WORLDS = Path(__file__).parent / "worlds"
PICTURES = Path(__file__).parent / "pictures"


def world_names() -> list[str]:
    """Return the names of the bundled worlds."""
    return sorted(path.stem for path in WORLDS.glob("*.toml"))


def picture_names() -> list[str]:
    """Return the names of the bundled pictures."""
    return sorted(path.stem for path in PICTURES.glob("*.png"))
