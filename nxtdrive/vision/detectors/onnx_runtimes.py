"""Run ONNX models: with ONNX Runtime where it is installed, otherwise with OpenCV's own reader.

Both take and return arrays by name: OpenCV returns outputs in another order, drops integer types, and adds or removes
dimensions of size 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Protocol

import cv2
import numpy as np
from numpy.typing import NDArray

from firmware_protocol.errors import ConfigError
from nxtdrive.host.environment import install_extra
from nxtdrive.vision.opencv import opencv_name

Arrays = Mapping[str, NDArray[Any]]

ONNXRUNTIME, OPENCV = "onnxruntime", "opencv"
RUNTIMES = (ONNXRUNTIME, OPENCV)

ONLY_FATAL = 4
"""ONNX Runtime's level of logging at which it prints nothing that its exceptions say."""

LONGEST_REASON = 300


class Runtime(Protocol):
    """A model that was loaded.

    Attributes:
        title: The runtime and its version.
    """

    title: str

    def run(self, inputs: Arrays) -> Arrays:
        """Return the outputs by name.

        Raises:
            ConfigError: The model cannot be run.
        """
        ...


def load(path: Path, runtime: str | None = None) -> Runtime:
    """Load a model.

    Args:
        path: The file.
        runtime: One of `RUNTIMES`; by default ONNX Runtime if it is installed.

    Raises:
        ConfigError: The runtime is not installed, or it cannot load the model.
    """
    installed = find_spec("onnxruntime") is not None
    if runtime == ONNXRUNTIME and not installed:
        raise ConfigError("onnxruntime is not installed.", remedy=f"Install it: {install_extra('onnx')}")
    return _OpenCv(path, installed) if runtime == OPENCV or not installed else _OnnxRuntime(path)


class _OnnxRuntime:
    def __init__(self, path: Path) -> None:
        import onnxruntime

        self.title = f"onnxruntime {onnxruntime.__version__}"
        self._path = path
        options = onnxruntime.SessionOptions()
        options.intra_op_num_threads = options.inter_op_num_threads = 1
        options.log_severity_level = ONLY_FATAL
        try:
            # its fallback would print to standard output, and try the same again
            self._session = onnxruntime.InferenceSession(
                str(path), options, providers=["CPUExecutionProvider"], enable_fallback=0
            )
        except Exception as error:  # of many types, which have no common base
            raise _cannot("load", path, self.title, error, "Export the model again.") from error

    def run(self, inputs: Arrays) -> Arrays:
        try:
            names = [one.name for one in self._session.get_outputs()]
            values: Sequence[Any] = self._session.run(names, dict(inputs))
        except Exception as error:
            raise _cannot("run", self._path, self.title, error, "Export the model again.") from error
        return {name: value for name, value in zip(names, values, strict=True) if isinstance(value, np.ndarray)}


class _OpenCv:
    def __init__(self, path: Path, other: bool) -> None:
        self.title = f"OpenCV {cv2.__version__}"
        self._path = path
        install = f"Install ONNX Runtime, which reads more models: {install_extra('onnx')}"
        self._remedy = 'Use runtime = "onnxruntime".' if other else install
        name = opencv_name(path, ConfigError)
        try:
            self._net = cv2.dnn.readNetFromONNX(name)
            self._names = list(self._net.getUnconnectedOutLayersNames())
        except Exception as error:  # besides its own, those of names that are not text
            raise _cannot("load", path, self.title, error, self._remedy) from error

    def run(self, inputs: Arrays) -> Arrays:
        try:
            for name, value in inputs.items():
                self._net.setInput(value.astype(np.float32), name)
            return dict(zip(self._names, self._net.forward(self._names), strict=True))
        except Exception as error:  # besides its own, those of names that are not text
            raise _cannot("run", self._path, self.title, error, self._remedy) from error


def _cannot(do: str, path: Path, runtime: str, error: Exception, remedy: str) -> ConfigError:
    reason = " ".join(str(error).split())
    if len(reason) > LONGEST_REASON:
        reason = "... " + reason[-LONGEST_REASON:].partition(" ")[2]
    return ConfigError(f"{runtime} cannot {do} {path}: {reason or type(error).__name__}", remedy=remedy)
