"""Put the mistakes of a file into words."""

from __future__ import annotations

import difflib
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import islice

SHOWN = 20
"""Mistakes that are listed; the others are counted."""
LONGEST = 400
LONGEST_VALUE = 80
MAX_KNOWN = 100
"""Among more names the nearest is not looked for: a file of thousands of wrong names would take minutes."""

KEY_ITSELF = "[key]"
"""Pydantic's last part of the location of a mistake in a key."""

_MORE = re.compile(r"and (\d+) more")


class MistakesError(ValueError):
    """A file that cannot be used.

    Attributes:
        message: What is wrong with it, or how many mistakes it has.
        mistakes: Its mistakes, each with its path in the file; none where the message says it all.
    """

    def __init__(self, message: str, mistakes: Sequence[str] = ()) -> None:
        super().__init__(message, mistakes)
        self.message = message
        self.mistakes = mistakes

    def __str__(self) -> str:
        return "\n  ".join([self.message, *self.mistakes])


def listed(count: int, problems: Iterable[str]) -> list[str]:
    """Return the number of mistakes in words, then the first of them, one per line.

    Args:
        count: How many there are.
        problems: All of them; only the first 20 are taken.
    """
    first = [_cut(each, LONGEST) for each in islice(problems, SHOWN)]
    more = [f"and {count - len(first)} more"] if count > len(first) else []
    return [_in_words(count), *first, *more]


def counted(lines: Iterable[str]) -> str:
    """Return in words how many mistakes there are, by the lines of `listed` after the first."""
    return _in_words(sum(int(more[1]) if (more := _MORE.fullmatch(line)) else 1 for line in lines))


def _in_words(count: int) -> str:
    return "1 mistake" if count == 1 else f"{count} mistakes"


def key_path(location: Iterable[str | int]) -> str:
    """Return where in a file a key is, such as ``boxes[2].at_mm``.

    Args:
        location: The keys and indices that lead to it, as pydantic gives them.
    """
    parts = (part for part in location if part != KEY_ITSELF)
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts).lstrip(".")


def nearest(name: str, known: Collection[str]) -> str:
    """Return the known name that is most like another one; empty if none is, or there are more than 100."""
    close = difflib.get_close_matches(name, known, n=1) if len(known) <= MAX_KNOWN else []
    return close[0] if close else ""


def is_foreign(tables: Mapping[str, object], known: Collection[str]) -> bool:
    """Return whether the tables are those of another program's file: several, none with a known name or nearly one."""
    named = [name for name, table in tables.items() if isinstance(table, dict | list)]
    return len(named) == len(tables) > 1 and not any(nearest(name, known) for name in named)


def hint(name: str, known: Collection[str]) -> str:
    """Suggest the known name that is most like another one, or list the known ones."""
    near = nearest(name, known)
    more = ["..."] if len(known) > MAX_KNOWN else []
    return f"did you mean {near!r}?" if near else f"known here: {', '.join([*islice(known, MAX_KNOWN), *more])}"


def excerpt(value: object) -> str:
    """Return the value as Python writes it, but true and false as TOML does; it is cut if it is long."""
    return _cut(str(value).lower() if isinstance(value, bool) else repr(value), LONGEST_VALUE)


def _cut(text: str, length: int) -> str:
    return text if len(text) <= length else text[: length - 3] + "..."
