"""The page and the picture of the chart show the chart as it is."""

from pathlib import Path
from xml.etree import ElementTree as Xml

from behaviors.diagram import StateNode, arrows, regions
from nxtdrive.tools.dev.statechart import PAGE, PICTURE, page
from nxtdrive.tools.dev.statechart_picture import PLACES, ROUTES, SIZE, picture

ROOT = Path(__file__).parents[3]


def _names(box: StateNode) -> set[str]:
    return {box.state}.union(*(_names(inner) for inner in box.inner))


def test_the_page_is_the_chart_as_it_is():
    assert (ROOT / PAGE).read_text(encoding="utf-8") == page()


def test_the_picture_is_the_chart_as_it_is():
    assert (ROOT / PICTURE).read_text(encoding="utf-8") == picture()


def test_the_picture_shows_every_state_and_every_transition_once():
    svg = Xml.fromstring(picture())
    shown = [each.get("data-state") for each in svg.iter() if each.get("data-state")]
    assert sorted(shown) == sorted({"done", "resume_here", "recover_here"}.union(*map(_names, regions())))
    drawn = {(each.get("data-from"), each.get("data-to")): each.get("data-on") for each in svg.iter()}
    for arrow in arrows():
        assert (arrow.event or arrow.guard) in drawn[arrow.source, arrow.target], arrow
    assert {(arrow.source, arrow.target) for arrow in arrows()} == set(ROUTES)


def test_everything_is_on_the_picture():
    width, height = SIZE
    places = [*PLACES.values(), *(place for route in ROUTES.values() for place in (*route.points, route.label))]
    assert all(0 < x < width and 0 < y < height for x, y in places)
