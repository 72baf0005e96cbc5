"""A sample of the campaign of damaged files, and proof that it finds failures."""

import pytest

from nxtdrive.tools.dev.faults import files
from nxtdrive.tools.dev.faults.campaign import Tally


def test_a_sample_of_damaged_files_is_accepted_or_refused():
    tally = files.CAMPAIGN.run(1, range(30))
    assert tally.violations == []
    assert tally.outcomes.total() == 30
    assert any("refused" in outcome for outcome in tally.outcomes)


@pytest.mark.parametrize(
    "fault", [KeyError("t"), RecursionError("too deep"), UnicodeDecodeError("utf-8", b"", 0, 1, "x")]
)
def test_an_error_of_another_kind_is_a_violation(tmp_path, monkeypatch, fault):
    def broken(*_):
        raise fault

    monkeypatch.setitem(files.KINDS, "faults", (1, "x.toml", (lambda: files.FAULTS,), broken))
    tally = Tally()
    files.attempt(tally, 7, "faults", tmp_path, files.Random(0))
    (violation,) = tally.violations
    assert violation.number == 7
    assert type(fault).__name__ in violation.text


@pytest.mark.parametrize(("fault", "violation"), [(SystemExit(3), AssertionError), (MemoryError(), MemoryError)])
def test_a_command_that_ends_otherwise_is_a_violation(monkeypatch, fault, violation):
    def main(words):
        raise fault

    monkeypatch.setattr(files, "main", main)
    with pytest.raises(violation):
        files.run_command("trace", "show", "x")
