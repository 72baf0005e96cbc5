"""Correlation on the levels of a frame's pyramid."""

import numpy as np
import pytest

from nxtdrive.vision.detectors.fourier import correlated, spectra
from nxtdrive.vision.detectors.frame_pyramid import Level


@pytest.mark.parametrize("shape", [(12, 16), (13, 17), (12, 17), (13, 16), (14, 14), (5, 4)])
@pytest.mark.parametrize("step", [1, 2])
def test_correlation_is_the_sum_of_products_at_every_step(shape, step):
    rng = np.random.default_rng(1)
    seen, sought = rng.random(shape, np.float32), rng.random((5, 4), np.float32)
    columns = -(-shape[1] // step)
    found = correlated(spectra(seen, shape, step), np.conj(spectra(sought, shape, step)), columns)
    windows = np.lib.stride_tricks.sliding_window_view(seen, sought.shape)
    expected = (windows * sought).sum(axis=(2, 3))[::step, ::step]
    np.testing.assert_allclose(found[: expected.shape[0], : expected.shape[1]], expected, atol=1e-4)


@pytest.mark.parametrize("shape", [(30, 40), (31, 41), (14, 20)])
@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("window", [(14, 10), (14, 11), (13, 20)])
def test_norms_are_those_of_the_windows_that_lie_inside(shape, step, window):
    gray = np.random.default_rng(2).integers(0, 256, shape, np.uint8)
    windows = np.lib.stride_tricks.sliding_window_view(gray.astype(float), window)
    expected = (windows.std(axis=(2, 3)) * np.sqrt(np.prod(window)))[::step, ::step]
    norms = Level(gray, 1.0, step).norms(*window)
    rows, columns = expected.shape
    np.testing.assert_allclose(norms[:rows, :columns], expected, rtol=1e-4)
    assert np.isinf(norms[rows:]).all()
    assert np.isinf(norms[:, columns:]).all()
