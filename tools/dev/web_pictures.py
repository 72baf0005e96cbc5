"""Take the documentation's pictures of the page, in Chromium, with the simulated robot.

Usage: ``python -m tools.dev.web_pictures [FOLDER]``. The mission is the built-in one with the adaptive profile; the
pictures are taken on the way to a target after its second decision.
"""

from __future__ import annotations

import io
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL import Image
from selenium import webdriver
from selenium.webdriver.common.by import By
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import Select, WebDriverWait

from .program import parser

SIZES = {"web-phone": (390, 844), "web-screen": (1440, 1110)}
DECISIONS = 2
WAIT_S = 240
COLORS = 256
"""Number of colours of a picture's palette; this keeps it below 200 kB. Small coloured marks keep their colour."""


def main() -> None:
    """Take all pictures, in one mission."""
    arguments = parser(__doc__)
    arguments.add_argument("folder", metavar="FOLDER", nargs="?", type=Path, default=Path("docs/images"))
    folder = arguments.parse_args().folder
    with _page() as url, chromium() as browser:
        browser.get(url)
        WebDriverWait(browser, WAIT_S).until(lambda page: "at rest" in page.find_element(By.ID, "doing").text)
        Select(browser.find_element(By.ID, "profile")).select_by_value("adaptive")
        browser.find_element(By.ID, "start").click()
        WebDriverWait(browser, WAIT_S).until(
            lambda page: page.find_element(By.ID, "lines").text.count("->") >= DECISIONS
        )
        for name, size in SIZES.items():
            WebDriverWait(browser, WAIT_S).until(lambda page: "arrive" in page.find_element(By.ID, "doing").text)
            _take(browser, size, folder / f"{name}.png")


def _take(browser: WebDriver, size: tuple[int, int], path: Path) -> None:
    metrics = {"width": size[0], "height": size[1], "deviceScaleFactor": 1, "mobile": size[0] < 640}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    picture = Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB")
    picture.quantize(COLORS, Image.Quantize.MAXCOVERAGE, kmeans=2, dither=Image.Dither.NONE).save(path, optimize=True)
    print(f"{path}: {picture.width} x {picture.height}, {path.stat().st_size / 1000:.0f} kB")


@contextmanager
def _page() -> Iterator[str]:
    """Run the page in an empty folder; yields its address."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "nxtdrive", "web", "--port", "0"]
        server = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)  # noqa: S603 - our own interpreter
        assert server.stdout is not None  # noqa: S101 - as asked for
        try:
            yield re.findall(r"http\S+", server.stdout.readline())[0]
        finally:
            server.terminate()
            server.communicate()


@contextmanager
def chromium() -> Iterator[WebDriver]:
    """Run Chromium without a window."""
    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    for option in ("--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"):
        options.add_argument(option)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))
    try:
        yield browser
    finally:
        browser.quit()


if __name__ == "__main__":
    main()
