"""Copies of this process, which continue from the same moment, each in another way."""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import traceback
import warnings
from types import TracebackType

CAN_FORK = sys.platform == "linux"
"""Windows cannot, and libraries of macOS may not be used in a copy."""

_NONE = -1
_SET_PARENT_DEATH_SIGNAL = 1
"""Source: linux/prctl.h."""


class _AllEnded(Exception):
    pass


class Forks:
    """Copies of this process that compute one number each, one copy after the other.

    A context manager: a copy ends with the context or with the original, which leaves it once all copies have ended.

    Attributes:
        results: Results of the copies, in order; in the original.
    """

    def __init__(self) -> None:
        self.results: list[float] = []
        self._pipe = _NONE

    def __enter__(self) -> Forks:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, _: TracebackType | None) -> bool:
        if self._pipe == _NONE:
            return kind is _AllEnded
        if isinstance(error, Exception):  # a Ctrl-C ends the original, too
            traceback.print_exception(error)
        os._exit(error is not None)

    def each(self, number: int) -> int:
        """Return each copy's own number, from 0, in it; the original continues after the context once all have ended.

        Raises:
            RuntimeError: A copy ended without a result, in the original.
        """
        for copy in range(number):
            ours, theirs = os.pipe()
            with warnings.catch_warnings():
                # the warning is about locks that other threads hold; a worker's own thread only waits for its parent
                warnings.simplefilter("ignore", DeprecationWarning)
                process = os.fork()
            if not process:
                ctypes.CDLL(None).prctl(_SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
                os.close(ours)
                self._pipe = theirs
                return copy
            os.close(theirs)
            with os.fdopen(ours) as pipe:
                result = pipe.read()
            os.waitpid(process, 0)
            if not result:
                raise RuntimeError("a copy of the process ended without a result")
            self.results.append(float(result))
        raise _AllEnded

    def send_result(self, result: float) -> None:
        """Send the result of this copy to the original."""
        os.write(self._pipe, repr(result).encode())
