"""The page in a real browser: drive, stop, run a mission, confirm a recovery; on a phone and on a beamer."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator

import pytest
from selenium import webdriver
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import Select, WebDriverWait

CHROMIUM, CHROMEDRIVER = shutil.which("chromium"), shutil.which("chromedriver")
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--disable-background-networking", "--no-first-run")
WAIT_S = 40

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("browser"),
    pytest.mark.skipif(not (CHROMIUM and CHROMEDRIVER), reason="no browser: apt install chromium chromium-driver"),
]


@pytest.fixture
def url(tmp_path) -> Iterator[str]:
    """A page that runs."""
    command = [sys.executable, "-m", "nxtdrive", "web", "--port", "0"]
    server = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    yield re.findall(r"http\S+", server.stdout.readline())[0]
    server.terminate()
    assert server.communicate(timeout=20)[0] == "ended; motors off\n"


@pytest.fixture
def browser() -> Iterator[WebDriver]:
    options = webdriver.ChromeOptions()
    options.binary_location = str(CHROMIUM)
    for option in OPTIONS:
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=webdriver.ChromeService(CHROMEDRIVER))
    yield driver
    errors = [entry["message"] for entry in driver.get_log("browser") if entry["level"] == "SEVERE"]
    driver.quit()
    assert errors == []


def _until(browser: WebDriver, element: str, text: str) -> None:
    WebDriverWait(browser, WAIT_S).until(lambda page: text in page.find_element(By.ID, element).text)


def _colours(browser: WebDriver, canvas: str) -> int:
    script = """
    const canvas = document.getElementById(arguments[0]);
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(data.buffer)).size;
    """
    return int(browser.execute_script(script, canvas))


def test_drive_by_keys_and_pad_and_stop(browser, url):
    browser.get(url)
    _until(browser, "doing", "stopped")
    ActionChains(browser).key_down(Keys.ARROW_UP).perform()
    _until(browser, "doing", "driving")
    ActionChains(browser).key_up(Keys.ARROW_UP).perform()
    _until(browser, "doing", "stopped")
    ActionChains(browser).click_and_hold(browser.find_element(By.ID, "pad")).move_by_offset(40, 0).perform()
    _until(browser, "doing", "driving")
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    _until(browser, "doing", "until the stop is released")
    ActionChains(browser).release().perform()
    browser.find_element(By.ID, "stop").click()
    _until(browser, "stop", "STOP")
    assert _colours(browser, "camera") > 100


def test_pause_and_resume_a_mission(browser, url):
    browser.get(url)
    _until(browser, "doing", "stopped")
    browser.find_element(By.ID, "start").click()
    _until(browser, "lines", "searching for lena")
    browser.find_element(By.ID, "pause").click()
    _until(browser, "lines", "paused")
    assert [each.text for each in browser.find_elements(By.CSS_SELECTOR, "#pause.paused")] == ["Resume"]
    assert "suspended" in [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active")]
    browser.find_element(By.ID, "pause").click()
    _until(browser, "lines", "going on")
    assert "suspended" not in [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active")]


def test_photograph_a_target_and_save_the_mission(browser, url, tmp_path):
    browser.set_window_size(1920, 1080)
    browser.get(f"{url}missions.html")
    _until(browser, "verdict", "can be started")
    browser.find_element(By.ID, "take").click()
    photo = browser.find_element(By.ID, "photo")
    WebDriverWait(browser, WAIT_S).until(lambda _: _colours(browser, "photo") > 100)
    drag = ActionChains(browser).move_to_element_with_offset(photo, -100, -100).click_and_hold()
    drag.move_to_element_with_offset(photo, 100, 100).release().perform()
    browser.find_element(By.ID, "target-name").send_keys("what stands there")
    browser.find_element(By.ID, "add").click()
    WebDriverWait(browser, WAIT_S).until(lambda _: list(tmp_path.glob("*.png")))
    _until(browser, "verdict", "can be started")
    browser.find_element(By.ID, "save").click()
    _until(browser, "saved", "saved")
    WebDriverWait(browser, WAIT_S).until(lambda _: (tmp_path / "new.toml").exists())
    assert 'targets = ["what stands there"]' in (tmp_path / "new.toml").read_text(encoding="utf-8")
    text = browser.find_element(By.ID, "text")
    text.send_keys(Keys.CONTROL, Keys.END)
    text.send_keys("wheight = 3")
    _until(browser, "verdict", "1 mistake")
    browser.find_element(By.ID, "save").click()
    WebDriverWait(browser, WAIT_S).until(lambda page: page.find_element(By.ID, "saved").text == "saved")


@pytest.mark.parametrize(("width", "height"), [(390, 844), (1920, 1080)])
def test_start_a_mission_confirm_a_recovery_and_end_it(browser, url, width, height):
    browser.set_window_size(width, height)
    browser.get(url)
    _until(browser, "doing", "stopped")
    overflow = browser.execute_script(
        "return document.documentElement.scrollWidth - document.documentElement.clientWidth"
    )
    assert overflow <= 0
    Select(browser.find_element(By.ID, "profile")).select_by_value("adaptive")
    browser.find_element(By.ID, "confirm").click()
    browser.find_element(By.ID, "start").click()
    _until(browser, "lines", "searching for lena")
    assert "search" in [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active:not(.compound)")]
    _until(browser, "question", "proposed")
    browser.find_element(By.CSS_SELECTOR, "#question-choices button").click()
    _until(browser, "lines", "->")
    assert _colours(browser, "map") > 20
    browser.find_element(By.ID, "end").click()
    _until(browser, "lines", "interrupted after")
