"""Load the ONNX model named on the command line and look with it once; exit code 0 if that works.

A program of its own: runtimes check little, and a damaged model may crash or exhaust the process that loads it.
"""

import json
import sys
from pathlib import Path

import numpy as np

from firmware_protocol.errors import ConfigError
from nxtdrive.vision.detectors.onnx_isolation import REFUSED
from nxtdrive.vision.detectors.onnx_model import OnnxModel, Options
from nxtdrive.vision.detectors.trial import limit_this_process
from nxtdrive.vision.opencv import configure


def main() -> int:
    """Try it; what is wrong goes to standard output, as a list of message and remedy."""
    limit_this_process()
    configure()
    noise = np.random.default_rng(0).integers(0, 256, (240, 320, 3), np.uint8)
    try:
        OnnxModel(Path(sys.argv[1]), Options(**json.loads(sys.argv[2]))).places(noise)
    except ConfigError as error:
        sys.stdout.write(json.dumps([error.args[0], error.remedy]))
        return REFUSED
    return 0


if __name__ == "__main__":
    sys.exit(main())
