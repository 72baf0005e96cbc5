"""Write to files that have no buffer, so that what is written survives a crash of the program."""

from __future__ import annotations

from typing import BinaryIO


def write_all(file: BinaryIO, content: bytes) -> None:
    """Write all of `content`, of which each `write` may take only a part.

    Raises:
        OSError: It cannot be written; a part of it may be in the file.
    """
    left = memoryview(content)
    while left:
        left = left[file.write(left) :]
