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


def matcher(pattern: str) -> Callable[[str], bool]:
    """Return a test whether names match `pattern`, ignoring case, by the firmware's own rules.

    ``*.*`` matches everything; ``name.*`` names that begin with ``name.``; ``*.ext`` names that contain ``.ext``
    anywhere; any other pattern, including other wildcards, only itself. The firmware finds the wildcard anywhere in
    the pattern, but takes away its last or first character.
    """
    pattern = pattern.lower()
    if "*.*" in pattern:
        return lambda _: True
    if ".*" in pattern:
        prefix = pattern[:-1]
        return lambda name: name.lower().startswith(prefix)
    if "*." in pattern:
        part = pattern[1 : 2 + _EXTENSION]
        return lambda name: part in name.lower()
    return lambda name: name.lower() == pattern


def extension(name: bytes) -> str:
    """Return the extension of a packed name, with its dot, in lower case."""
    text = unpack_name(name)
    return text[text.rfind(".") :].lower() if "." in text else ""
