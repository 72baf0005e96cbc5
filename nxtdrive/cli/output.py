"""Standard output of a program that goes on when its reader has left, as `head` does."""

from __future__ import annotations

import contextlib
import os
import sys


def print_line(text: str) -> None:
    """Print a line at once; once the reader has left, print nothing.

    Raises:
        OSError: The line cannot be written for another reason, such as a full disk; further lines are dropped.
    """
    try:
        print(text, flush=True)
    except BrokenPipeError:
        drop_output()
    except OSError:
        drop_output()
        raise


def drop_output() -> None:
    """Let standard output, with what is still buffered, lead nowhere; else Python complains when it ends."""
    with contextlib.suppress(OSError):  # a stream without a file has nothing buffered
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
