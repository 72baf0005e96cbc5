"""A run's replay in a real browser: from the server, and as one file from disk."""

from __future__ import annotations

import json
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import uvicorn
from selenium.webdriver import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.remote.webdriver import WebDriver
from selenium.webdriver.support.ui import WebDriverWait
from starlette.applications import Starlette
from starlette.responses import FileResponse, JSONResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission
from behaviors.ports import Sighting
from nxtdrive.cli.main import DONE, main
from nxtdrive.recording.camera_folder import CameraFolder
from nxtdrive.recording.camera_index import looked
from nxtdrive.recording.run_folder import RunFolder
from nxtdrive.recording.run_reader import read_run
from nxtdrive.tools.web.app import STATIC
from nxtdrive.tools.web.replay_data import replay_data
from nxtdrive.tools.web.robot_shape import robot_shape
from nxtdrive.tools.web.runs import Runs

WAIT_S = 40
HOSTILE = "</script><script>document.title = 'broken out'</script><!--<script>"
BOX = (100, 60, 80, 80)
COLOURS = {0.0: 40, 4.0: 120, 8.0: 200}
"""Mission time of each picture and its grey."""


def _look(time_s, x_mm):
    return Record(time_s, RecordKind.LOOK, "arrive", HOSTILE, {"pose": [x_mm, 0, 0], "range_mm": 800, "sighting": None})


def _choice(time_s, choice):
    return Record(
        time_s, RecordKind.CHOICE, "arrive", HOSTILE, {"choice": choice, "why": HOSTILE, "evidence": {"reason": "x"}}
    )


def _entered(time_s, state):
    data = {"source": "idle", "to": state, "event": None}
    return Record(time_s, RecordKind.TRANSITION, state, HOSTILE, data)


TARGETS = {HOSTILE: "reached", "lena": "gave_up"}
RECORDS = [
    Record(0.0, RecordKind.START, "idle", HOSTILE, {"format": 2, "mission": HOSTILE, "targets": [HOSTILE]}),
    _entered(0.0, "search"),
    _look(1.0, 0),
    _choice(3.0, "wait"),
    _entered(3.0, "wait"),
    _look(5.0, 2000),
    _choice(6.0, "detour"),
    _entered(6.0, "detour"),
    _look(9.0, 4000),
    Record(10.009, RecordKind.END, "finished", HOSTILE, {"ending": "achieved", "targets": TARGETS, "error": ""}),
]


@pytest.fixture(name="run")
def _run(tmp_path) -> Path:
    """A run of ten seconds with three pictures; the second has a box."""
    path = tmp_path / "runs" / "run-001"
    path.mkdir(parents=True)
    folder = RunFolder(path)
    for record in RECORDS:
        folder(record)
    folder.close()
    camera = CameraFolder(path / "camera")
    for time_s, grey in COLOURS.items():
        sighting = Sighting(HOSTILE, 3.0, 900.0, 1.0, time_s, BOX) if grey == 120 else None
        camera.add(np.full((240, 320, 3), grey, np.uint8), time_s, looked(HOSTILE, sighting, []))
    camera.close()
    return path


def _exported(run: Path, *options: str) -> str:
    page = run.parent / "page.html"
    assert main(["export", str(run), "--html", str(page), *options]) == DONE
    return page.read_text(encoding="utf-8")


def test_an_exported_page_needs_nothing_else(run, capsys):
    page = _exported(run)
    said = capsys.readouterr().out
    assert "page.html: " in said
    assert "3 of 3 pictures" in said
    assert 'src="' not in page
    assert 'href="' not in page.replace('href="data:,"', "")
    assert 'from "./' not in page
    assert page.count("data:image/jpeg;base64,") == 3


def test_the_hints_of_a_run_are_its_last_lines(run):
    (run / "summary.json").write_text('{"hints": ["Measure the print."]}', encoding="utf-8")
    data = replay_data("run-001", read_run(run), None, lambda _: "")
    assert data["lines"][-1] == {"t": RECORDS[-1].time_s, "text": "hint: Measure the print."}


@pytest.mark.parametrize(("tables", "yaw_deg"), [({}, 0.0), ({"camera": {"yaw_deg": 12.0, "forward_mm": 70.0}}, 12.0)])
def test_the_pages_map_shows_where_the_lens_and_the_sonar_are(tables, yaw_deg):
    marker = {"mission": {"targets": ["tag"]}, "target": {"tag": {"detector": "marker", "id": 7}}}
    shape = robot_shape(Mission.model_validate({**marker, **tables}))
    assert shape["yaw_deg"] == yaw_deg
    assert shape["hfov_deg"] == 60.0
    assert robot_shape(None).keys() == shape.keys()


def test_no_text_of_a_run_can_break_out_of_the_page(run):
    page = _exported(run)
    assert HOSTILE not in page
    assert page.count("</script") == 3


@pytest.mark.parametrize(
    ("options", "count"), [(("--no-camera",), 0), (("--fps", "0.125"), 2), (("--fps", "0.1"), 1), (("--fps", "5"), 3)]
)
def test_a_page_may_have_fewer_pictures(run, options, count):
    assert _exported(run, *options).count("data:image/jpeg") == count


def test_pictures_that_are_too_many_are_thinned(run, monkeypatch):
    monkeypatch.setattr("nxtdrive.cli.commands.export.MAX_PAGE_BYTES", 40)
    assert _exported(run).count("data:image/jpeg") == 1


def test_anything_that_is_not_a_picture_does_not_get_into_the_page(run, tmp_path):
    (tmp_path / "secret").write_text("secret", encoding="utf-8")
    (run / "camera" / "000001.jpg").unlink()
    (run / "camera" / "000001.jpg").symlink_to(tmp_path / "secret")
    (run / "camera" / "000002.jpg").unlink()
    assert _exported(run).count("data:image/jpeg") == 1


def test_the_default_file_is_in_the_runs_folder(run, capsys):
    assert main(["export", str(run / "journal.jsonl"), "--html", "--webm"]) == DONE
    assert [line.partition(":")[0] for line in capsys.readouterr().out.splitlines()] == [
        str(run / "replay.html"),
        str(run / "camera.webm"),
    ]


def test_an_export_of_nothing_names_what_there_is(run, refused):
    said = refused("export", run)
    assert all(option in said for option in ("--html", "--webm"))


def test_two_formats_in_one_file_are_refused(run, refused):
    both = run.parent / "both"
    assert "two formats have the same file" in refused("export", run, "--html", both, "--csv", run / ".." / "both")
    assert not both.exists()


def test_a_video_of_a_run_without_pictures_is_refused(run, refused):
    shutil.rmtree(run / "camera")
    assert "has no pictures" in refused("export", run, "--webm")
    assert _exported(run)


def test_a_file_that_cannot_be_written_is_a_sentence(run, refused):
    for option in ("--html", "--webm"):
        assert "cannot be written" in refused("export", run, option, run / "gone" / "file")


def in_browser(test):
    """Mark a test that needs a browser."""
    return pytest.mark.slow(pytest.mark.xdist_group("browser")(test))


@pytest.fixture(params=["server", "file"])
def page(request, run) -> Iterator[str]:
    """The replay's address."""
    if request.param == "file":
        _exported(run)
        yield (run.parent / "page.html").as_uri()
        return
    runs = Runs(run.parent)
    routes = [
        Route("/api/runs/{name}", lambda request: JSONResponse(runs.replay(request.path_params["name"]))),
        Route("/runs/{name}/{file:path}", lambda request: FileResponse(runs.file(**request.path_params))),
        Mount("/", StaticFiles(directory=STATIC, html=True)),
    ]
    server = uvicorn.Server(uvicorn.Config(Starlette(routes=routes), port=0, log_level="warning", lifespan="off"))
    thread = threading.Thread(target=server.run)
    thread.start()
    while not server.started:
        assert thread.is_alive()
    yield f"http://127.0.0.1:{server.servers[0].sockets[0].getsockname()[1]}/replay.html?run={run.name}"
    server.should_exit = True
    thread.join()


@in_browser
def test_the_page_names_the_profile_that_the_mission_had(browser, run):
    mission = {"mission": {"targets": ["tag"]}, "target": {"tag": {"detector": "marker", "id": 7}}}
    (run / "mission.json").write_text(json.dumps(mission), encoding="utf-8")
    _exported(run)
    browser.get((run.parent / "page.html").as_uri())
    _until_grey(browser, 40)
    assert _text(browser, "what") == f"{HOSTILE}, profile adaptive"


def _seek(browser: WebDriver, time_s: float) -> None:
    script = (
        "const bar = document.getElementById('time'); bar.value = arguments[0]; bar.dispatchEvent(new Event('input'))"
    )
    browser.execute_script(script, time_s)


def _pixel(browser: WebDriver, x: int, y: int) -> list[int]:
    context = "document.getElementById('camera').getContext('2d')"
    return list(browser.execute_script(f"return [...{context}.getImageData({x}, {y}, 1, 1).data]"))


def _until_grey(browser: WebDriver, grey: int) -> None:
    WebDriverWait(browser, WAIT_S).until(lambda page: abs(_pixel(page, 5, 230)[0] - grey) < 5)


def _map(browser: WebDriver) -> str:
    return str(browser.execute_script("return document.getElementById('map').toDataURL()"))


def _text(browser: WebDriver, element: str) -> str:
    return browser.find_element(By.ID, element).text


def _lit(browser: WebDriver) -> list[str]:
    return [each.text for each in browser.find_elements(By.CSS_SELECTOR, ".state.active:not(.compound)")]


@in_browser
def test_the_time_bar_moves_picture_map_chart_lines_and_decision_together(browser, page):
    browser.get(page)
    _until_grey(browser, 40)
    assert browser.title == f"nxtdrive: {HOSTILE}"
    assert _text(browser, "what") == f"{HOSTILE}, profile not known"
    empty = _map(browser)
    _seek(browser, 5.5)
    _until_grey(browser, 120)
    green, inside = _pixel(browser, BOX[0], BOX[1] + 40), _pixel(browser, BOX[0] + 40, BOX[1] + 40)
    assert green[1] > green[0] + 100, "the box of the sighting"
    assert max(inside[:3]) - min(inside[:3]) < 5
    WebDriverWait(browser, WAIT_S).until(lambda _: _map(browser) != empty)
    assert "wait" in _lit(browser)
    assert _text(browser, "decision").startswith("Decision at 3.0 s")
    browser.find_element(By.TAG_NAME, "body").send_keys("J")
    assert "detour" in _lit(browser)
    assert _text(browser, "clock") == "6.0 of 10.0 s"
    browser.find_element(By.ID, "back").click()
    assert "wait" in _lit(browser)
    _until_grey(browser, 40)
    _seek(browser, browser.find_element(By.ID, "time").get_property("max"))  # the bar's end
    assert _text(browser, "doing") == f"achieved; {HOSTILE}: reached; lena: gave up"


@in_browser
def test_the_keys_play_and_move(browser, page):
    browser.get(page)
    _until_grey(browser, 40)
    keys = ActionChains(browser)
    keys.send_keys(Keys.ARROW_RIGHT * 3, Keys.ARROW_LEFT).perform()
    assert _text(browser, "clock").startswith("2.0 of")
    browser.execute_script("document.getElementById('rate').value = '4'")
    ActionChains(browser).send_keys(Keys.SPACE).perform()
    assert _text(browser, "play") == "Pause"
    _until_grey(browser, 200)
    WebDriverWait(browser, WAIT_S).until(lambda _: _text(browser, "play") == "Play")
    assert _text(browser, "clock") == "10.0 of 10.0 s"
    ActionChains(browser).send_keys(Keys.HOME).perform()
    _until_grey(browser, 40)


@in_browser
def test_a_browser_plays_the_video(browser, run):
    assert main(["export", str(run), "--webm"]) == DONE
    (run / "video.html").write_text('<video id="video" src="camera.webm" preload="auto">', encoding="utf-8")
    browser.get((run / "video.html").as_uri())
    state = (
        "const video = document.getElementById('video'); return [video.readyState, video.videoWidth, video.duration]"
    )
    WebDriverWait(browser, WAIT_S).until(lambda page: page.execute_script(state)[0] >= 2)
    _, width, duration_s = browser.execute_script(state)
    assert width == 320
    assert duration_s == pytest.approx(8.2, abs=0.2), "until the last picture"


WRITTEN = """
const write = CanvasRenderingContext2D.prototype.fillText;
window.written = [];
CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
  written.push(text);
  write.call(this, text, ...place);
};
"""


@in_browser
@pytest.mark.parametrize("page", ["file"], indirect=True)
@pytest.mark.parametrize(
    ("places_mm", "labels"),
    [((0, 30, 10), {"1–3"}), ((0, 30, 2000, 10), {"1, 2, 4", "3"}), ((0, 2000), {"1", "2"})],
    ids=["one place", "and back", "apart"],
)
def test_decisions_at_one_place_share_a_label(browser, run, page, places_mm, labels):
    records = [RECORDS[0]]
    for time_s, x_mm in enumerate(places_mm, 1):
        records += [_look(time_s, x_mm), _choice(time_s, "wait")]
    (run / "journal.jsonl").write_text("".join(f"{record.to_json()}\n" for record in records), encoding="utf-8")
    _exported(run)
    browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {"source": WRITTEN})
    browser.get(page)
    _until_grey(browser, 40)
    browser.execute_script("written.length = 0")
    _seek(browser, 4)
    numbers = "return written.filter((text) => /^[0-9–, ]+$/.test(text))"
    WebDriverWait(browser, WAIT_S).until(lambda shown: set(shown.execute_script(numbers)) >= labels)


@in_browser
@pytest.mark.parametrize("page", ["file"], indirect=True)
def test_a_line_that_wraps_continues_beside_its_time(browser, page):
    browser.get(page)
    _until_grey(browser, 40)
    _seek(browser, 10)
    edges = browser.execute_script("""
        const line = document.querySelector('#lines li.timed');
        line.firstChild.appendData(" and so on".repeat(40));
        const range = document.createRange();
        range.selectNodeContents(line);
        const lines = Object.groupBy(range.getClientRects(), ({ top }) => top);
        return Object.values(lines).map(([first]) => first.left);
    """)
    assert len(edges) > 2
    assert max(edges[1:]) == min(edges[1:]) > edges[0] + 50
