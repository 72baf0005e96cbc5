"""The fit of geometric vision: it recovers a known model from trials of that model."""

import math
import random

import pytest

from nxtdrive.tools.dev.fit_geometric import fit
from sim_backend.camera.geometric import Falloff


@pytest.mark.slow
@pytest.mark.parametrize(
    ("truth", "low", "high"),
    [(Falloff(55.0, 3.0), 20.0, 85.0), pytest.param(Falloff(3.7, -0.15), 2.5, 5.5, marks=pytest.mark.nightly)],
)
def test_a_known_falloff_is_recovered(truth, low, high):
    rng = random.Random(1)
    values = [rng.uniform(low, high) for _ in range(3000)]
    hits = [rng.random() < truth.rate(value) for value in values]
    found = fit(values, hits, int(math.copysign(1, truth.width)))
    assert found.half == pytest.approx(truth.half, abs=0.02 * (high - low))
    assert found.width == pytest.approx(truth.width, rel=0.25)
