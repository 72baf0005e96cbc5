"""Configures OpenCV for this package."""

from __future__ import annotations

import os

import cv2

FFMPEG_LOG = "OPENCV_FFMPEG_LOGLEVEL"
"""Environment variable with the level of FFmpeg's log, -8 (nothing) to 56 (all); a level that the user sets is kept."""


def configure() -> None:
    """Set one thread and no log output; called before cameras and detectors are made, may be repeated.

    One thread keeps results and times repeatable and leaves the other cores to other programs; the detectors gain
    little from more (docs/vision.md). What OpenCV and its FFmpeg would print about cameras, our
    errors say.
    """
    os.environ.setdefault(FFMPEG_LOG, "-8")  # AV_LOG_QUIET; read when the first video or stream is opened
    cv2.setNumThreads(1)
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
