"""A minimal mission; in the world `open` it ends soon."""

MISSION = """
[mission]
name = "small"
targets = ["lena"]
[target.lena]
detector = "picture"
pictures = ["lena.png"]
"""
