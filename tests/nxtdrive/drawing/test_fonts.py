"""Text in pictures: every script that names may have, and never a crash."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import pytest

from nxtdrive.drawing import fonts
from nxtdrive.drawing.fonts import BUNDLED, MISSING, has, parts, width_px
from nxtdrive.drawing.sheet import Sheet, text_width, wrapped

BOX = "\ufffe"
NAMES = ["Bär", "Αθήνα", "Жук"]


def _drawn(text):
    sheet = Sheet(200, 40)
    sheet.text((5, 30), text, 20)
    return np.asarray(sheet.finished()).astype(int)


@pytest.mark.parametrize("name", NAMES)
def test_each_letter_has_a_glyph_of_its_own(name):
    for one, other in combinations([*name, MISSING], 2):
        assert np.abs(_drawn(one) - _drawn(other)).max() > 100, (one, other)


@pytest.mark.parametrize("name", [*NAMES, "Świnka Œuvre Ðỗ", "→ ° … × „“ ½ €", "ΆΈΉ ϊ ΰ", "Ђ Ї Ґ ӂ"])
def test_latin_greek_and_cyrillic_need_no_font_of_the_system(name):
    assert all(has(BUNDLED, character) for character in name)
    assert [part for part, _ in parts(name, 20)] == [name]


@pytest.mark.parametrize(
    "text", ["小熊", "كلب", "कुत्ता", "🐻", "a\ud800b", "a\nb\x00", "e\u0301\u0302", "", "\u202egnirts"]
)
def test_other_text_is_drawn_too(text):
    assert _drawn(f"[{text}]").min() < 100
    assert width_px(text, 20) >= 0


def test_a_script_without_a_font_is_drawn_as_boxes(monkeypatch):
    monkeypatch.setattr(fonts, "SYSTEM_FONTS", ("no such font.ttf",))
    monkeypatch.setattr(fonts.shutil, "which", lambda _: None)
    monkeypatch.setattr(fonts, "_fonts_by_script", {})
    fonts.font_of.cache_clear()
    assert np.array_equal(_drawn("\U00013080"), _drawn(MISSING))
    fonts.font_of.cache_clear()


@pytest.mark.parametrize(
    "text", ["one two three four five six", "Donaudampfschifffahrtsgesellschaftskapitän" * 2, "小熊" * 40]
)
def test_wrapped_text_stays_within_its_width_and_lines(text):
    for most in (1, 2, 50):
        lines = wrapped(text, 17, 160, most)
        assert 1 <= len(lines) <= most
        assert all(text_width(line, 17) <= 160 for line in lines)
    assert "".join(wrapped(text, 17, 160, 50)).replace(" ", "") == text.replace(" ", "")
    assert wrapped(text, 17, 160, 1)[0].endswith("…")
