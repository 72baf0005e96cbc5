"""A mistake that pydantic finds, in one line."""

import pytest
from pydantic import BaseModel, ValidationError

from input_files.pydantic_words import first_mistake


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
