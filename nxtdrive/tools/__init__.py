"""In a checkout, ``nxtdrive.tools`` is the folder ``tools`` beside this package; an installation puts that one here."""

from pathlib import Path

__path__ = [str(Path(__file__).parents[2] / "tools")]
