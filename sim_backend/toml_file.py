"""Read TOML files into pydantic models, and report all mistakes of a file at once."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from firmware_protocol.errors import ConfigError
from input_files.mistakes import excerpt, hint, key_path, listed
from input_files.plain import InputFileError
from input_files.pydantic_words import words
from input_files.toml_file import read_toml

Model = TypeVar("Model", bound=BaseModel)

_QUOTE = "'"


def read_tables(path: Path) -> dict[str, Any]:
    """Read the tables of a TOML file.

    Raises:
        ConfigError: The file cannot be read, or is not TOML.
    """
    try:
        return read_toml(path)
    except InputFileError as error:
        raise ConfigError(str(error)) from None


def validate(model: type[Model], tables: Mapping[str, Any], path: Path) -> Model:
    """Validate tables as a model.

    Args:
        model: The pydantic model.
        tables: The tables as `read_tables` returns them.
        path: The file, for messages.

    Raises:
        ConfigError: They have mistakes; the message lists all of them.
    """
    valid, problems = check(model, tables)
    if valid is None:
        raise mistakes(path, [problem.sentence for problem in problems])
    return valid


@dataclass(frozen=True, slots=True)
class Problem:
    """A mistake in tables.

    Attributes:
        kind: Pydantic's name of the kind.
        location: Keys and indices that lead to it.
        sentence: Path and mistake in words.
    """

    kind: str
    location: tuple[str | int, ...]
    sentence: str


def check(model: type[Model], tables: Mapping[str, Any]) -> tuple[Model | None, list[Problem]]:
    """Validate tables as a model; returns the model, or None and all problems."""
    try:
        return model.model_validate(tables), []
    except ValidationError as error:
        problems = error.errors(include_url=False)
        return None, [Problem(each["type"], each["loc"], _sentence(model, each)) for each in problems]


def mistakes(path: Path, sentences: Sequence[str]) -> ConfigError:
    """Return the error that lists the mistakes."""
    number, *lines = listed(len(sentences), sentences)
    return ConfigError("\n  ".join([f"{path} has {number}:", *lines]))


def _sentence(model: type[BaseModel], error: ErrorDetails) -> str:
    table, location = _walk(model, error["loc"])
    path = key_path(location)
    match error["type"]:
        case "extra_forbidden":
            return f"{path}: there is no such key; {hint(str(location[-1]), table.model_fields)}"
        case "missing":
            writes = "; `nxtdrive world new FILE` writes a world with all it needs" if len(location) == 1 else ""
            return f"{path}: is missing{writes}"
        case "union_tag_not_found":
            return f"{path}.{error['ctx']['discriminator'].strip(_QUOTE)}: is missing"
        case "union_tag_invalid":
            tag, key = error["ctx"]["tag"], error["ctx"]["discriminator"].strip(_QUOTE)
            known = [name.strip(_QUOTE) for name in error["ctx"]["expected_tags"].split(", ")]
            return f"{path}.{key}: there is no {excerpt(tag)}; {hint(tag, known)}"
        case "value_error":
            return f"{path}: {error['ctx']['error']}"
        case "tuple_type" if len(location) == 1:
            return f"{path}: write each entry as a table of its own, with two brackets: [[{path}]]"
    message = words(error["type"], error.get("ctx", {}), error["msg"], error["input"])
    return f"{path}: {message}, not {excerpt(error['input'])}"


def _walk(model: type[BaseModel], location: tuple[str | int, ...]) -> tuple[type[BaseModel], list[str | int]]:
    """Return the table of a mistake, and its path as written in the file.

    For discriminated unions, pydantic puts the tag into the location.
    """
    path: list[str | int] = []
    kinds: list[type[BaseModel]] = []
    for part in location:
        if chosen := [kind for kind in kinds if _is_kind(kind, part)]:
            model, kinds = chosen[0], []
            continue
        path.append(part)
        if isinstance(part, str) and part in model.model_fields:
            field = model.model_fields[part]
            kinds = list(_tables(field.annotation))
            model = kinds[0] if len(kinds) == 1 else model
    return model, path


def _is_kind(model: type[BaseModel], tag: str | int) -> bool:
    return any(get_args(field.annotation) == (tag,) for field in model.model_fields.values())


def _tables(annotation: object) -> Iterator[type[BaseModel]]:
    """Yield all models in a type annotation."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for part in get_args(annotation):
        yield from _tables(part)
