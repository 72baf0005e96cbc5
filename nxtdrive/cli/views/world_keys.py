"""The tables and keys of a world file, as text."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import get_args

from nxtdrive.cli.templates.mission import meanings
from sim_backend.world.toml_types import Table
from sim_backend.world.world_file import WorldFile


def world_keys() -> str:
    """Return every table with each key, its default and its meaning, a key per line."""
    lines = ["title = TEXT at the top describes the room. Lengths in mm, angles in degrees clockwise, times in s."]
    for name, field in WorldFile.model_fields.items():
        several = field.default == ()
        for model in _tables(field.annotation):
            lines += _described(f"[[{name}]]" if several else f"[{name}]", name, model)
    return "\n".join(lines)


def _tables(annotation: object) -> Iterator[type[Table]]:
    """Yield the tables in a type, such as those of a union or of a list."""
    if isinstance(annotation, type) and issubclass(annotation, Table):
        yield annotation
    for each in get_args(annotation):
        yield from _tables(each)


def _described(title: str, name: str, model: type[Table]) -> Iterator[str]:
    """Yield the lines of a table, and those of the tables in it."""
    yield from ("", f"{title}  {(model.__doc__ or '').splitlines()[0]}")
    about, inner = meanings(model), []
    for key, field in model.model_fields.items():
        values = [each for each in get_args(field.annotation) if isinstance(each, str)]
        value = None if field.is_required() else field.get_default(call_default_factory=True)
        written = "" if value is None or isinstance(value, Table) else json.dumps(value)
        default = "required" if field.is_required() else written
        yield f"  {key:<24} {default:<15} {about.get(key) or ', '.join(values)}".rstrip()
        inner += [(f"[{name}.{key}]", f"{name}.{key}", each) for each in _tables(field.annotation)]
    for each in inner:
        yield from _described(*each)
