"""The bundled pictures are what their drawing code draws."""

import cv2
import numpy as np
import pytest

from nxtdrive.tools.dev.drawings import PAINTERS, write_pictures
from sim_backend.bundled import PICTURES

A4_PX = (594, 420)


@pytest.mark.slow
def test_the_files_are_what_the_code_draws():
    assert {path.stem for path in PICTURES.glob("*.png")} == {*PAINTERS, "calibration-sheet"}
    for name, paint in PAINTERS.items():
        shipped = cv2.imread(str(PICTURES / f"{name}.png"))
        assert shipped.shape == (*A4_PX, 3)
        # OpenCV versions round the edges of shapes differently
        assert np.abs(shipped.astype(int) - paint()).mean() < 0.5, f"{name}: run python -m tools.dev.drawings"


@pytest.mark.slow
def test_pictures_are_written_to_their_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("nxtdrive.tools.dev.drawings.PICTURES", tmp_path / "prints")
    write_pictures()
    assert sorted(path.stem for path in (tmp_path / "prints").iterdir()) == sorted(PAINTERS)
