"""Correlation where glare hides a part of the frame."""

import numpy as np
import pytest

from nxtdrive.vision.detectors.alignment import MIN_LIT
from nxtdrive.vision.detectors.fourier import spectra
from nxtdrive.vision.detectors.frame_pyramid import Level, Transformed
from nxtdrive.vision.detectors.lit_windows import MIN_SHOWN, Footprint

HOLE = np.s_[12:20, 20:28]


def template_of(rng, size):
    gray = rng.random(size, np.float32)
    gray -= gray.mean()
    return gray / np.linalg.norm(gray)


def scores_of(gray, lit, template, step):
    level = Level(gray, 1.0, step, lit)
    out = np.empty([-(-side // step) for side in gray.shape], np.float32)
    level.score(Transformed(np.conj(spectra(template, gray.shape, step)), Footprint(template, step)), out)
    return out


def masked(window, lit, template):
    """The normalised correlation of what is lit, as its definition says."""
    if lit.mean() < MIN_LIT:
        return 0.0
    seen, sought = window[lit > 0], template[lit > 0]
    shown = max(MIN_SHOWN, float(((sought - sought.mean()) ** 2).sum()))
    return float((seen - seen.mean()) @ sought) / float(np.linalg.norm(seen - seen.mean())) / np.sqrt(shown)


@pytest.mark.parametrize("step", [1, 2])
@pytest.mark.parametrize("size", [(14, 10), (14, 11), (13, 20)])
@pytest.mark.parametrize("shape", [(40, 50), (41, 51)])
def test_only_what_is_lit_is_correlated(shape, size, step):
    rng = np.random.default_rng(3)
    gray, lit, template = rng.integers(0, 256, shape, np.uint8), np.ones(shape, np.float32), template_of(rng, size)
    lit[HOLE] = 0
    scores = scores_of(gray, lit, template, step)
    windows = np.lib.stride_tricks.sliding_window_view(gray.astype(float), size)[::step, ::step]
    shares = np.lib.stride_tricks.sliding_window_view(lit, size)[::step, ::step]
    rows, columns = windows.shape[:2]
    expected = [[masked(windows[y, x], shares[y, x], template) for x in range(columns)] for y in range(rows)]
    np.testing.assert_allclose(scores[:rows, :columns], expected, atol=1e-4)
    assert not scores[rows:].any()
    assert not scores[:, columns:].any()


def test_what_glare_hides_does_not_matter():
    rng = np.random.default_rng(4)
    gray, lit, template = (
        rng.integers(0, 256, (40, 50), np.uint8),
        np.ones((40, 50), np.float32),
        template_of(rng, (14, 10)),
    )
    lit[HOLE] = 0
    white = gray.copy()
    white[HOLE] = 255
    np.testing.assert_allclose(scores_of(gray, lit, template, 1), scores_of(white, lit, template, 1), atol=1e-4)
