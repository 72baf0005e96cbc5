"""Ask at the terminal before something happens that cannot be undone."""

from __future__ import annotations

import sys

from firmware_protocol.printable import printable


def can_ask() -> bool:
    """Return whether there is a terminal that shows a question and takes the answer."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr))


def agrees(question: str) -> bool:
    """Ask a question and return whether the answer is yes; Enter alone and Ctrl-D are no."""
    sys.stderr.write(f"{printable(question)} [y/N] ")
    sys.stderr.flush()
    answer = sys.stdin.readline()
    if not answer.endswith("\n"):  # Ctrl-D
        sys.stderr.write("\n")
        return False
    return answer.strip().lower() in ("y", "yes")
