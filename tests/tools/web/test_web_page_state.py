"""What the page does with single messages and events, in a real browser: its WebSocket is played by the test."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import Select, WebDriverWait

from nxtdrive.tools.web.app import STATIC

from .conftest import resize

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("browser")]

PLAYED = """
window.sent = [];
window.sockets = [];
window.WebSocket = class {
  static OPEN = 1;
  constructor() {
    this.readyState = 1;
    sockets.push(this);
    setTimeout(() => this.onopen?.());
  }
  send(text) { sent.push(JSON.parse(text)); }
};
window.tell = (message) => sockets.at(-1).onmessage({ data: JSON.stringify(message) });
window.cut = () => { sockets.at(-1).readyState = 3; sockets.at(-1).onclose(); };
"""
HELLO = {
    "type": "hello",
    "you": "page 1",
    "address": "sim://",
    "drives": True,
    "missions": ["cat.toml", "dog.toml"],
    "proposed": "dog.toml",
    "profiles": ["adaptive", "thesis"],
    "chart": {"regions": [{"state": "search", "inner": []}], "initial": ["search"], "words": {}},
    "recoveries": {},
}
STATE = {
    "type": "state",
    "doing": "at rest",
    "pose": [0, 0, 0],
    "range_mm": None,
    "touching": False,
    "lacking": [],
    "battery_mv": 8000,
    "latency_ms": 3,
    "speed_limit": 60,
    "stopped": False,
}
SHAPE = {"sonar_forward_mm": 100, "forward_mm": 0, "right_mm": 0, "yaw_deg": 0, "hfov_deg": 60}
RUN = {"type": "run", "folder": "cat-001", "robot": {}, "name": "find the cat", "profile": "thesis"}
QUESTION = {
    "type": "question",
    "open": True,
    "number": 1,
    "target": "cat",
    "failed": "it is lost",
    "known": [],
    "candidates": [{"text": "wait", "why": "it may come back"}],
}
INK = """
const [[red, green, blue], done] = arguments, map = document.getElementById("map");
requestAnimationFrame(() => requestAnimationFrame(() => {
  const { data } = map.getContext("2d").getImageData(0, 0, map.width, map.height);
  let count = 0;
  for (let i = 0; i < data.length; i += 4) {
    if (data[i] === red && data[i + 1] === green && data[i + 2] === blue) count++;
  }
  done(count);
}));
"""
"""Counts the map's pixels of a colour."""
NUMBERS, PATH, ECHOES = (0x8A, 0x10, 0x15), (0x0B, 0x5F, 0xB0), (0x5B, 0x66, 0x72)
"""Colours of the map's marks."""
LABELS = """
window.labels = {};
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const { a, e } = this.getTransform();
  labels[text] = [x * a + e, (x + this.measureText(text).width) * a + e, this.canvas.width];
  fill.call(this, text, x, y);
};
"""
"""Notes of each text on a canvas where it begins and ends, and the canvas' width, in pixels."""
Tell = Callable[..., None]


class _Handler(SimpleHTTPRequestHandler):
    """Serves the page's files, and has no missions and no runs."""

    def do_GET(self) -> None:
        if self.path == "/api/session":
            self.send_response(204)
            self.end_headers()
        elif self.path.startswith("/api/"):
            self.send_response(200)
            self.end_headers()
            self.wfile.write(b"[]")
        else:
            super().do_GET()

    def do_POST(self) -> None:
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b'{"mistakes": [], "warnings": []}')

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@pytest.fixture(scope="module")
def site() -> Iterator[str]:
    """The files of the page, without a robot."""
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(_Handler, directory=str(STATIC)))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    yield f"http://127.0.0.1:{server.server_port}/"
    server.shutdown()
    server.server_close()


@pytest.fixture
def tell(browser: WebDriver, site: str) -> Tell:
    """Opens a page whose server is the test; returns what sends it messages."""
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": PLAYED})
    browser.get(site)

    def send(*messages: dict[str, Any]) -> None:
        for message in messages:
            browser.execute_script("tell(arguments[0])", message)

    send(HELLO, STATE)
    return send


def _sent(browser: WebDriver, *kinds: str) -> list[dict[str, Any]]:
    return [each for each in browser.execute_script("return sent") if each["type"] in kinds]


def _reconnected(browser: WebDriver) -> None:
    """Cut the connection, and wait until the page has another one."""
    browser.execute_script("cut()")
    WebDriverWait(browser, 10).until(lambda page: page.execute_script("return sockets.length") == 2)
    browser.execute_async_script("setTimeout(arguments[0], 100)")


def _press(browser: WebDriver, key: str) -> None:
    ActionChains(browser).send_keys(key).perform()


def _text(browser: WebDriver, element: str) -> str:
    return browser.find_element(By.ID, element).text


def test_the_mission_of_the_command_line_is_selected_first_and_a_choice_stays(browser, tell):
    mission = Select(browser.find_element(By.ID, "mission"))
    assert mission.first_selected_option.text == "dog.toml"
    mission.select_by_visible_text("cat.toml")
    tell(HELLO)
    assert mission.first_selected_option.text == "cat.toml"


def test_space_does_not_answer_a_question_that_has_just_opened(browser, tell):
    tell(RUN, QUESTION)
    _press(browser, Keys.SPACE)
    assert _sent(browser, "answer") == []
    assert _sent(browser, "stop") == [{"type": "stop"}]


@pytest.mark.parametrize("control", ["#pause", "#layer-grid", "label:has(#layer-grid)", "#speed"])
def test_space_stops_after_a_click_on_any_control(browser, tell, control):
    tell(RUN)
    element = browser.find_element(By.CSS_SELECTOR, control)
    browser.execute_script("arguments[0].scrollIntoView({block: 'center'})", element)
    ActionChains(browser).move_to_element_with_offset(element, 10, 0).click().perform()
    _press(browser, Keys.SPACE)
    assert _sent(browser, "stop") == [{"type": "stop"}]


def test_space_works_a_button_that_the_keyboard_has_reached(browser, tell):
    tell(RUN)
    browser.execute_script("document.getElementById('pause').focus()")
    _press(browser, Keys.SPACE)
    assert _sent(browser, "pause") == [{"type": "pause"}]
    assert _sent(browser, "stop") == []


@pytest.mark.parametrize("page", ["", "missions.html", "calibrate.html", "runs.html"])
def test_every_page_of_the_robot_says_what_it_does_and_stops_and_releases_it(browser, site, tell, page):
    browser.get(f"{site}{page}")
    tell(HELLO, {**STATE, "doing": "driving"})
    assert _text(browser, "doing") == "driving"
    stop = browser.find_element(By.ID, "stop")
    stop.click()
    tell({**STATE, "stopped": True})
    stop.click()
    assert _sent(browser, "stop", "release") == [{"type": "stop"}, {"type": "release"}]


def test_a_stop_without_a_connection_is_sent_when_there_is_one_again(browser, tell):
    tell(RUN)
    browser.execute_script("cut()")
    browser.find_element(By.ID, "stop").click()
    browser.execute_script("document.getElementById('end').click()")  # this ends less than the stop
    WebDriverWait(browser, 10).until(lambda page: page.execute_script("return sockets.length") == 2)
    WebDriverWait(browser, 10).until(lambda page: _sent(page, "stop"))
    assert _sent(browser, "stop") == [{"type": "stop"}]


@pytest.mark.parametrize(("since_ms", "times"), [(0, 2), (2000, 1), (60000, 1)])
def test_a_stop_is_sent_again_when_nothing_shows_that_it_had_arrived(browser, tell, since_ms, times):
    browser.find_element(By.ID, "stop").click()
    browser.execute_script(f"const now = performance.now; performance.now = () => now.call(performance) + {since_ms}")
    if since_ms < 60000:
        tell(STATE)  # it may have been under way before the stop, unless it comes much later
    _reconnected(browser)
    assert _sent(browser, "stop") == times * [{"type": "stop"}]


def test_a_stop_that_was_released_is_not_sent_again(browser, tell):
    browser.find_element(By.ID, "stop").click()
    tell({**STATE, "stopped": True})
    browser.find_element(By.ID, "stop").click()
    _reconnected(browser)
    assert _sent(browser, "stop") == [{"type": "stop"}]


def test_the_command_key_lets_go_of_held_keys(browser, tell):
    for key in ("{code: 'KeyW', key: 'w'}", "{code: 'MetaLeft', key: 'Meta', metaKey: true}"):  # macOS: no keyup of W
        browser.execute_script(
            f"document.body.dispatchEvent(new KeyboardEvent('keydown', {{...{key}, bubbles: true}}))"
        )
    assert _sent(browser, "drive")[-1] == {"type": "drive", "ahead": 0, "turn": 0}


def test_a_gamepad_does_not_drive_a_page_that_is_hidden(browser, tell):
    browser.execute_script("navigator.getGamepads = () => [{ axes: [0, -1, 0, 0] }]")
    WebDriverWait(browser, 10).until(lambda page: any(each["ahead"] for each in _sent(page, "drive")))
    last = browser.execute_script(
        "Object.defineProperty(document, 'hidden', { value: true });"
        "document.dispatchEvent(new Event('visibilitychange')); return sent.at(-1)"
    )
    assert last == {"type": "drive", "ahead": 0, "turn": 0}


@pytest.mark.parametrize("panel", ["lines", "decision"])
def test_arrows_scroll_a_panel_that_has_the_focus_and_do_not_drive(browser, tell, panel):
    tell(*[{"type": "line", "text": str(number)} for number in range(50)])
    browser.execute_script("document.getElementById(arguments[0]).focus()", panel)
    _press(browser, Keys.ARROW_DOWN)
    assert _sent(browser, "drive") == []
    _press(browser, "w")
    assert _sent(browser, "drive") != []


def test_only_the_main_button_of_a_mouse_drives(browser, tell):
    ActionChains(browser).context_click(browser.find_element(By.ID, "pad")).perform()
    assert _sent(browser, "drive") == []


def _touch(browser: WebDriver, kind: str, *points: tuple[float, float]) -> None:
    browser.execute_cdp_cmd(
        "Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]}
    )


@pytest.mark.parametrize(
    "shows",
    [
        {"type": "control", "driver": "page 1", "asking": ""},  # a button that makes the panel higher
        {**STATE, "doing": "stopped by an obstacle that is less than 200 mm ahead, " * 3},  # a higher header
    ],
)
def test_what_the_page_shows_while_the_pad_is_touched_does_not_drive(browser, tell, shows):
    resize(browser, 390, 844, mobile=True)
    rect = browser.find_element(By.ID, "pad").rect
    x, y = rect["x"] + rect["width"] / 2, rect["y"] + rect["height"] / 2
    _touch(browser, "touchStart", (x, y))
    tell(shows)
    _touch(browser, "touchMove", (x + 20, y))
    _touch(browser, "touchMove", (x, y))
    _touch(browser, "touchEnd")
    drives = _sent(browser, "drive")
    assert any(each["turn"] for each in drives)
    assert all(abs(each["ahead"]) < 0.05 for each in drives), drives


def test_the_page_says_which_mission_runs(browser, tell):
    Select(browser.find_element(By.ID, "mission")).select_by_value("dog.toml")
    tell(RUN)
    assert "find the cat, profile thesis" in _text(browser, "mission-form")
    assert not browser.find_element(By.ID, "mission").is_displayed()
    tell({"type": "ended", "ending": "achieved", "duration_s": 3.0, "folder": "cat-001"})
    assert "find the cat" not in _text(browser, "mission-form")
    assert browser.find_element(By.ID, "mission").is_displayed()


def test_another_server_does_not_inherit_what_was_shown_of_the_last_one(browser, tell):
    tell(RUN, {"type": "line", "text": "searching for cat"}, {"type": "paused", "paused": True})
    decision = {"target": "cat", "failed": "lost", "known": [], "choice": "wait", "why": "x", "candidates": []}
    tell({"type": "decision", "t": 1.0, "chosen": None, "operator": False, **decision})
    tell(
        {"type": "record", "record": {"t": 1, "kind": "transition", "source": "idle", "to": "search", "event": "start"}}
    )
    tell(HELLO)
    assert _text(browser, "lines") == ""
    assert "None yet" in _text(browser, "decision")
    assert "idle" not in _text(browser, "chart")
    assert browser.find_element(By.ID, "pause").get_attribute("class") == ""


def test_a_new_connection_keeps_the_choice_of_the_mission(browser, tell):
    Select(browser.find_element(By.ID, "mission")).select_by_value("dog.toml")
    Select(browser.find_element(By.ID, "profile")).select_by_value("thesis")
    tell(HELLO)
    assert browser.find_element(By.ID, "mission").get_property("value") == "dog.toml"
    assert browser.find_element(By.ID, "profile").get_property("value") == "thesis"


def test_a_mission_shows_no_bumper_of_the_time_before(browser, tell):
    tell(
        {**STATE, "touching": True},
        RUN,
        {"type": "status", "doing": "search: cat", "stopped": False, "speed_limit": 60},
    )
    assert _text(browser, "bumper") == "–"


def test_an_old_picture_is_not_taken_for_a_new_one(browser, tell):
    camera = browser.find_element(By.ID, "camera")
    browser.execute_script("const now = performance.now(); performance.now = () => now + 3000")
    tell(STATE)
    assert camera.get_attribute("class") == "stale"
    tell({"type": "status", "doing": "search: cat"})  # the time of a simulated robot may stand still
    assert camera.get_attribute("class") == ""
    browser.execute_script("cut()")
    assert camera.get_attribute("class") == "stale"


def test_a_sonar_without_an_echo_does_not_promise_a_free_way(browser, tell):
    assert _text(browser, "range") == "no echo"
    tell({**STATE, "range_mm": 420})
    assert _text(browser, "range") == "0.42 m"


def test_of_a_sensor_that_the_robot_does_not_have_nothing_is_claimed(browser, tell):
    assert _text(browser, "bumper") == "free"
    tell({**STATE, "lacking": ["sonar", "bumper"]})
    assert [_text(browser, each) for each in ("range", "bumper")] == ["no sonar", "none"]


def test_while_a_sonar_fails_in_a_mission_the_distance_is_unknown(browser, tell):
    status = {"type": "status", "doing": "search: cat", "range_mm": None}
    sonar = {"t": 1, "kind": "sensor", "state": "search", "target": "cat", "sensor": "sonar"}
    fails, answers = ({"type": "record", "record": {**sonar, "answers": each}} for each in (False, True))
    tell(RUN, fails, status)
    assert _text(browser, "range") == "unknown"
    tell(answers, status)
    assert _text(browser, "range") == "no echo"
    tell(fails, {"type": "ended", "ending": "achieved", "duration_s": 3.0, "folder": "cat-001"}, STATE)
    assert _text(browser, "range") == "no echo"


def test_without_a_connection_no_measurement_is_shown(browser, tell):
    assert _text(browser, "battery") == "8.0 V"
    browser.execute_script("cut()")
    assert {_text(browser, each) for each in ("battery", "range", "bumper", "link")} == {"–"}


def test_without_the_brick_no_measurement_is_shown(browser, tell):
    measured = ("range_mm", "touching", "battery_mv", "latency_ms")
    tell({**{key: value for key, value in STATE.items() if key not in measured}, "doing": "cannot be driven"})
    assert _text(browser, "doing") == "cannot be driven"
    assert {_text(browser, each) for each in ("battery", "range", "bumper", "link")} == {"–"}


def test_why_the_brick_is_lost_is_shown_again_after_another_notice(browser, tell):
    browser.execute_script("window.later = []; window.setTimeout = (call) => later.push(call)")
    tell({"type": "link", "lost": "the cable is out"}, {"type": "refused", "text": "not now"})
    assert _text(browser, "notice") == "not now"
    browser.execute_script("later.forEach((call) => call())")
    assert _text(browser, "notice") == "the cable is out"


def test_the_name_of_a_target_at_the_edge_of_the_map_is_readable(browser, tell):
    resize(browser, 390, 844, mobile=True)
    browser.execute_script(LABELS)
    name = "the cat on the shelf"
    look = {"t": 1, "kind": "look", "state": "search", "target": name, "pose": [0, 0, 0], "range_mm": None}
    sighting = {"bearing_deg": 80, "distance_mm": 3000, "bound": False}
    tell({**RUN, "robot": SHAPE}, {"type": "record", "record": {**look, "sighting": sighting}})
    WebDriverWait(browser, 10).until(lambda page: page.execute_script("return labels[arguments[0]]", name))
    begin, end, width = browser.execute_script("return labels[arguments[0]]", name)
    assert 0 < begin < end <= width


def test_the_number_of_a_decision_is_readable_where_the_robot_stands(browser, tell):
    resize(browser, 1600, 1000)
    choice = {"t": 1, "kind": "choice", "state": "select", "target": "cat", "choice": "wait", "pose": [0, 0, 90]}
    tell({**RUN, "robot": SHAPE}, {"type": "record", "record": choice})
    here = browser.execute_async_script(INK, NUMBERS)
    tell({"type": "record", "record": {**choice, "kind": "step", "pose": [-500, 0, 90]}})
    assert here > 0.7 * browser.execute_async_script(INK, NUMBERS) > 0


@pytest.mark.parametrize(("before", "after"), [({}, {"running": True}), ({"saved": False}, {"saved": True})])
def test_the_map_begins_again_with_the_pose_when_the_robot_is_calibrated_or_built_otherwise(
    browser, tell, before, after
):
    calibration = {"type": "calibration", "running": False, "saved": True}
    tell({**calibration, **before}, {**STATE, "pose": [1000, 0, 0]}, {**calibration, **before})
    assert browser.execute_async_script(INK, PATH) > 0
    tell({**calibration, **after}, STATE)
    assert browser.execute_async_script(INK, PATH) == 0


def test_echoes_are_drawn_ahead_of_the_sonar_of_this_robot(browser, tell):
    resize(browser, 1600, 1000)
    tell({**STATE, "range_mm": 500})
    assert browser.execute_async_script(INK, ECHOES) == 0, "it lies under the field of view"
    tell({"type": "robot", **SHAPE, "sonar_forward_mm": 250}, {**STATE, "range_mm": 500})
    assert browser.execute_async_script(INK, ECHOES) > 0


def test_a_tap_on_a_state_says_what_it_means(browser, tell):
    chart = {"regions": [{"state": "mission", "inner": [{"state": "gave_up", "inner": []}]}], "initial": []}
    tell({**HELLO, "chart": {**chart, "words": {"mission": "all of it", "gave_up": "the target is left"}}})
    browser.find_element(By.XPATH, "//*[text()='gave up']").click()
    assert "gave up: the target is left" in _text(browser, "chart-panel")


def test_a_swipe_over_the_map_moves_the_page(browser, tell):
    script = "return getComputedStyle(document.getElementById('map')).touchAction"
    assert browser.execute_script(script) == "auto"


def test_a_calibration_can_start_after_a_mission_that_ended_with_its_server(browser, site, tell):
    browser.get(f"{site}calibrate.html")
    tell(HELLO, RUN)
    assert not browser.find_element(By.ID, "start").is_enabled()
    tell(HELLO)
    assert browser.find_element(By.ID, "start").is_enabled()


def test_a_calibration_says_what_was_not_calibrated_beside_how_good_it_is(browser, site, tell):
    browser.get(f"{site}calibrate.html")
    values = [
        {"key": "camera.yaw_deg", "before": 0.0, "after": -14.37, "standard_error": 0.18},
        {"key": "sonar.noise_mm", "before": None, "after": 7.1, "standard_error": None},
    ]
    calibration = {
        **{"type": "calibration", "running": False, "lines": [], "question": None, "problem": "", "values": values},
        **{"misfit_px": [5.1, 1.5], "views": 596, "remark": "The sonar was not calibrated: no echo."},
        **{"file": "robot.toml", "known": "none yet", "saved": False},
    }
    tell(HELLO, calibration)
    assert _text(browser, "misfit").startswith("The sonar was not calibrated: no echo. Markers were missed by 5.1 px")
    rows = [[each.text for each in row.find_elements(By.TAG_NAME, "td")] for row in _rows(browser)]
    assert rows == [["0", "-14.37", "0.18"], ["", "7.1", ""]]


def _rows(browser):
    return browser.find_element(By.ID, "values").find_elements(By.TAG_NAME, "tr")


def test_a_mission_that_cannot_be_saved_without_a_server_says_so(browser, site, tell):
    answers = "window.fetch = async (url) => new Response(String(url).endsWith('missions') ? '[]' : '# a mission')"
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": answers})
    browser.get(f"{site}missions.html")
    WebDriverWait(browser, 10).until(lambda page: page.find_element(By.ID, "text").get_property("value"))
    browser.execute_script("window.fetch = async () => { throw new TypeError('Failed to fetch'); }")
    browser.find_element(By.ID, "save").click()
    WebDriverWait(browser, 10).until(lambda page: "nxtdrive does not answer" in _text(page, "notice"))
    browser.execute_script(
        "document.getElementById('text').value = '# a mission'"
    )  # or the browser asks before it leaves


def test_a_list_of_runs_that_cannot_be_fetched_says_why(browser, site, tell):
    browser.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument",
        {"source": "window.fetch = async () => new Response('Enter the PIN first.', { status: 401 })"},
    )
    browser.get(f"{site}runs.html")
    WebDriverWait(browser, 10).until(lambda page: _text(page, "notice") == "Enter the PIN first.")
