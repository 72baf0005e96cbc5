"""Folders of the files that come with the simulation."""

from __future__ import annotations

from pathlib import Path

WORLDS = Path(__file__).parent / "worlds"
PICTURES = Path(__file__).parent / "pictures"
