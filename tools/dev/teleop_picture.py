"""Take the documentation's picture of `nxtdrive teleop`, with the simulated robot.

Usage: ``python -m tools.dev.teleop_picture [FILE]``. The program runs in a terminal of its own and drives towards
the first target; Textual presses the keys and saves the screen as SVG, which Chromium renders.
"""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
import tempfile
import threading
from pathlib import Path

from PIL import Image

from .program import parser
from .web_pictures import chromium

COLUMNS, ROWS = 100, 32
SIZE = 1000, 670
KEYS = ",".join(["wait:3000", *["up", "wait:100"] * 40])
"""For Textual's `TEXTUAL_PRESS`: once the first frames have been searched, a held key drives up to the target."""

SHOT_S = 8
COLORS = 64


def main() -> None:
    """Take the picture."""
    arguments = parser(__doc__)
    arguments.add_argument("file", metavar="FILE", nargs="?", type=Path, default=Path("docs/images/teleop.png"))
    path = arguments.parse_args().file
    with tempfile.TemporaryDirectory() as folder:
        svg = Path(folder) / "teleop.svg"
        _drive(svg)
        with chromium() as browser:
            browser.execute_cdp_cmd(
                "Emulation.setDeviceMetricsOverride",
                {"width": SIZE[0], "height": SIZE[1], "deviceScaleFactor": 1, "mobile": False},
            )
            page = f'<body style="margin: 0; background: white">{svg.read_text(encoding="utf-8")}</body>'
            shown = svg.with_suffix(".html")
            shown.write_text(page, encoding="utf-8")
            browser.get(shown.as_uri())
            picture = Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")
    picture.quantize(COLORS, kmeans=2, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {picture.width} x {picture.height}, {path.stat().st_size / 1000:.0f} kB")


def _drive(svg: Path) -> None:
    """Run the program in a terminal until it has saved its screen and ended."""
    command = [sys.executable, "-m", "nxtdrive", "teleop", "--nxt", "sim://open", "--target", "lena", "--no-gamepad"]
    keep = {
        "TEXTUAL_PRESS": KEYS,
        "TEXTUAL_SCREENSHOT": str(SHOT_S),
        "TEXTUAL_SCREENSHOT_LOCATION": str(svg.parent),
        "TEXTUAL_SCREENSHOT_FILENAME": svg.name,
    }
    size = {"COLUMNS": str(COLUMNS), "LINES": str(ROWS), "TERM": "xterm-256color", "COLORTERM": "truecolor"}
    ours, theirs = pty.openpty()
    with os.fdopen(ours, "rb", buffering=0) as shown:
        environment = {**os.environ, **keep, **size}
        program = subprocess.Popen(command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment)  # noqa: S603 - our own interpreter
        os.close(theirs)
        threading.Thread(target=_discard, args=(shown,), daemon=True).start()
        program.wait(timeout=60)


def _discard(shown: io.RawIOBase) -> None:
    """Read what the program draws, so that it never waits for the terminal."""
    try:
        while shown.read(4096):
            pass
    except OSError:  # the program has closed its terminal
        pass


if __name__ == "__main__":
    main()
