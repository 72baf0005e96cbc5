"""Make text from outside safe to print: names on a brick, lines of a client, files, device names, error messages.

A terminal interprets control characters, and a line feed in a name forges a line of output. Every program of this
project passes such text through `printable` before it prints it.
"""

from __future__ import annotations

import re

_BIDI = "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"
"""Marks and overrides that reorder the text around them (Unicode Standard Annex 9)."""

_SEPARATORS = "\u2028\u2029"
_SURROGATES = "\ud800-\udfff"
"""Halves of a character: bytes of a file name that are not UTF-8. No encoding takes them."""

_HIDDEN = re.compile(f"[\x00-\x1f\x7f-\x9f{_BIDI}{_SEPARATORS}{_SURROGATES}]")


def printable(text: object) -> str:
    r"""Return the text on one line, with visible escapes for what a terminal would interpret or could not show.

    Control characters, line and paragraph separators, marks of the writing direction and lone surrogates become
    ``\n``, ``\x1b``, ``\u202e`` and the like. All other text stays as it is, whatever its script.
    """
    return _HIDDEN.sub(_escaped, str(text))


def printable_lines(text: object) -> str:
    """Return the text as `printable` does, but keep its line feeds; for text whose lines are ours."""
    return "\n".join(map(printable, str(text).split("\n")))


def _escaped(match: re.Match[str]) -> str:
    return match[0].encode("unicode_escape").decode("ascii")
