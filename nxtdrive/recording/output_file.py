"""Write files as a whole or not at all."""

from __future__ import annotations

import errno
import os
import secrets
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import numpy.typing as npt

from firmware_protocol.errors import ConfigError
from input_files.plain import is_utf_8
from nxtdrive.host.unbuffered import write_all


def write_file(path: Path, content: bytes) -> None:
    """Write a file; after an error, as on a full disk, the incomplete file is removed.

    Raises:
        OSError: It cannot be written.
    """
    with open(path, "wb", buffering=0) as file:
        try:
            write_all(file, content)
        except OSError:
            if os.path.isfile(path):  # not a device
                with suppress(OSError):
                    path.unlink()
            raise


def draft_path(path: Path, suffix: str) -> Path:
    """Return the path of a new hidden file beside another one, with the given suffix."""
    return path.with_name(f".draft-{secrets.token_hex(8)}{suffix}")


@contextmanager
def draft(path: Path, content: bytes) -> Iterator[Path]:
    """Write a hidden file beside another one, which may exist, to check it and then replace that one with it.

    Args:
        path: The other file. The draft has its suffix, and its permissions if it exists.
        content: What the draft has.

    Yields:
        The draft; it is removed afterwards if it is still there.

    Raises:
        OSError: It cannot be written.
    """
    beside = draft_path(path, path.suffix)
    try:
        write_file(beside, content)
        if path.exists():
            shutil.copymode(path, beside)
        yield beside
    finally:
        beside.unlink(missing_ok=True)


def check_replaceable(path: Path) -> None:
    """Refuse to replace what is there if it is a device or a pipe, which would be lost, or a folder.

    Raises:
        OSError: It is.
    """
    if os.path.exists(path) and not os.path.isfile(path):
        raise OSError(errno.EINVAL, "it is not a regular file", str(path))


def replace_file(path: Path, content: bytes) -> None:
    """Write a file as a whole, in place of one that exists, which an error or a signal leaves as it is.

    A symbolic link stays; the file that it leads to is replaced.

    Raises:
        OSError: It cannot be written, or is not a regular file.
    """
    path = Path(os.path.realpath(path))  # `Path.resolve` raises no OSError for links that lead to each other
    check_replaceable(path)
    with draft(path, content) as beside:
        beside.replace(path)


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Wait for the lock of a folder and hold it, so that one process at a time reads and replaces a file in it."""
    if sys.platform == "win32":  # cannot open a folder
        yield
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        lock(handle, wait=True)
        yield
    finally:
        os.close(handle)


def lock(handle: int, *, wait: bool) -> bool:
    """Lock what is open until it is closed, also by the end of the process; return False if another one has the lock.

    Windows and some network file systems have no such locks; there every process gets it.
    """
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(handle, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def write_image(path: Path, image: npt.NDArray[np.uint8]) -> None:
    """Write an image file.

    Args:
        path: Its suffix chooses the format.
        image: BGR.

    Raises:
        ConfigError: No format has this suffix.
        OSError: It cannot be written.
    """
    import cv2

    try:
        # OpenCV crashes at a suffix that is not UTF-8
        coded, data = cv2.imencode(path.suffix, image) if is_utf_8(path.suffix) else (False, image)
    except cv2.error:
        coded = False
    if not coded:
        raise ConfigError(f"{path} cannot be written: no image format ends in {path.suffix!r}.", remedy="Use .png.")
    write_file(path, data.tobytes())
