"""Standard output of a program that goes on when its reader has left, as `head` does."""

from __future__ import annotations

import contextlib
import io
import os
import sys

from firmware_protocol.errors import ConfigError


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


def finish_output() -> None:
    """Write what is still buffered.

    Raises:
        BrokenPipeError: The reader has left.
        ConfigError: It cannot be written, as on a full disk; it is dropped.
    """
    try:
        if sys.stdout is not None:  # closed when the program began
            sys.stdout.flush()
    except BrokenPipeError:
        drop_output()
        raise
    except OSError as error:
        drop_output()
        raise ConfigError(
            f"standard output cannot be written ({error.strerror}).", remedy="Send it somewhere else."
        ) from None


def escape_unprintable() -> None:
    """Let both outputs escape what their encoding lacks, such as bytes in a file's name that are not UTF-8."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")


def drop_output() -> None:
    """Let standard output, with what is still buffered, lead nowhere; else Python complains when it ends."""
    with contextlib.suppress(OSError):  # a stream without a file has nothing buffered
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
