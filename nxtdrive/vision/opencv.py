"""OpenCV set up the way this package needs it."""

from __future__ import annotations

import cv2


def configure() -> None:
    """One thread and no chatter; called by whatever opens a camera or makes a detector, and harmless to repeat.

    One thread keeps results and times repeatable and leaves the other cores to other programs; the detectors gain
    little from more (docs/vision.md). What OpenCV would print about cameras, our errors say.
    """
    cv2.setNumThreads(1)
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
