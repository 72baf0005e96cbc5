"""Load the cascade named on the command line and look with it once; exit code 0 if that works.

A program of its own, because OpenCV checks little and a damaged cascade may crash or exhaust the process that loads it.
"""

import sys

import cv2
import numpy as np

MOST_MEMORY = 4_000_000_000
"""Address space of this process, bytes."""


def main() -> int:
    """Try it."""
    try:
        import resource
    except ImportError:  # Windows
        pass
    else:
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        hard = resource.getrlimit(resource.RLIMIT_AS)[1]
        most = MOST_MEMORY if hard == resource.RLIM_INFINITY else min(MOST_MEMORY, hard)
        resource.setrlimit(resource.RLIMIT_AS, (most, hard))
    cv2.setNumThreads(1)
    classifier = cv2.CascadeClassifier()
    if not classifier.load(sys.argv[1]):
        return 1
    classifier.detectMultiScale2(np.random.default_rng(0).integers(0, 256, (240, 320), np.uint8))
    return 0


if __name__ == "__main__":
    sys.exit(main())
