"""The labels of a model: from its metadata, from a file, or those of COCO."""

from __future__ import annotations

import ast
import difflib
import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from warnings import catch_warnings, simplefilter

from firmware_protocol.errors import ConfigError
from input_files.plain import MEGABYTE, InputFileError, read_text

MAX_BYTES = MEGABYTE
MAX_LABELS = 30_000
"""The largest vocabulary of a published detector, that of Objects365 and OpenImages together, has a tenth of it."""

KEYS = ("names", "id2label", "labels", "classes", "class_names", "categories")
"""Keys of a model's metadata that name its labels; the first is Ultralytics', the second Hugging Face's."""

_COCO = (
    "person,bicycle,car,motorcycle,airplane,bus,train,truck,boat,traffic light,fire hydrant,stop sign,"
    "parking meter,bench,bird,cat,dog,horse,sheep,cow,elephant,bear,zebra,giraffe,backpack,umbrella,handbag,tie,"
    "suitcase,frisbee,skis,snowboard,sports ball,kite,baseball bat,baseball glove,skateboard,surfboard,"
    "tennis racket,bottle,wine glass,cup,fork,knife,spoon,bowl,banana,apple,sandwich,orange,broccoli,carrot,"
    "hot dog,pizza,donut,cake,chair,couch,potted plant,bed,dining table,toilet,tv,laptop,mouse,remote,keyboard,"
    "cell phone,microwave,oven,toaster,sink,refrigerator,book,clock,vase,scissors,teddy bear,hair drier,"
    "toothbrush"
)
COCO = tuple(_COCO.split(","))
"""The 80 labels of the data set that most published detectors are trained on. Source: cocodataset.org, 2017."""
COCO_GAPS = (0, 12, 26, 29, 30, 45, 66, 68, 69, 71, 83)
"""Numbers below 91 that COCO's own numbering does not use."""


def coco_labels(count: int) -> tuple[str, ...]:
    """Return COCO's labels for a model that names none and has as many: 80, or 91 with gaps; else none."""
    if count == len(COCO):
        return COCO
    names = iter(COCO)
    return tuple("" if number in COCO_GAPS else next(names) for number in range(91)) if count == 91 else ()


def labels_in(metadata: Mapping[str, str]) -> tuple[str, ...]:
    """Return the labels that a model's metadata name, or none."""
    return next((found for key in KEYS if (found := _parsed(metadata.get(key, "")[:MAX_BYTES], commas=True))), ())


def read_labels(path: Path) -> tuple[str, ...]:
    """Read labels from a text file: one per line, or as JSON a list, or an object from number to label.

    Raises:
        ConfigError: It cannot be read, has none, or is YAML.
    """
    if path.suffix.casefold() in (".yaml", ".yml"):
        remedy = "Write the labels into a text file, one per line, in the model's order."
        raise ConfigError(f"{path} is YAML, which is not read.", remedy=remedy)
    try:
        found = _parsed(read_text(path, MAX_BYTES), commas=False)
    except InputFileError as error:
        raise ConfigError(str(error)) from None
    if not found:
        raise ConfigError(f"{path} has no labels.", remedy="Write one per line, in the model's order.")
    return found


def label_number(label: str, labels: Sequence[str], model: Path) -> int:
    """Return the number of a label, which may be given by that number.

    Raises:
        ConfigError: The model has no such label; the message lists those it has.
    """
    if label and label in labels:  # an empty one is a number without a label
        return labels.index(label)
    if label.isdecimal() and len(label) < 6 and (not labels or int(label) < len(labels)):
        return int(label)
    if not labels:
        raise ConfigError(
            f"{model} does not name its labels, so {label!r} is not known.",
            remedy='Name them in a file, labels = "labels.txt", one per line, or give the number: label = "0".',
        )
    alike = [one for one in labels if one.casefold() == label.casefold()]
    alike = alike or difflib.get_close_matches(label, labels[:1000], n=1)
    hint = f" Did you mean {alike[0]!r}?" if alike else ""
    raise ConfigError(f"{model} has no label {label!r}.{hint}", remedy=f"It has: {listed(labels)}.")


def listed(labels: Sequence[str], most: int = 100) -> str:
    """Return the labels in one line, at most `most` of them; those with a comma are quoted."""
    named = [repr(one[:60]) if "," in one else one[:60] for one in labels if one]
    more = f" and {len(named) - most} more" if len(named) > most else ""
    return ", ".join(named[:most]) + more


def _parsed(text: str, *, commas: bool) -> tuple[str, ...]:
    """Return the labels in a text: JSON, a Python literal as Ultralytics writes it, or one per line.

    Args:
        text: The text.
        commas: Whether a text of one line has the labels between commas.
    """
    value: object = None
    for parse in (json.loads, ast.literal_eval) if text.lstrip()[:1] in ("{", "[", "(") else ():
        with suppress(ValueError, SyntaxError, MemoryError, RecursionError, TypeError), catch_warnings():
            simplefilter("ignore")
            value = parse(text)
            break
    if isinstance(value, dict):
        return _numbered(value)
    if not isinstance(value, list | tuple):
        if text.lstrip().startswith(("{", '["', "['")):
            return ()  # a list or an object that is cut short or damaged
        value = text.split("," if commas and "\n" not in text.strip() else "\n")
    names = [str(one).strip()[:200] for one in value[:MAX_LABELS]]
    while names and not names[-1]:
        names.pop()
    return tuple(names)


def _numbered(table: Mapping[object, object]) -> tuple[str, ...]:
    keyed = {str(key): str(name)[:200] for key, name in table.items()}
    numbers = {int(key): name for key, name in keyed.items() if key.isdecimal() and len(key) < 6}
    if not numbers or max(numbers) >= MAX_LABELS:
        return ()
    return tuple(numbers.get(number, "") for number in range(max(numbers) + 1))
