"""JSON objects that are read, and those that are refused."""

import pytest

from input_files.json_text import parse_object
from input_files.plain import MAX_DEPTH


def _nested(levels):
    return '{"a": ' + "[" * (levels - 1) + "1" + "]" * (levels - 1) + "}"


@pytest.mark.parametrize("number", [2**63 - 1, -(2**63) + 1, 1e300])
def test_a_number_of_64_bits_is_read(number):
    assert parse_object(f'{{"a": [{number}]}}') == {"a": [number]}


@pytest.mark.parametrize(
    "number", ["9223372036854775808", "-9223372036854775809", "1e999", "-1e999", "NaN", "Infinity"]
)
def test_a_number_that_few_programs_can_read_is_refused(number):
    with pytest.raises(ValueError, match="not finite or needs more than 64 bits"):
        parse_object(f'{{"a": {{"b": [{number}]}}}}')


@pytest.mark.parametrize("text", ["[1]", "1", "null", '"a"'])
def test_another_value_than_an_object_is_refused(text):
    with pytest.raises(ValueError, match="not a JSON object"):
        parse_object(text)


def test_the_depth_of_an_object_is_limited():
    assert parse_object(_nested(MAX_DEPTH))
    with pytest.raises(ValueError, match="nested more than 32 levels deep"):
        parse_object(_nested(MAX_DEPTH + 1))
    with pytest.raises(ValueError, match="not a JSON object"):
        parse_object(_nested(100_000))
