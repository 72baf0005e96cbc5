"""A mistake that pydantic finds, in one line."""

import datetime
from typing import Annotated, Literal

import pytest
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from input_files.pydantic_words import LONGEST_EXAMPLE, first_mistake, words


class Wheel(BaseModel):
    teeth: int


class Gear(BaseModel):
    model_config = ConfigDict(extra="forbid")
    kind: Literal["gear"] = "gear"
    wheels: list[Wheel]


class Lever(BaseModel):
    kind: Literal["lever"]


PART = TypeAdapter(Annotated[Gear | Lever, Field(discriminator="kind")])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"kind": "gear", "wheels": [{"teeth": "many"}]}', "gear.wheels.0.teeth: must be a whole number"),
        ('{"kind": "gear", "wheels": [5]}', "gear.wheels.0: must be an object"),
        ('{"kind": "gear"}', "gear.wheels: is missing"),
        ('{"kind": "gear", "wheels": [], "size": 1}', "gear.size: is unknown"),
        ('{"kind": "chain"}', "'kind' must be one of 'gear', 'lever', not 'chain'"),
        ("{}", "'kind' is missing"),
        ("[]", "must be an object"),
        ("{", "Invalid JSON: EOF while parsing an object at line 1 column 1"),
    ],
)
def test_the_place_comes_first_if_there_is_one(text, says):
    with pytest.raises(ValidationError) as caught:
        PART.validate_json(text)
    assert first_mistake(caught.value.errors()) == says


@pytest.mark.parametrize("value", ["2026-13-28", "today", True, "2026-01-31T10:00:00", 1.5])
def test_a_wrong_date_is_answered_by_a_right_one(value):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(datetime.date).validate_python(value)
    (mistake,) = caught.value.errors()
    assert words(mistake["type"], mistake.get("ctx", {}), mistake["msg"]) == "must be a date, as 2026-01-31"


@pytest.mark.parametrize(
    ("kind", "value", "says"),
    [
        (Annotated[str, Field(max_length=3)], "abcd", "must have at most 3 characters"),
        (int, 1e308, "must be a whole number with fewer digits"),
    ],
)
def test_limits_are_in_words(kind, value, says):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(kind).validate_python(value)
    assert first_mistake(caught.value.errors()) == says


def test_a_short_text_that_should_be_a_list_is_shown_as_one():
    text = "x" * LONGEST_EXAMPLE
    assert words("list_type", {}, "", text) == f'must be a list in brackets, as in ["{text}"]'
    assert words("list_type", {}, "", text + "x") == "must be a list in brackets, as in [1, 2]"
