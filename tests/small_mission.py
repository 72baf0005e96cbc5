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
