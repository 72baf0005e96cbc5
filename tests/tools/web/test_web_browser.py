"""The page in a real browser: drive, stop, run a mission, confirm a recovery; on a phone and on a large screen."""

from __future__ import annotations

import json
import math
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise, product
from pathlib import Path

import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import Select, WebDriverWait

from .conftest import CONTRASTS, NAMELESS, prefer, resize

WAIT_S = 40

QUICK = '[mission]\ntargets = ["lena"]\n[target.lena]\ndetector = "picture"\npictures = ["lena.png"]\n'
WIRETAP = """
window.sent = [];
const send = WebSocket.prototype.send;
WebSocket.prototype.send = function (text) { sent.push(text); send.call(this, text); };
"""
ENDS = (
    "document.getElementById('pad').dispatchEvent(new PointerEvent('pointercancel', {pointerId: 1}))",
    "dispatchEvent(new Event('blur'))",
    "dispatchEvent(new PageTransitionEvent('pagehide'))",
    "Object.defineProperty(document, 'hidden', {value: true});"
    "document.dispatchEvent(new Event('visibilitychange'))",  # the last one: the page is hidden from then on
)
FOCUSED = """
const at = document.activeElement, style = getComputedStyle(at);
const outline = style.outlineStyle === "none" ? "none" : style.outlineWidth;
return [at === document.body ? "" : at.id || at.textContent, outline];
"""

PROTRUDING = """
return [...document.querySelectorAll("section")].flatMap((panel) => {
  const { right } = panel.getBoundingClientRect();
  const inside = [...panel.querySelectorAll("*")].filter((each) => each.checkVisibility());
  return inside.filter((each) => each.getBoundingClientRect().right > right).map((each) => each.id || each.outerHTML);
});
"""

SECOND_MAP = """
const done = arguments[0];
Promise.all([import("./connection.js"), import("./map.js")]).then(([{ Connection }, { FloorMap }]) => {
  const connection = new Connection();
  const checked = { checked: true, addEventListener() {} };
  window.map = new FloorMap(connection, document.createElement("canvas"), { grid: checked, belief: checked });
  const seen = () => { window.after = true; };
  connection.on("ended", () => connection.on("state", () => connection.on("true_room", seen)));
  done();
});
"""
"""Shows the same messages on a map that the test can read."""

ECHOES_OUTSIDE = """
const [x0, x1, y0, y1] = map.box;
return [...map.echoes.values()].filter(([x, y]) => x < x0 || x > x1 || y < y0 || y > y1);
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.xdist_group("browser"),
]


@contextmanager
def _serving(browser: WebDriver, folder: Path, *words: str) -> Iterator[list[str]]:
    """Run a page; yields what it prints first, up to its address, and with --lan also its PIN."""
    server = subprocess.Popen([sys.executable, "-m", "nxtdrive", *words], cwd=folder, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    lines = [server.stdout.readline()]
    while "PIN" not in lines[-1] if "--lan" in words else "http" not in lines[-1]:
        lines.append(server.stdout.readline())
    try:
        yield lines
        browser.get("about:blank")  # a page without a server would log errors
    finally:
        server.terminate()
        server.communicate(timeout=60)


@pytest.fixture
def url(browser, tmp_path) -> Iterator[str]:
    """A page that runs."""
    with _serving(browser, tmp_path, "web", "--port", "0") as lines:
        yield re.findall(r"http\S+", lines[-1])[0]


def _until(browser: WebDriver, element: str, text: str) -> None:
    WebDriverWait(browser, WAIT_S).until(lambda page: text in page.find_element(By.ID, element).text)


@pytest.fixture
def opened(browser, url) -> str:
    """The address of the page of a robot, which the browser shows, at rest."""
    browser.get(url)
    _until(browser, "doing", "at rest")
    return url


def _colours(browser: WebDriver, canvas: str) -> int:
    script = """
    const canvas = document.getElementById(arguments[0]);
    const data = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data;
    return new Set(new Uint32Array(data.buffer)).size;
    """
    return int(browser.execute_script(script, canvas))


def _drawn(browser: WebDriver, canvas: str) -> str:
    return str(browser.execute_script("return document.getElementById(arguments[0]).toDataURL()", canvas))


def test_drive_by_keys_and_pad_and_stop(browser, opened):
    ActionChains(browser).key_down(Keys.ARROW_UP).perform()
    _until(browser, "doing", "driving")
    ActionChains(browser).key_up(Keys.ARROW_UP).perform()
    _until(browser, "doing", "at rest")
    ActionChains(browser).click_and_hold(browser.find_element(By.ID, "pad")).move_by_offset(40, 0).perform()
    _until(browser, "doing", "driving")
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    _until(browser, "doing", "until released")
    ActionChains(browser).release().perform()
    browser.find_element(By.ID, "stop").click()
    _until(browser, "stop", "STOP")
    assert _colours(browser, "camera") > 100


def test_what_may_mean_that_nobody_steers_stops_the_motion_at_once(browser, opened):
    browser.execute_script(WIRETAP)
    for end in ENDS:
        pad = browser.find_element(By.ID, "pad")
        ActionChains(browser).click_and_hold(pad).move_by_offset(0, -40).perform()
        _until(browser, "doing", "driving")
        last = browser.execute_script(end + "; return sent.at(-1)")
        assert json.loads(last) == {"type": "drive", "ahead": 0, "turn": 0}, end
        _until(browser, "doing", "at rest")
        ActionChains(browser).release().perform()


def test_the_map_moves_with_the_robot_and_shows_the_true_room(browser, opened):
    WebDriverWait(browser, WAIT_S).until(lambda page: page.find_element(By.ID, "layer-truth-label").is_displayed())
    hidden = _drawn(browser, "map")
    browser.find_element(By.ID, "layer-truth").click()
    WebDriverWait(browser, WAIT_S).until(lambda _: _drawn(browser, "map") != hidden)
    still = _drawn(browser, "map")
    browser.find_element(By.ID, "pad").click()
    ActionChains(browser).key_down("w").perform()
    WebDriverWait(browser, WAIT_S).until(lambda _: _drawn(browser, "map") != still)
    ActionChains(browser).key_up("w").perform()


def test_a_browser_elsewhere_enters_the_pin_and_drives(browser, tmp_path):
    with _serving(browser, tmp_path, "web", "--lan", "--port", "0") as lines:
        port, pin = re.findall(r":(\d+)/", lines[0])[0], lines[-1].split()[1]
        browser.get(f"http://127.0.0.1:{port}/")
        assert "pin.html" in browser.current_url
        field = browser.find_element(By.ID, "pin")
        assert browser.switch_to.active_element == field
        field.send_keys(f"{(int(pin) + 1) % 10**6:06}", Keys.ENTER)
        _until(browser, "notice", "not the PIN")
        assert any("403" in entry["message"] for entry in browser.get_log("browser")), "which is no error of the page"
        field.send_keys(pin, Keys.ENTER)
        WebDriverWait(browser, WAIT_S).until(lambda page: page.find_elements(By.ID, "doing"))
        _until(browser, "doing", "at rest")


@pytest.mark.nightly
def test_the_page_of_a_run_watches_it_and_stays_readable_after_its_end(browser, tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    words = ("run", "quick.toml", "--nxt", "sim://open", "--web", "--port", "0", "--no-video")
    with _serving(browser, tmp_path, *words) as lines:
        browser.get(re.findall(r"http\S+", lines[-1])[0])
        _until(browser, "lines", "driving to it")
        assert not browser.find_element(By.ID, "pad").is_displayed()
        WebDriverWait(browser, WAIT_S).until(lambda page: _colours(page, "camera") > 100)
        _until(browser, "doing", "ended: achieved after")
        time.sleep(1.5)  # longer than the page waits before it would connect again
        assert "lena reached" in browser.find_element(By.ID, "lines").text
        assert "ended: achieved" in browser.find_element(By.ID, "doing").text
        assert not browser.find_element(By.ID, "notice").is_displayed()
        assert not browser.find_element(By.ID, "start").is_displayed(), "the command ran its only mission"


@pytest.mark.nightly
def test_after_a_mission_the_map_continues_where_the_robot_stands(browser, tmp_path):
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    with _serving(browser, tmp_path, "web", "--nxt", "sim://open?pace=fast", "--port", "0") as lines:
        browser.get(re.findall(r"http\S+", lines[-1])[0])
        _until(browser, "doing", "at rest")
        browser.execute_async_script(SECOND_MAP)
        Select(browser.find_element(By.ID, "mission")).select_by_value("quick.toml")
        browser.find_element(By.ID, "start").click()
        _until(browser, "lines", "lena reached")
        WebDriverWait(browser, WAIT_S).until(lambda page: page.execute_script("return window.after === true"))
        path, pose, origin = browser.execute_script("return [map.path, map.pose, map.room.origin]")
        outside = browser.execute_script(ECHOES_OUTSIDE)
    assert outside == [], "echoes lie beyond the part of the map that is drawn"
    assert math.hypot(*pose[:2]) > 500, "the robot drove to the target"
    assert origin == pytest.approx(pose, abs=1), "the true room lies elsewhere"
    assert max(math.dist(a[:2], b[:2]) for a, b in pairwise(path)) < 300, "the path jumps"


def test_text_has_the_contrast_that_wcag_aa_requires(browser, url):
    for scheme, page in product(("light", "dark"), ("", "missions.html", "calibrate.html", "runs.html", "pin.html")):
        prefer(browser, scheme)
        browser.get(url + page)
        assert browser.execute_script(CONTRASTS) == [], (page or "robot", scheme)


def test_every_control_has_a_name_and_is_reached_by_tab_with_a_visible_focus(browser, opened):
    focused = {}
    for _ in range(40):
        ActionChains(browser).send_keys(Keys.TAB).perform()
        name, outline = browser.execute_script(FOCUSED)
        if not name:  # the end of the page
            break
        focused[name] = outline
    assert {"stop", "pad", "speed", "mission", "profile", "confirm", "start", "lines", "decision"} <= set(focused)
    assert [name for name, outline in focused.items() if outline in ("none", "0px")] == []
    assert browser.execute_script(NAMELESS) == []


@pytest.mark.nightly
def test_calibrate_and_save_the_robot_file(browser, tmp_path):
    with _serving(browser, tmp_path, "web", "--port", "0", "--nxt", "sim://calibration?pace=fast") as lines:
        browser.get(re.findall(r"http\S+", lines[-1])[0] + "calibrate.html")
        _until(browser, "known", "none yet")
        _until(browser, "doing", "at rest")
        assert browser.execute_script(NAMELESS) == []
        for each in ("camera", "wheels", "sonar"):
            browser.find_element(By.CSS_SELECTOR, f"[value={each}]").click()
        browser.find_element(By.ID, "start").click()
        assert browser.find_element(By.ID, "lines").text == "", "it drives before it was said that the floor is free"
        browser.find_element(By.ID, "free").click()
        browser.find_element(By.ID, "start").click()
        _until(browser, "values", "robot.left_reversed false false")
        resize(browser, 320, 700)
        assert browser.execute_script(PROTRUDING) == []
        browser.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
        assert browser.execute_script(CONTRASTS) == []
        assert not browser.find_element(By.ID, "ask-form").is_displayed()
        browser.find_element(By.ID, "save").click()
        _until(browser, "saved", "Saved to robot.toml")
        _until(browser, "known", "motors 20")
        assert (tmp_path / "robot.toml").exists()


def test_pages_that_come_during_a_mission_show_that_it_runs(browser, opened):
    browser.find_element(By.ID, "start").click()
    _until(browser, "doing", "search: lena")
    browser.refresh()
    _until(browser, "link", "ms")
    assert browser.find_element(By.ID, "bumper").text == "–"
    browser.get(f"{opened}calibrate.html")
    _until(browser, "busy", "A mission is running")
    _until(browser, "doing", "search: lena")
    assert not browser.find_element(By.ID, "start").is_enabled()
    browser.get(f"{opened}runs.html")
    _until(browser, "runs", "running for")


def test_pause_and_resume_a_mission(browser, opened):
    browser.find_element(By.ID, "start").click()
    _until(browser, "lines", "searching for lena")
    browser.find_element(By.ID, "pause").click()
    _until(browser, "lines", "paused")
    assert [each.text for each in browser.find_elements(By.CSS_SELECTOR, "#pause.paused")] == ["Resume"]
    assert "suspended" in [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active")]
    browser.refresh()
    _until(browser, "doing", "suspended: lena")
    browser.find_element(By.ID, "pause").click()
    _until(browser, "lines", "resumed")
    assert "suspended" not in [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active")]


def test_the_result_of_a_mission_is_in_view_when_it_ends(browser, url):
    resize(browser, 1440, 900)
    browser.get(url)
    _until(browser, "doing", "at rest")
    browser.find_element(By.ID, "start").click()
    _until(browser, "lines", "searching for lena")
    for turn in range(1, 8):  # more lines than the list has room for
        for word in ("paused", "resumed"):
            browser.find_element(By.ID, "pause").click()
            WebDriverWait(browser, WAIT_S).until(
                lambda page, word=word, turn=turn: page.find_element(By.ID, "lines").text.count(word) == turn
            )
    browser.find_element(By.ID, "end").click()
    _until(browser, "lines", "interrupted after")
    browser.execute_async_script("setTimeout(arguments[0], 200)")
    list_below_its_view = "const list = arguments[0]; return list.scrollHeight - list.scrollTop - list.clientHeight"
    assert browser.execute_script(list_below_its_view, browser.find_element(By.ID, "lines")) <= 1


def test_why_something_is_refused_can_be_read(browser, opened):
    browser.find_element(By.ID, "stop").click()
    _until(browser, "stop", "release")
    browser.find_element(By.ID, "start").click()
    _until(browser, "notice", "A person must release the stop on the page first.")
    browser.execute_async_script("setTimeout(arguments[0], 500)")  # some states of the robot later
    assert browser.find_element(By.ID, "notice").is_displayed()


def test_photograph_a_target_and_save_the_mission(browser, url, tmp_path):
    browser.set_window_size(1920, 1080)
    browser.get(f"{url}missions.html")
    _until(browser, "verdict", "No mistakes. Save it to start it.")
    browser.find_element(By.ID, "take").click()
    photo = browser.find_element(By.ID, "photo")
    WebDriverWait(browser, WAIT_S).until(lambda _: _colours(browser, "photo") > 100)
    drag = ActionChains(browser).move_to_element_with_offset(photo, -100, -100).click_and_hold()
    drag.move_to_element_with_offset(photo, 100, 100).release().perform()
    browser.find_element(By.ID, "target-name").send_keys("what stands there")
    browser.find_element(By.ID, "add").click()
    WebDriverWait(browser, WAIT_S).until(lambda _: list(tmp_path.glob("*.png")))
    _until(browser, "verdict", "No mistakes. Save it to start it.")
    browser.find_element(By.ID, "save").click()
    _until(browser, "verdict", "No mistakes. Start it on the robot's page.")
    WebDriverWait(browser, WAIT_S).until(lambda _: (tmp_path / "new.toml").exists())
    assert 'targets = ["what stands there"]' in (tmp_path / "new.toml").read_text(encoding="utf-8")
    text = browser.find_element(By.ID, "text")
    text.send_keys(Keys.CONTROL, Keys.END)
    text.send_keys("wheight = 3")
    _until(browser, "verdict", "1 mistake")
    browser.find_element(By.ID, "save").click()
    WebDriverWait(browser, WAIT_S).until(lambda page: page.find_element(By.ID, "saved").text == "saved")


def test_a_screen_shows_what_matters_without_scrolling(browser, opened):
    script = "return document.getElementById(arguments[0]).getBoundingClientRect().bottom"
    for width, height, panel in (1920, 1080, "chart-panel"), (1280, 800, "decision-panel"):
        resize(browser, width, height)
        assert browser.execute_script(script, panel) <= height


def test_nothing_protrudes_from_its_panel(browser, opened):
    for size in ((390, 844), (700, 900), (1024, 768), (1280, 800), (1920, 1080)):
        resize(browser, *size)
        assert browser.execute_script(PROTRUDING) == [], size


@pytest.mark.parametrize(("width", "height"), [(390, 844), pytest.param(1920, 1080, marks=pytest.mark.nightly)])
def test_start_a_mission_confirm_a_recovery_and_end_it(browser, url, width, height):
    browser.set_window_size(width, height)
    browser.get(url)
    _until(browser, "doing", "at rest")
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
    _until(browser, "doing", "waiting for your choice: lena")
    browser.find_element(By.CSS_SELECTOR, "#question-choices button").click()
    _until(browser, "lines", "->")
    _until(browser, "decision", "chosen")
    assert "(you decided)" in browser.find_element(By.ID, "decision").text
    assert "search → select, never seen" in browser.find_element(By.CLASS_NAME, "transitions").text
    assert _colours(browser, "map") > 20
    end = browser.find_element(By.ID, "end")
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", end)  # from below the header
    end.click()
    _until(browser, "lines", "interrupted after")
