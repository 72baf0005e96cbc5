"""Configure OpenCV for this package, and check the names that it is given."""

from __future__ import annotations

import os
from pathlib import Path

import cv2

from firmware_protocol.errors import NXTError
from input_files.plain import is_utf_8

FFMPEG_LOG = "OPENCV_FFMPEG_LOGLEVEL"
"""Environment variable with the level of FFmpeg's log, -8 (nothing) to 56 (all); a level that the user sets is kept."""


def configure() -> None:
    """Set one thread and no log output; called before cameras, detectors and videos are made, may be repeated.

    One thread keeps results and times repeatable and leaves the other cores to other programs; the detectors gain
    little from more (docs/vision.md). Our errors report what OpenCV and its FFmpeg would print.
    """
    os.environ.setdefault(FFMPEG_LOG, "-8")  # AV_LOG_QUIET; read when the first video or stream is opened
    cv2.setNumThreads(1)
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


def opencv_name(name: str | Path, error: type[NXTError]) -> str:
    """Return the name of a file or stream as OpenCV takes it.

    Raises:
        NXTError: It is not UTF-8, at which OpenCV would crash; of the given type.
    """
    if not is_utf_8(name):
        raise error(f"{name} is not a name in UTF-8, which OpenCV needs.", remedy="Give it another name.")
    return str(name)
