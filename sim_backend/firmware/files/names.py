"""Fields of 20 bytes for names, and patterns of names. Source: docs/firmware.md section 5, "File system"."""

from __future__ import annotations

from collections.abc import Callable

NAME_SIZE = 20
"""Bytes of a file name's field."""

NAME_LIMIT = 19
"""Longest name; the field's last byte must be zero."""

_EXTENSION = 3


def pack_name(name: str) -> bytes:
    """Return the field for a name, padded with zeros."""
    return name.encode("latin-1").ljust(NAME_SIZE, b"\0")


def unpack_name(field: bytes) -> str:
    """Return the text of a field up to the first zero."""
    return field.split(b"\0")[0].decode("latin-1")


def fold(name: str) -> str:
    """Return a name for comparisons: the firmware ignores case only in ASCII letters."""
    return name.encode("latin-1").lower().decode("latin-1")


def looked_for(pattern: str) -> str:
    """Return the text that the firmware looks for: a pattern without its last or first character, in lower case."""
    pattern = fold(pattern)
    if ".*" in pattern:
        return pattern if "*.*" in pattern else pattern[:-1]
    return pattern[1 : 2 + _EXTENSION] if "*." in pattern else pattern


def matcher(pattern: str) -> Callable[[str], bool]:
    """Return a test whether names match `pattern`, ignoring case, by the firmware's own rules.

    ``*.*`` matches everything; ``name.*`` names that begin with ``name.``; ``*.ext`` names that contain ``.ext``
    anywhere; any other pattern, including other wildcards, only itself. The wildcard may be anywhere in the pattern.
    """
    text = looked_for(pattern)
    if "*.*" in pattern:
        return lambda _: True
    if ".*" in pattern:
        return lambda name: fold(name).startswith(text)
    if "*." in pattern:
        return lambda name: text in fold(name)
    return lambda name: fold(name) == text


def extension(name: bytes) -> str:
    """Return the extension of a packed name, with its dot, in lower case; of a name without an end there is none."""
    text, end, _ = name.partition(b"\0")
    return text[text.rfind(b".") :].lower().decode("latin-1") if end and b"." in text else ""
