"""A mistake that pydantic finds, in one line."""

import datetime

import pytest
from pydantic import BaseModel, TypeAdapter, ValidationError

from input_files.pydantic_words import first_mistake, words


class Wheel(BaseModel):
    teeth: int


class Gear(BaseModel):
    wheels: list[Wheel]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('{"wheels": [{"teeth": "many"}]}', "wheels.0.teeth: Input should be a valid integer"),
        ("{", "Invalid JSON"),
    ],
)
def test_the_place_comes_first_if_there_is_one(text, says):
    with pytest.raises(ValidationError) as caught:
        Gear.model_validate_json(text)
    assert first_mistake(caught.value.errors()).startswith(says)


@pytest.mark.parametrize("value", ["2026-13-28", "today", True, "2026-01-31T10:00:00", 1.5])
def test_a_wrong_date_is_answered_by_a_right_one(value):
    with pytest.raises(ValidationError) as caught:
        TypeAdapter(datetime.date).validate_python(value)
    (mistake,) = caught.value.errors()
    assert words(mistake["type"], mistake.get("ctx", {}), mistake["msg"]) == "must be a date, as 2026-01-31"
