"""Load the cascade named on the command line and look with it once; exit code 0 if that works.

A program of its own, because OpenCV checks little and a damaged cascade may crash or exhaust the process that loads it.
"""

import sys

import cv2
import numpy as np

from nxtdrive.vision.detectors.trial import limit_this_process


def main() -> int:
    """Try it."""
    limit_this_process()
    cv2.setNumThreads(1)
    classifier = cv2.CascadeClassifier()
    if not classifier.load(sys.argv[1]):
        return 1
    classifier.detectMultiScale2(np.random.default_rng(0).integers(0, 256, (240, 320), np.uint8))
    return 0


if __name__ == "__main__":
    sys.exit(main())
