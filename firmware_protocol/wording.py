"""Words for messages: numbers of things, and what a mistyped name may mean."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches


def number_of(count: int, thing: str) -> str:
    """Return "1 file" or "2 files"."""
    return f"{count} {thing}" if count == 1 else f"{count} {thing}s"


def did_you_mean(word: str, known: Iterable[str], most: int = 1) -> str:
    """Return "Did you mean 'x'?" with the `most` most similar known names; empty if there are none."""
    close = get_close_matches(word, list(known), n=most)
    return f"Did you mean {' or '.join(map(repr, close))}?" if close else ""
