"""What the value of a key must be, in words, where pydantic speaks of inputs and types."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

from input_files.plain import is_number

LONGEST_EXAMPLE = 60
"""A longer text is no readable example."""

NUMBER = re.compile(r"[+-]?\d+(?:[.,]\d+)?", re.ASCII)

WORDS = {
    "greater_than": "must be more than {gt}",
    "greater_than_equal": "must be {ge} or more",
    "less_than": "must be less than {lt}",
    "less_than_equal": "must be {le} or less",
    "finite_number": "must be a finite number",
    "float_type": "must be a number",
    "float_parsing": "must be a number",
    "int_type": "must be a whole number",
    "int_parsing": "must be a whole number",
    "int_parsing_size": "must be a whole number with fewer digits",
    "int_from_float": "must be a whole number",
    "bool_type": "must be true or false",
    "bool_parsing": "must be true or false",
    "string_type": "must be text in quotes",
    "string_too_short": "must not be empty",
    "string_too_long": "must have at most {max_length} characters",
    "list_type": "must be a list in brackets, as in [1, 2]",
    "tuple_type": "must be a list in brackets, as in [1200, 800]",
    "path_type": "must be a file name in quotes",
    "multiple_of": "must be a multiple of {multiple_of}",
    "model_type": "must be a table",
    "model_attributes_type": "must be a table",
    "dict_type": "must be a table",
    "too_short": "must not be empty",
    "too_long": "must have at most {max_length} entries",
    "literal_error": "must be {expected}",
    "date_type": "must be a date, as 2026-01-31",
    "date_parsing": "must be a date, as 2026-01-31",
    "date_from_datetime_parsing": "must be a date, as 2026-01-31",
    "date_from_datetime_inexact": "must be a date, as 2026-01-31",
    "missing": "is missing",
    "extra_forbidden": "is unknown",
    "union_tag_not_found": "{discriminator} is missing",
    "union_tag_invalid": "{discriminator} must be one of {expected_tags}, not '{tag}'",
}
"""By pydantic's name of the kind of mistake, with its context to be filled in."""

OBJECT_KINDS = ("model_type", "model_attributes_type", "dict_type")
"""What is a table in TOML is an object in JSON."""


def first_mistake(mistakes: Sequence[Mapping[str, Any]]) -> str:
    """Return where the first of pydantic's `mistakes` in a JSON object is, such as ``a.b``, and what is wrong.

    Args:
        mistakes: As pydantic's ``ValidationError.errors()`` returns them; for one without a place only what is wrong.
    """
    first = mistakes[0]
    where, kind = ".".join(map(str, first["loc"])), first["type"]
    wrong = "must be an object" if kind in OBJECT_KINDS else words(kind, first.get("ctx", {}), first["msg"])
    return f"{where}: {wrong}" if where else wrong


def words(kind: str, context: Mapping[str, object], message: str, value: object = None) -> str:
    """Return what is wrong with a value.

    Args:
        kind: Pydantic's name of the kind of mistake.
        context: Its numbers.
        message: Pydantic's own message, for kinds that are not listed.
        value: The value; a text that should be a list is shown in its brackets, and of one that should be a number it
            is said if it is one in quotation marks.
    """
    if kind == "list_type" and isinstance(value, str) and len(value) <= LONGEST_EXAMPLE:
        return f"must be a list in brackets, as in [{json.dumps(value, ensure_ascii=False)}]"
    if kind in ("float_type", "int_type") and isinstance(value, str) and NUMBER.fullmatch(value):
        return f"{WORDS[kind]} without quotation marks"
    text = WORDS.get(kind)
    if text is None:
        return message.removeprefix("Value error, ")
    return text.format(**{name: _plain(each) for name, each in context.items()})


def _plain(value: object) -> object:
    """Return a limit with six digits, and a million without an exponent; anything else as it is."""
    if not is_number(value):
        return value
    short = f"{value:g}"
    return f"{value:.0f}" if "e+" in short else short
