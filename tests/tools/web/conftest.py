"""A real browser, and checks for every page in it."""

from __future__ import annotations

import shutil
from collections.abc import Iterator

import pytest
from selenium import webdriver
from selenium.webdriver.remote.webdriver import WebDriver

CHROMIUM, CHROMEDRIVER = shutil.which("chromium"), shutil.which("chromedriver")
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")

CONTRASTS = """
const rgb = (text) => text.match(/[0-9.]+/g).map(Number);
const light = (c) => { c /= 255; return c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4; };
const luminance = ([r, g, b]) => 0.2126 * light(r) + 0.7152 * light(g) + 0.0722 * light(b);
function ground(element) {
  for (let at = element; at; at = at.parentElement) {
    const color = rgb(getComputedStyle(at).backgroundColor);
    if (color[3] === undefined || color[3] > 0.99) return color;
  }
  return [255, 255, 255];
}
const poor = [];
for (const element of document.querySelectorAll("body *")) {
  const text = [...element.childNodes].filter((node) => node.nodeType === 3).map((node) => node.data.trim()).join("");
  if (!text || element.disabled || !element.checkVisibility() || element.closest("canvas, option")) continue;
  const style = getComputedStyle(element), size = parseFloat(style.fontSize);
  const [a, b] = [luminance(rgb(style.color)), luminance(ground(element))].sort((one, other) => other - one);
  const enough = size >= 24 || (size >= 18.66 && style.fontWeight >= 700) ? 3 : 4.5;
  if ((a + 0.05) / (b + 0.05) < enough) poor.push(`${text}: ${((a + 0.05) / (b + 0.05)).toFixed(2)}`);
}
return poor;
"""
"""Returns the texts whose contrast WCAG AA finds poor."""

NAMELESS = """
return [...document.querySelectorAll("button, select, input, canvas, section, [role], [tabindex]")]
  .filter((each) => each.checkVisibility())
  .filter((each) => !(each.labels?.length || each.getAttribute("aria-label") || each.getAttribute("aria-labelledby")
    || each.textContent.trim()))
  .map((each) => each.outerHTML);
"""
"""Returns the controls without a name."""


def prefer(browser: WebDriver, scheme: str) -> None:
    """Let the browser's user prefer the colour scheme "light" or "dark"."""
    feature = {"name": "prefers-color-scheme", "value": scheme}
    browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})


def resize(browser: WebDriver, width: int, height: int, *, mobile: bool = False) -> None:
    """Give the window a size, and if wanted the behaviour of a phone's browser."""
    size = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": mobile}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)


@pytest.fixture(scope="session")
def chromium() -> Iterator[WebDriver]:
    """A browser for all tests: starting it takes as long as a test."""
    if not (CHROMIUM and CHROMEDRIVER):
        pytest.skip("no browser: apt install chromium chromium-driver")
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for option in OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(CHROMEDRIVER))
    yield driver
    driver.quit()


@pytest.fixture
def browser(chromium: WebDriver) -> Iterator[WebDriver]:
    """A new window without cookies, whose console must stay without errors."""
    first = chromium.current_window_handle
    chromium.switch_to.new_window("window")
    yield chromium
    log = [(entry["level"], entry["message"]) for entry in chromium.get_log("browser")]
    chromium.execute_cdp_cmd("Network.clearBrowserCookies", {})
    chromium.close()
    chromium.switch_to.window(first)
    assert [text for level, text in log if level == "SEVERE" or "a part of the page cannot show" in text] == []
