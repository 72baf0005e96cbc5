"""Reading TOML files into pydantic models, with every mistake in a file said at once."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeGuard, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from firmware_protocol.errors import ConfigError

Model = TypeVar("Model", bound=BaseModel)


def read_tables(path: Path) -> dict[str, Any]:
    """The tables of a TOML file.

    Raises:
        ConfigError: It cannot be read, or is not TOML.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path} is not TOML: {error}.") from error
    except OSError as error:
        raise ConfigError(f"{path} cannot be read: {error.strerror}.") from error


def validate(model: type[Model], tables: Mapping[str, Any], path: Path) -> Model:
    """The tables as a model.

    Args:
        model: What they should be.
        tables: As `read_tables` returns them.
        path: The file, for messages.

    Raises:
        ConfigError: They have mistakes; the message lists all of them.
    """
    try:
        return model.model_validate(tables)
    except ValidationError as error:
        raise mistakes(path, [_sentence(model, each) for each in error.errors(include_url=False)]) from None


def mistakes(path: Path, sentences: Sequence[str]) -> ConfigError:
    """The error that lists them all."""
    count = "1 mistake" if len(sentences) == 1 else f"{len(sentences)} mistakes"
    return ConfigError("\n  ".join([f"{path} has {count}:", *sentences]))


def _sentence(model: type[BaseModel], error: ErrorDetails) -> str:
    location = error["loc"]
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    if error["type"] == "extra_forbidden":
        known = list(_model_at(model, location[:-1]).model_fields)
        near = difflib.get_close_matches(str(location[-1]), known, n=1)
        hint = f"did you mean {near[0]}?" if near else f"known here: {', '.join(known)}"
        return f"{path}: there is no such key; {hint}"
    if error["type"] == "missing":
        return f"{path}: is missing"
    if error["type"] == "value_error":
        return f"{path}: {error['ctx']['error']}"
    return f"{path}: {error['msg'][0].lower()}{error['msg'][1:]}, not {error['input']!r}"


def _model_at(model: type[BaseModel], location: tuple[str | int, ...]) -> type[BaseModel]:
    for part in location:
        if isinstance(part, str):
            annotation = model.model_fields[part].annotation
            model = next(kind for kind in (annotation, *get_args(annotation)) if _is_model(kind))
    return model


def _is_model(kind: object) -> TypeGuard[type[BaseModel]]:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
