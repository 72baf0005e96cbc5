"""Report files that cannot be written."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from firmware_protocol.errors import ConfigError

WRITABLE_FILE = "Choose a file that you may write, in an existing folder with free space."
"""What to do when a file cannot be written."""


@contextmanager
def writing(path: Path, remedy: str = WRITABLE_FILE) -> Iterator[None]:
    """Turn an `OSError` of the block, which writes `path`, into a `ConfigError`."""
    try:
        yield
    except OSError as error:
        raise ConfigError(f"{path} cannot be written ({error.strerror or error}).", remedy=remedy) from error
