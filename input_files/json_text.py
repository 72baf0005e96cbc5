"""Read JSON objects: the lines of journals, traces, recordings and results of sweeps."""

from __future__ import annotations

import json
import math
from typing import Any

from input_files.plain import MEGABYTE, is_too_large, leaves

MAX_BYTES = 100 * MEGABYTE
"""For files of JSON lines: the journal of a day, or several full sweeps."""


def parse_object(text: str) -> dict[str, Any]:
    """Parse a JSON object.

    Raises:
        ValueError: It is not JSON, not an object, nested too deeply, or has a number that is not finite or needs more
            than 64 bits.
    """
    try:
        value = json.loads(text)
    except RecursionError:
        value = None
    if not isinstance(value, dict):
        raise ValueError("not a JSON object")  # noqa: TRY004 - as for text that is not JSON
    if any(is_too_large(each) or (isinstance(each, float) and not math.isfinite(each)) for each in leaves(value)):
        raise ValueError("a number is not finite or needs more than 64 bits")
    return value
