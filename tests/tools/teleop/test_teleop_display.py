"""The camera's picture and the list of keys on the screen, from a phone's width to a desk's."""

import re

import numpy as np
import pytest

from behaviors.ports import Sighting
from nxtdrive.tools.teleop.controls import Controls
from nxtdrive.tools.teleop.latest_frame import BOXES_LAST_S, STALE_S, LatestFrame
from nxtdrive.vision.annotate import CONFIRMED, UNCONFIRMED
from nxtdrive.vision.camera import Frame
from nxtdrive.vision.detection import Detection
from tests.tools.teleop.on_screen import app_of, play, text, until, until_panel, widget

RED, BLUE = (0, 0, 200), (200, 0, 0)
BOX = (80, 60, 40, 40)


def frame(time_s=0.0, color=RED, size=(320, 240)):
    return Frame(np.full((size[1], size[0], 3), color, np.uint8), time_s, 0)


def sighting(box=BOX):
    return Sighting("lena", 0.0, 900.0, 0.9, 0.0, box)


@pytest.mark.parametrize(
    ("room", "size"), [((78, 40), (53, 40)), ((36, 200), (36, 27)), ((1, 1), (1, 1)), ((640, 480), (640, 480))]
)
def test_the_picture_fits_and_keeps_its_shape(room, size):
    latest = LatestFrame()
    latest.frame(frame())
    assert latest.fitted(*room).shape[1::-1] == size


@pytest.mark.parametrize("room", [(0, 10), (10, 0)])
def test_without_room_or_frame_there_is_no_picture(room):
    latest = LatestFrame()
    assert latest.fitted(80, 48) is None
    assert latest.age_s(3.0) is None
    latest.frame(frame())
    assert latest.fitted(*room) is None


def test_only_the_latest_frame_is_shown():
    latest = LatestFrame()
    latest.frame(frame(1.0, RED))
    latest.frame(frame(2.0, BLUE))
    assert tuple(latest.fitted(4, 3)[0, 0]) == BLUE
    assert latest.age_s(2.5) == 0.5


def test_found_boxes_are_green_and_others_orange_in_later_frames_too():
    latest = LatestFrame()
    latest.frame(frame(1.0))
    latest.look(frame(0.9), "lena", sighting(), [Detection(BOX, 0.9), Detection((200, 100, 40, 40), 0.4)])
    small = latest.fitted(80, 60)
    assert tuple(small[15, 20]) == tuple(small[25, 30]) == CONFIRMED
    assert tuple(small[25, 50]) == UNCONFIRMED
    assert tuple(small[20, 25]) == RED
    latest.frame(frame(1.0 + BOXES_LAST_S))
    assert tuple(latest.fitted(80, 60)[15, 20]) == RED


def test_frames_that_only_looks_have_are_shown():
    latest = LatestFrame()
    latest.look(frame(1.0, BLUE), "lena", None, [])
    assert tuple(latest.fitted(4, 3)[0, 0]) == BLUE


def test_two_pixels_share_a_character():
    from rich.style import Style

    from nxtdrive.tools.teleop.widgets import HALF_BLOCK, half_blocks

    image = np.array([[RED, RED, BLUE], [BLUE, BLUE, RED], [RED, RED, RED]], np.uint8)
    top, first, second, bottom = half_blocks(image, 5, 4, Style())
    assert top.text == bottom.text == " " * 5
    assert [segment.text for segment in first] == [" ", HALF_BLOCK * 2, HALF_BLOCK, " "]
    colors = [(tuple(each.style.color.triplet), tuple(each.style.bgcolor.triplet)) for each in list(first)[1:3]]
    assert colors == [((200, 0, 0), (0, 0, 200)), ((0, 0, 200), (200, 0, 0))]
    assert tuple(list(second)[1].style.bgcolor.triplet) == (0, 0, 0)


@pytest.fixture
def screen(room):
    """Plays on a screen of a size: screen(size, act, latest=None, why_no_camera="") and checks that it ended well."""

    def show(size, act, **options):
        _, brick = room(realtime=True)
        app = app_of(brick, **options)

        async def to_the_end(pilot):
            await until_panel(pilot, "at rest")
            await act(app, pilot, brick.now)
            app.action_leave()
            await until(pilot, lambda: not app.is_running)

        play(app, to_the_end, size)
        assert app.failure is None

    return show


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "seen"),
    [((40, 20), False), ((40, 40), True), ((80, 24), True), ((120, 40), True), ((24, 8), False)],
)
def test_every_size_shows_the_state_and_the_picture_goes_first(screen, size, seen):
    latest, controls = LatestFrame(), Controls(300.0, 120.0)

    async def act(app, pilot, now):
        latest.frame(frame(now() + 60))
        controls.emergency_stop()
        await until_panel(pilot, "EMERGENCY")
        camera, panel = widget(app, "camera"), widget(app, "panel")
        assert camera.display is seen
        assert panel.region.height >= 4
        assert panel.region.right <= size[0]
        if seen:
            await until(pilot, lambda: any(segment.style.color for segment in camera.render_line(2)))
            assert camera.region.bottom <= widget(app, "map").region.y
            assert widget(app, "map").region.height >= 5
        shown = app.export_screenshot()
        assert "EMERGENCY" in shown
        assert "STOP" in shown

    screen(size, act, latest=latest, controls=controls)


@pytest.mark.slow
def test_a_picture_that_no_longer_comes_is_reported(screen):
    latest = LatestFrame()

    async def act(app, pilot, now):
        latest.frame(frame(now() - STALE_S - 3))
        await until(pilot, lambda: widget(app, "camera").has_class("alarm"))
        assert "NO PICTURE" in str(widget(app, "camera").border_subtitle)
        latest.frame(frame(now() + 60))
        await until(pilot, lambda: not widget(app, "camera").has_class("alarm"))

    screen((80, 24), act, latest=latest)


@pytest.mark.slow
@pytest.mark.parametrize("size", [(40, 20), (80, 24)])
def test_without_a_camera_one_line_says_so(screen, size):
    async def act(app, pilot, now):
        await until_panel(pilot, "camera 0 gives no frames.")
        assert not app.query("#camera")

    screen(size, act, why_no_camera="camera 0 gives no frames.")


@pytest.mark.slow
def test_a_robot_without_sonar_and_bumper_is_not_shown_as_safe(screen):
    async def act(app, pilot, now):
        await until(pilot, lambda: re.search("ahead +no sonar", text(app, "panel")))
        assert re.search("bumper +none", text(app, "panel"))

    screen((100, 40), act, lacking=["sonar", "bumper"])


def listed(app):
    return len(app.screen_stack) == 2


@pytest.mark.slow
def test_any_key_closes_the_list_of_keys_and_does_its_work(screen):
    async def act(app, pilot, now):
        await pilot.press("question_mark")
        await until(pilot, lambda: listed(app))
        await until(pilot, lambda: "Ctrl-C" in app.export_screenshot())
        await pilot.press("escape")
        await until(pilot, lambda: not listed(app))
        assert app.is_running
        await pilot.press("question_mark")
        await until(pilot, lambda: listed(app))
        await pilot.press("d")
        await until_panel(pilot, "driving")
        assert not listed(app)
        await pilot.press("question_mark", "space")
        await until_panel(pilot, "EMERGENCY")
        assert not listed(app)
        for key in ("question_mark", "enter"):
            await pilot.press("question_mark")
            await until(pilot, lambda: listed(app))
            await pilot.press(key)
            await until(pilot, lambda: not listed(app))
        await pilot.pause(0.2)
        assert "EMERGENCY" in text(app, "panel")

    screen((40, 20), act)
