"""A sample of the campaign of damaged neural networks, and proof that it finds failures."""

import os
import signal

import pytest

from nxtdrive.tools.dev.faults import models
from nxtdrive.vision.detectors.onnx_model import Options

pytestmark = pytest.mark.skipif(os.name == "nt", reason="processes cannot be forked")


@pytest.mark.slow
def test_a_sample_of_damaged_networks_is_accepted_or_refused():
    tally = models.CAMPAIGN.run(1, range(40))
    assert tally.violations == []
    assert tally.outcomes.total() == 40
    assert any("refused" in outcome for outcome in tally.outcomes)


@pytest.mark.parametrize(
    ("fault", "outcome"),
    [
        (ZeroDivisionError("odd"), "surprised"),
        (MemoryError(), "surprised"),
        (SystemExit, "surprised"),
        (None, "accepted"),
    ],
)
def test_an_error_of_another_kind_is_reported(tmp_path, monkeypatch, fault, outcome):
    class Broken:
        def __init__(self, path, options):
            if fault is not None:
                raise fault

        def places(self, image):
            return None

    monkeypatch.setattr(models, "OnnxModel", Broken)
    assert models.read_apart(tmp_path / "x.onnx", Options())[0] == outcome


def test_a_crash_is_reported(tmp_path, monkeypatch):
    monkeypatch.setattr(models, "OnnxModel", lambda path, options: signal.raise_signal(signal.SIGUSR2))
    assert models.read_apart(tmp_path / "x.onnx", Options()) == ("crashed its process", "SIGUSR2")
