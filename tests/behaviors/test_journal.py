"""Records of the journal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from behaviors.journal import Record, RecordKind


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan, np.float32(np.inf)])
def test_a_measurement_that_is_not_finite_leaves_its_record_readable(value):
    record = Record.of(1.0, RecordKind.STEP, "search", "lena", {"range_mm": value, "extra": [value, 2.0]})
    assert Record.from_json(record.to_json()).data == {"range_mm": None, "extra": [None, 2.0]}


@pytest.mark.parametrize("time_s", ["true", "-1", "NaN", "1e400", '"1"', "null", "[]"])
def test_a_record_without_a_right_time_is_none(time_s):
    line = f'{{"t": {time_s}, "kind": "step", "state": "search", "target": "lena"}}'
    with pytest.raises(ValueError, match=r"time|record|not finite|NaN"):
        Record.from_json(line)
