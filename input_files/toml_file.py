"""Read TOML files: missions, worlds, faults; and write keys and strings of TOML."""

from __future__ import annotations

import json
import re
import tomllib
from pathlib import Path
from typing import Any

from input_files.plain import MAX_DEPTH, MEGABYTE, InputFileError, is_too_large, leaves, read_text

MAX_BYTES = MEGABYTE // 4
"""A mission or a world has some thousand bytes."""

SHOWN = 100
"""Characters of a line that a message shows at most."""

LINE_LIMIT = 1000
"""Characters of a line that are searched for a common mistake: some patterns take time by the square of its length."""

REMEDY = "Correct it there."
COMMON_MISTAKES = (
    (r"""^[^#]*["'][^"'#]*\\""", "In a path write / for each \\, or put it between single quotes."),
    (r"^[^#]*[“”„«»‘’]", 'Write plain quotation marks: ".'),
    (r"^[^\[#]*=\s*-?\d+,\d", "Write a decimal point, not a comma."),
    (r"^[^\[#]*=\s*-?\d+(?:\.\d+)?\s*[A-Za-z]+\s*(?:#|$)", "Write the number alone; the key's name says its unit."),
    (r"=\s*(?:True|TRUE|False|FALSE)\b", "Write true or false in small letters."),
    (r"(?i)=\s*(?:yes|no|on|off)\s*(?:#|$)", "Write true or false."),
    (r"^\s*[{]", "It looks like JSON: `nxtdrive mission new FILE` and `nxtdrive world new FILE` write TOML files."),
    (r"^\[[\w.-]+\s*(?:#|$)", "Close the bracket: ]."),
    (r"^\[[^\]\"'#]*\w\s+\w", "Put a name with spaces between quotation marks."),
    (r"^[\w-]+\s*:", "Write key = value, not key: value."),
    (r"""=\s*\[.*["']\s+["']""", "Write a comma between two texts."),
    (r"""=\s*["'][^"']*["']\s*,""", 'Write several values as a list: ["a", "b"].'),
    (
        r"""^(?:\[[^\]"'#]*|[^="'#]*)[^\x00-\x7f]""",
        "Put a name with letters beyond a-z between quotation marks.",
    ),
    (r"""=\s*\[?\s*(?!true\b|false\b)[A-Za-z_][^"'=]*$""", "Put text between quotation marks."),
)
"""Patterns of the line at which reading stops, the likeliest first, and what to do there."""

UNCLOSED = (
    (r"Illegal character '\\n'|Unterminated string|Expected \"'|Expected '\"'", "End the text with a quotation mark."),
    (r"Unclosed array", "Close the list: ]. It may begin in a line above."),
    (r"Unclosed inline table", "Close the brace: }."),
)
"""Patterns of what tomllib says of an end that is missing, and what to do; where it stops may be a later line."""

TOO_LARGE = "it has a whole number of more than 64 bits"

TWICE = re.compile(r"Cannot (?:declare|overwrite)")
"""Begins what tomllib says of a table or a key that is there a second time."""

ONCE = "It is there twice: give one another name, or remove it."

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')"""
_LONG_KEY = re.compile(rf"(?<![\w-]){_PART}(?:[ \t]*+\.[ \t]*+{_PART}){{{MAX_DEPTH}}}")
"""A dotted key of more parts than tables may be deep: tomllib needs memory by the square of their number."""


def read_toml(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file.

    Raises:
        InputFileError: It cannot be read, is too large, is not TOML, or is nested too deeply.
    """
    text = read_text(path, MAX_BYTES)
    try:
        return parse_toml(text)
    except ValueError as error:
        raise InputFileError(f"{path} is not TOML: {error}{_line_of(error, text)}") from None


def _line_of(error: ValueError, text: str) -> str:
    """Return the line that an error of tomllib names, if any, and what to do there."""
    number = re.search(r"\(at line (\d+), column \d+\)$", str(error))
    twice = TWICE.match(str(error))
    unclosed = next((hint for said, hint in UNCLOSED if re.match(said, str(error))), REMEDY)
    if number is None and not twice:
        return f". {unclosed}"
    line = (text.split("\n")[int(number[1]) - 1] if number else text.rstrip().split("\n")[-1]).strip()
    if twice:
        hint = _entries(line[:LINE_LIMIT], text) or ONCE
    else:
        begin = line[:LINE_LIMIT]
        hint = next((hint for mistake, hint in COMMON_MISTAKES if re.search(mistake, begin)), unclosed)
    return f": `{line[:SHOWN]}`. {hint}"


def _entries(line: str, text: str) -> str:
    """Return what to do if a table is there both with one and with two brackets; empty if it is not."""
    name = re.fullmatch(r"\[+[ \t]*([^\[\]]+?)[ \t]*\]+[ \t]*(?:#.*)?", line)
    if name is None:
        return ""
    brackets = {len(each) for each in re.findall(rf"(?m)^[ \t]*+(\[+)[ \t]*{re.escape(name[1])}[ \t]*\]", text)}
    return f"Write each of them with two brackets: [[{name[1]}]]." if len(brackets) > 1 else ""


def toml_string(text: str) -> str:
    """Return a text as a string of TOML: as in JSON, whose escapes of characters beyond U+FFFF TOML does not have."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def toml_key(text: str) -> str:
    """Return a text as a key of TOML, in quotes where it needs them."""
    return text if _BARE_KEY.fullmatch(text) else toml_string(text)


def parse_toml(text: str) -> dict[str, Any]:
    """Read the tables of a text.

    Raises:
        ValueError: It is not TOML, or is nested too deeply.
    """
    if _LONG_KEY.search(text):
        raise ValueError(f"it has a key of more than {MAX_DEPTH} parts")
    try:
        tables = tomllib.loads(text)
    except RecursionError:
        raise ValueError(f"nested more than {MAX_DEPTH} levels deep") from None
    except tomllib.TOMLDecodeError:
        raise
    except ValueError:  # Python reads no number of thousands of digits
        raise ValueError(TOO_LARGE) from None
    if any(is_too_large(each) for each in leaves(tables)):
        raise ValueError(TOO_LARGE)
    return tables
