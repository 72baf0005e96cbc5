"""The README's picture: a run's map above frames of its camera."""

from __future__ import annotations

from pathlib import Path

from PIL import Image

from nxtdrive.tools.dev.run_picture import above

README_PICTURE = Path(__file__).parents[3] / "docs" / "images" / "run.png"


def test_frames_stand_below_the_map():
    plan, frames = Image.new("RGB", (1600, 900), "white"), [Image.new("RGB", (320, 240), "red")] * 4
    whole = above(plan, frames)
    assert whole.width == plan.width
    assert [whole.getpixel((x, 1000)) for x in (10, 200, 600, 1000, 1400)] == [(255, 255, 255), *[(255, 0, 0)] * 4]
    assert above(plan, []) is plan


def test_the_readmes_picture_is_small():
    assert README_PICTURE.stat().st_size <= 150_000
