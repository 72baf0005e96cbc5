"""The bar on the terminal while a video or an exported page is made."""

import io
import sys

import pytest

from nxtdrive.cli.progress import with_progress


@pytest.mark.parametrize(("second_s", "shown"), [(1.9, False), (2.1, True)])
def test_only_what_takes_longer_shows_a_bar(monkeypatch, second_s, shown):
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setattr(sys, "stderr", io.StringIO())
    now_s = [0.0]
    for _ in with_progress("camera.webm", lambda: now_s[0])(range(3)):
        now_s[0] = second_s
    assert ("making camera.webm" in sys.stderr.getvalue()) == shown


def test_nothing_is_shown_where_standard_error_is_not_a_terminal(capsys):
    times = iter(range(0, 1000, 10))
    assert list(with_progress("camera.webm", lambda: next(times))(range(3))) == [0, 1, 2]
    assert capsys.readouterr().err == ""
