"""The page of a classroom in a real browser: twelve robots, on a phone and on a large screen."""

from __future__ import annotations

import re
from collections.abc import Iterator

import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import WebDriverWait

from ..conftest import CONTRASTS, NAMELESS, prefer, resize

WAIT_S = 40
ROBOTS = 12

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("browser"),
]


@pytest.fixture
def url(started) -> Iterator[str]:
    """The page of a classroom that runs."""
    server = started("web", "--classroom", ROBOTS, "--port", "0")
    yield re.findall(r"http\S+", server.stdout.readline())[0]
    server.terminate()
    assert server.communicate(timeout=60)[0] == "ended; motors off\n"


def _until(browser: WebDriver, selector: str, text: str) -> None:
    WebDriverWait(browser, WAIT_S).until(lambda page: text in page.find_element(By.CSS_SELECTOR, selector).text)


def _has_picture(browser: WebDriver, tile: int) -> bool:
    script = """
    const canvas = document.querySelectorAll(".tile canvas")[arguments[0]];
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(data.buffer)).size > 100;
    """
    return bool(browser.execute_script(script, tile))


def test_text_has_contrast_and_every_control_a_name(url, browser):
    browser.get(url)
    _until(browser, "#summary", f"{ROBOTS} of {ROBOTS} open")
    browser.find_element(By.ID, "all").click()
    browser.find_element(By.ID, "stop").click()
    _until(browser, "#release", "release all")
    browser.find_element(By.ID, "start").click()
    _until(browser, "#notice", "stopped")
    for scheme in "light", "dark":
        prefer(browser, scheme)
        assert browser.execute_script(CONTRASTS) == [], scheme
    assert browser.execute_script(NAMELESS) == []


@pytest.mark.parametrize(("width", "height"), [(390, 844), pytest.param(1920, 1080, marks=pytest.mark.nightly)])
def test_twelve_robots_are_started_stopped_and_their_results_sorted(url, browser, width, height):
    resize(browser, width, height, mobile=width < height)
    browser.get(url)
    _until(browser, "#summary", f"{ROBOTS} of {ROBOTS} open")
    assert browser.execute_script("return document.documentElement.scrollWidth") <= width
    WebDriverWait(browser, WAIT_S).until(lambda page: _has_picture(page, 0))
    assert not browser.find_element(By.ID, "start").is_enabled()
    assert browser.find_element(By.ID, "none-free").is_displayed()
    browser.find_element(By.ID, "all").click()
    assert not browser.find_element(By.ID, "none-free").is_displayed()
    browser.find_element(By.ID, "start").click()
    _until(browser, "#summary", f"{ROBOTS} on a mission")
    assert not browser.find_element(By.ID, "start").is_enabled()
    _until(browser, "#none-free", "All ticked robots are on a mission.")
    _until(browser, ".tile .doing", "search: lena")
    browser.find_element(By.ID, "title").click()
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    _until(browser, "#summary", f", 0 on a mission, {ROBOTS} stopped")  # and not 10
    assert browser.find_element(By.ID, "start").text == f"Start on {ROBOTS}"
    WebDriverWait(browser, WAIT_S).until(
        lambda page: len(page.find_elements(By.CSS_SELECTOR, "#results tbody tr")) == ROBOTS
    )
    heads = browser.find_elements(By.CSS_SELECTOR, "#results th button")
    heads[0].send_keys(Keys.ENTER)
    assert browser.find_element(By.CSS_SELECTOR, "#results tbody td").text == f"Robot {ROBOTS}"
    browser.find_element(By.ID, "release").send_keys(Keys.ENTER)
    _until(browser, "#summary", ", 0 on a mission")
    browser.find_element(By.CSS_SELECTOR, ".tile .name").send_keys(Keys.ENTER)
    _until(browser, "nav", "Robot 1")
    _until(browser, "#doing", "at rest")
    browser.find_element(By.LINK_TEXT, "classroom").click()
    _until(browser, "#summary", f"{ROBOTS} of {ROBOTS} open")
    WebDriverWait(browser, WAIT_S).until(lambda page: page.find_elements(By.CSS_SELECTOR, "#results tbody a"))
    browser.find_element(By.CSS_SELECTOR, "#results tbody a").send_keys(Keys.ENTER)
    _until(browser, "#what", "lena, then rilakkuma")
