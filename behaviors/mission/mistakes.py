"""Mistakes in a mission file, in words: where each one is, and what to do about it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, get_args

from pydantic import BaseModel, ValidationError

from behaviors.detector_names import detector_names
from behaviors.profile_names import named_profiles
from input_files.mistakes import excerpt, hint, key_path, nearest
from input_files.pydantic_words import words
from input_files.toml_file import toml_key

UNITS = {
    "_mm": "millimetres",
    "_s": "seconds",
    "_deg": "degrees",
    "_mm_s": "millimetres per second",
    "_deg_s": "degrees per second",
    "_percent": "percent",
}
"""What the endings of keys mean."""
NO_TABLE = ("model_type", "model_attributes_type", "dict_type", "union_tag_not_found")
"""Kinds of error of something that must be a table."""
FOLLOWS = "default_factory_not_called"
"""Kind of the error of a key whose default depends on other keys, of which one has a mistake of its own."""
ELSEWHERE = {
    "width_mm": "leave it out: the height is enough",
    **dict.fromkeys(("source", "device"), "name it with --camera, as in --camera 0"),
    **dict.fromkeys(("nxt", "address"), "name it with --nxt, as in --nxt usb://"),
}
"""Keys that people write into a mission and that no mission has, and what to do instead."""
INSTALL = "install its package"
DETECTOR_OF = {
    "pictures": "picture",
    "cascade": "haar",
    "id": "marker",
    "text": "qr",
    "color": "color",
    "model": "onnx",
}
"""The detector that a key belongs to, which is more likely meant than one with a similar name."""


def mistake_count(error: ValidationError) -> int:
    """Return how many mistakes `mistakes` yields."""
    return sum(problem["type"] != FOLLOWS for problem in error.errors())


def mistakes(error: ValidationError, model: type[BaseModel]) -> Iterator[str]:
    """Yield one line for each mistake.

    Args:
        error: What the check of the file found.
        model: What it was checked against.
    """
    for problem in error.errors():
        if problem["type"] != FOLLOWS:
            path = list(problem["loc"])
            # the tag of the union, which is in no path of the file
            detector = path.pop(2) if len(path) > 2 and path[0] == "target" else None
            yield f"{key_path(path)}: {_message(problem, path, detector, model)}"


def _message(problem: Mapping[str, Any], path: Sequence[int | str], detector: object, model: type[BaseModel]) -> str:
    kind, value, where = problem["type"], problem["input"], key_path(path)
    if kind == "extra_forbidden":
        return _unknown(path, value, detector, model)
    if kind == "union_tag_not_found" and isinstance(value, dict):
        return _detector_advice(value)
    if kind in NO_TABLE:
        if where == "target":
            return f"it must be a table with a name, [target.NAME], not {excerpt(value)}"
        if path[:-1] == ["target"] and path[-1] in _known_keys(["target", ""], model):
            return "belongs in the table [target.NAME]"
        return f"it must be a table, [{where}], not {excerpt(value)}"
    if kind == "missing":
        if where == "mission":
            return 'there is no [mission] table; it names the targets: targets = ["lena"]'
        if path[0] == "color":
            return "is missing; `nxtdrive calibrate colors` writes all keys of this table"
        return "is missing; `nxtdrive mission new FILE` writes an example with every key"
    if kind == "too_short" and where == "mission.targets":
        return "a mission needs at least one target; name one and describe it in a table [target.NAME]"
    if where == "mission.profile" and (near := nearest(str(value), named_profiles())):
        return f"there is no profile {excerpt(value)}; did you mean {near!r}?"
    message = words(kind, problem.get("ctx", {}), problem["msg"], value)
    return message if isinstance(value, dict) else f"{message}, not {excerpt(value)}{_unit(str(path[-1]))}"


def _unknown(path: Sequence[int | str], value: object, detector: object, model: type[BaseModel]) -> str:
    """Return where an unknown key, or the keys of an unknown table, belong, or the nearest known key."""
    key, here = str(path[-1]), _known_keys(path[:-1], model, detector)
    if detector is not None and key in _known_keys(path[:-1], model):
        return f"{detector} targets have no such key; known here: {', '.join(sorted(here))}"
    if path == ["targets"] and isinstance(value, dict):
        return f"the table of a target is [target.{toml_key(next(iter(value), 'NAME'))}]"
    if isinstance(value, dict):
        tables = {homes for each in value if (homes := _homes(str(each), model))}
        fitting = tables.pop() if len(tables) == 1 else ""
        if fitting and not (len(path) == 1 and f"[{nearest(key, model.model_fields)}]" in fitting):
            return f"there is no such table; its keys belong in {fitting}"
    homes = _homes(key, model)
    return f"belongs in the table {homes}" if homes else f"unknown key; {_advice(key, here)}"


def _detector_advice(target: dict[str, Any]) -> str:
    """Return the mistake in the key ``detector`` of a target's table, which decides which other keys there are."""
    known = detector_names()
    if "detector" in target:
        near = nearest(str(target["detector"]), known)
        advice = f"did you mean {near!r}?" if near else f"use one of {', '.join(known)}, or {INSTALL}"
        key = next((key for key in target if key in DETECTOR_OF), "")
        if key and DETECTOR_OF[key] != near:
            advice = f"did you mean {DETECTOR_OF[key]!r}, which has the key {key}? Else {INSTALL}"
        return f"there is no detector {excerpt(target['detector'])}; {advice}"
    near = nearest("detector", target)
    misspelt = f"; {near!r} looks like it, misspelt" if near else ""
    return f"the key detector is missing; it is one of {', '.join(known)}{misspelt}"


def _unit(key: str) -> str:
    for ending in sorted(UNITS, key=len, reverse=True):
        if key.endswith(ending):
            return f" ({key} is a number in {UNITS[ending]})"
    return ""


def _homes(key: str, model: type[BaseModel]) -> str:
    """Name the tables that have a key; empty if none has."""
    tables = {name: _known_keys([name, "NAME"], model) for name in model.model_fields}
    names = [f"[{'target.NAME' if name == 'target' else name}]" for name, keys in tables.items() if key in keys]
    return " or ".join(names)


def _advice(key: str, keys: Iterable[str]) -> str:
    """Name the nearest key that exists, or all of them."""
    if key in ELSEWHERE and ("detector" in keys or key != "width_mm"):  # a robot has a width, too
        return ELSEWHERE[key]
    known = sorted(keys)
    stem = key.rsplit("_", 1)[0]
    near = next((name for name in known if name.rsplit("_", 1)[0] == stem), "") or nearest(key, known)
    return f"did you mean {near!r}{_unit(near)}?" if near else hint(key, known)


def _known_keys(path: Sequence[int | str], model: type[BaseModel], detector: object = None) -> set[str]:
    """Return the keys of the table at a path.

    Args:
        path: Names of tables, from the outermost one.
        model: The model of the file.
        detector: The detector of the target at that path; without it, a target has the keys of all detectors.
    """
    tables = [model]
    for part in path:
        fields = (table.model_fields[str(part)] for table in tables if part in table.model_fields)
        tables = [nested for field in fields for nested in _tables(field.annotation)] or tables
    if detector is not None:
        tables = [each for each in tables if detector in get_args(each.model_fields["detector"].annotation)]
    return {key for table in tables for key in table.model_fields}


def _tables(annotation: Any) -> Iterator[type[BaseModel]]:  # noqa: ANN401 - annotations have no common type
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation
    for argument in get_args(annotation):
        yield from _tables(argument)
