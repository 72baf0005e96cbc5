"""The statechart as a picture to hang up; the layout is by hand, the content comes from the chart.

``python -m tools.dev.statechart`` writes it.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from xml.etree import ElementTree as Xml

from behaviors.chart_words import EVENTS, STATES
from behaviors.diagram import Transition, arrows
from behaviors.events import Event

Place = tuple[float, float]

SIZE = (1720, 1400)
BOX = (164, 66)
INK, PALE, PAPER = "#22303c", "#71808d", "#ffffff"
GOAL, FAIL, CHOICE, OTHER = "#0a7d5c", "#c0392b", "#2563b0", "#5b6672"
FONT = "DejaVu Sans, Verdana, Helvetica, sans-serif"

PLACES: dict[str, Place] = {
    "idle": (150, 168),
    "suspended": (640, 168),
    "finished": (1150, 168),
    "search": (170, 430),
    "arrive": (490, 430),
    "verify": (810, 430),
    "reached": (1080, 430),
    "select": (650, 640),
    "left": (1080, 620),
    "gave_up": (1080, 740),
    "retreat": (320, 750),
    "move_to": (190, 1010),
    "detour": (420, 1010),
    "rescan": (640, 1010),
    "wait": (850, 1010),
    "up": (1400, 190),
    "down": (1610, 190),
    "clear": (1400, 490),
    "held": (1610, 490),
    "tripped": (1505, 640),
    "seeing": (1400, 836),
    "blind": (1610, 836),
    "trusted": (1400, 1080),
    "distrusted": (1610, 1080),
    "gripping": (1400, 1291),
    "slipping": (1610, 1291),
}
"""The middle of each state."""

FRAMES: dict[str, tuple[float, float, float, float]] = {
    "mission": (30, 90, 1250, 1075),
    "active": (50, 250, 1210, 893),
    "recover": (80, 890, 880, 230),
    "equipment": (1300, 90, 400, 220),
    "safety": (1300, 340, 400, 370),
    "camera": (1300, 740, 400, 170),
    "floor_map": (1300, 940, 400, 225),
    "wheels": (1300, 1195, 400, 175),
}
"""Left, top, width and height of each compound."""

CIRCLES: dict[str, Place] = {"resume_here": (690, 280), "recover_here": (340, 922), "done": (1262, 168)}
BEGINNINGS: dict[str, tuple[Place, Place]] = {
    "idle": ((42, 168), (68, 168)),
    "search": ((205, 358), (205, 397)),
    "up": ((1345, 134), (1345, 157)),
    "clear": ((1345, 434), (1345, 457)),
    "seeing": ((1345, 780), (1345, 803)),
    "trusted": ((1345, 1024), (1345, 1047)),
    "gripping": ((1345, 1235), (1345, 1258)),
}
"""The dots at which regions and compounds begin, and where their arrows end."""


@dataclass(frozen=True, slots=True)
class Route:
    """How the arrow between two states is drawn.

    Attributes:
        color: Colour of line and label.
        points: Its corners.
        label: The middle of its label's first line.
    """

    color: str
    points: tuple[Place, ...]
    label: Place


ROUTES: dict[tuple[str, str], Route] = {
    ("idle", "active"): Route(GOAL, ((150, 201), (150, 250)), (176, 230)),
    ("idle", "finished"): Route(OTHER, ((150, 135), (150, 112), (1150, 112), (1150, 135)), (395, 107)),
    ("active", "suspended"): Route(OTHER, ((590, 250), (590, 201)), (556, 230)),
    ("active", "finished"): Route(OTHER, ((1130, 250), (1130, 201)), (1100, 230)),
    ("suspended", "resume_here"): Route(OTHER, ((690, 201), (690, 266)), (752, 230)),
    ("suspended", "finished"): Route(OTHER, ((722, 168), (1068, 168)), (895, 162)),
    ("search", "arrive"): Route(GOAL, ((252, 430), (408, 430)), (330, 424)),
    ("search", "select"): Route(FAIL, ((210, 463), (210, 630), (568, 630)), (320, 624)),
    ("arrive", "arrive"): Route(GOAL, ((420, 397), (420, 372), (460, 372), (460, 397)), (440, 366)),
    ("arrive", "verify"): Route(GOAL, ((572, 416), (728, 416)), (650, 410)),
    ("verify", "arrive"): Route(GOAL, ((728, 446), (572, 446)), (650, 464)),
    ("verify", "verify"): Route(GOAL, ((760, 397), (760, 372), (800, 372), (800, 397)), (780, 366)),
    ("arrive", "reached"): Route(GOAL, ((530, 397), (530, 340), (1110, 340), (1110, 397)), (640, 334)),
    ("verify", "reached"): Route(GOAL, ((892, 430), (998, 430)), (945, 424)),
    ("arrive", "select"): Route(FAIL, ((540, 463), (540, 560), (620, 560), (620, 607)), (588, 500)),
    ("verify", "select"): Route(FAIL, ((810, 463), (810, 560), (680, 560), (680, 607)), (858, 500)),
    ("arrive", "retreat"): Route(FAIL, ((430, 463), (430, 700), (350, 700), (350, 717)), (384, 580)),
    ("retreat", "select"): Route(FAIL, ((402, 750), (610, 750), (610, 673)), (446, 744)),
    ("retreat", "recover_here"): Route(CHOICE, ((340, 783), (340, 908)), (372, 850)),
    ("select", "wait"): Route(CHOICE, ((690, 673), (690, 940), (850, 940), (850, 977)), (850, 962)),
    ("select", "move_to"): Route(CHOICE, ((690, 673), (690, 940), (190, 940), (190, 977)), (190, 962)),
    ("select", "detour"): Route(CHOICE, ((690, 673), (690, 940), (420, 940), (420, 977)), (420, 962)),
    ("select", "rescan"): Route(CHOICE, ((690, 673), (690, 940), (640, 940), (640, 977)), (640, 962)),
    ("select", "left"): Route(CHOICE, ((732, 630), (998, 630)), (865, 624)),
    ("select", "gave_up"): Route(CHOICE, ((732, 652), (800, 652), (800, 740), (998, 740)), (890, 734)),
    ("recover", "arrive"): Route(GOAL, ((490, 890), (490, 463)), (532, 840)),
    ("recover", "search"): Route(CHOICE, ((130, 890), (130, 463)), (180, 700)),
    ("recover", "select"): Route(FAIL, ((720, 890), (720, 673)), (775, 840)),
    ("move_to", "retreat"): Route(FAIL, ((272, 1000), (305, 1000), (305, 783)), (258, 840)),
    ("detour", "retreat"): Route(FAIL, ((338, 1000), (305, 1000), (305, 783)), (305, 1064)),
    ("move_to", "move_to"): Route(CHOICE, ((160, 1043), (160, 1080), (220, 1080), (220, 1043)), (190, 1096)),
    ("detour", "detour"): Route(CHOICE, ((390, 1043), (390, 1080), (450, 1080), (450, 1043)), (420, 1096)),
    ("reached", "search"): Route(GOAL, ((1050, 397), (1050, 308), (140, 308), (140, 397)), (985, 286)),
    ("reached", "finished"): Route(GOAL, ((1162, 430), (1225, 430), (1225, 201)), (1208, 286)),
    ("left", "search"): Route(CHOICE, ((1162, 620), (1190, 620), (1190, 308), (140, 308), (140, 397)), (1136, 566)),
    ("gave_up", "search"): Route(CHOICE, ((1162, 730), (1190, 730), (1190, 308), (140, 308), (140, 397)), (1136, 684)),
    ("gave_up", "finished"): Route(CHOICE, ((1162, 752), (1225, 752), (1225, 201)), (1204, 790)),
    ("robot", "done"): Route(OTHER, ((1232, 168), (1254, 168)), (1230, 128)),
    ("up", "down"): Route(FAIL, ((1482, 176), (1528, 176)), (1505, 112)),
    ("down", "up"): Route(GOAL, ((1528, 206), (1482, 206)), (1505, 242)),
    ("clear", "held"): Route(FAIL, ((1482, 476), (1528, 476)), (1505, 448)),
    ("held", "clear"): Route(GOAL, ((1528, 506), (1482, 506)), (1505, 540)),
    ("held", "held"): Route(FAIL, ((1590, 457), (1590, 420), (1640, 420), (1640, 457)), (1615, 412)),
    ("clear", "tripped"): Route(FAIL, ((1380, 523), (1380, 640), (1423, 640)), (1430, 574)),
    ("held", "tripped"): Route(FAIL, ((1630, 523), (1630, 640), (1587, 640)), (1582, 574)),
    ("seeing", "blind"): Route(FAIL, ((1482, 822), (1528, 822)), (1505, 798)),
    ("blind", "seeing"): Route(GOAL, ((1528, 852), (1482, 852)), (1505, 884)),
    ("trusted", "distrusted"): Route(FAIL, ((1482, 1066), (1528, 1066)), (1505, 1038)),
    ("distrusted", "trusted"): Route(GOAL, ((1528, 1096), (1482, 1096)), (1505, 1130)),
    ("trusted", "trusted"): Route(OTHER, ((1370, 1047), (1370, 1010), (1430, 1010), (1430, 1047)), (1400, 990)),
    ("distrusted", "distrusted"): Route(OTHER, ((1580, 1047), (1580, 1010), (1640, 1010), (1640, 1047)), (1610, 990)),
    ("gripping", "slipping"): Route(FAIL, ((1482, 1277), (1528, 1277)), (1505, 1253)),
    ("slipping", "gripping"): Route(GOAL, ((1528, 1307), (1482, 1307)), (1505, 1339)),
}
"""Every pair of states with a transition."""

STYLE = f"""
text {{ font-family: {FONT}; fill: {INK}; }}
.name {{ font-size: 15px; font-weight: bold; text-anchor: middle; }}
.words {{ font-size: 10.5px; fill: {PALE}; text-anchor: middle; }}
.region {{ font-size: 15px; font-weight: bold; }}
.label {{ font-size: 11.5px; text-anchor: middle; paint-order: stroke; stroke: {PAPER}; stroke-width: 4px; }}
.legend {{ font-size: 11px; fill: {OTHER}; }}
.title {{ font-size: 27px; font-weight: bold; }}
.subtitle {{ font-size: 14px; fill: {PALE}; }}
"""
LEGEND = (
    (GOAL, "towards the target"),
    (FAIL, "something failed or is in the way"),
    (CHOICE, "recovery and change of target"),
    (OTHER, "supervision"),
)
TITLE = "The statechart of a mission"
SUBTITLE = (
    "nxtdrive: six regions run side by side. An arrow with an event is taken when the robot reports it, an arrow "
    "without one at once."
)
NOTES = (
    ("[ ]", "a guard, which must hold"),
    ("/", "what the chart does meanwhile"),
    ("H", "history: back to where it was (H*: deep)"),
)
LINE_PX = 14
CORNER_RADIUS = 10.0
WIDEST = 28
"""Number of characters that fit into the width of a state."""


def picture() -> str:
    """Return the picture as SVG."""
    width, height = SIZE
    svg = Xml.Element("svg", xmlns="http://www.w3.org/2000/svg", viewBox=f"0 0 {width} {height}", role="img")
    Xml.SubElement(svg, "title").text = TITLE
    Xml.SubElement(svg, "style").text = STYLE
    _rect(svg, (0, 0, width, height), fill=PAPER)
    _text(svg, (30, 46), TITLE, "title")
    _text(svg, (30, 72), SUBTITLE, "subtitle")
    for color in (GOAL, FAIL, CHOICE, OTHER, INK):
        _arrowhead(svg, color)
    for name, frame in FRAMES.items():
        _frame(svg, name, frame)
    _legend(svg, (60, 1215))
    joined = [(pair, list(group)) for pair, group in groupby(sorted(arrows(), key=_pair), key=_pair)]
    for pair, group in joined:
        _line(svg, pair, group)
    for name, place in PLACES.items():
        _state(svg, name, place)
    for name, place in CIRCLES.items():
        _circle(svg, name, place)
    for ends in BEGINNINGS.values():
        _beginning(svg, *ends)
    for pair, group in joined:
        _label(svg, pair, group)
    Xml.indent(svg)
    return Xml.tostring(svg, encoding="unicode") + "\n"


def _legend(parent: Xml.Element, place: Place) -> None:
    x, y = place
    for number, (color, meaning) in enumerate(LEGEND):
        Xml.SubElement(parent, "path", {"d": f"M{x:g} {y + 24 * number:g}h28", "stroke": color, "stroke-width": "3"})
        _text(parent, (x + 38, y + 4 + 24 * number), meaning, "legend")
    for number, (sign, meaning) in enumerate(NOTES, start=len(LEGEND)):
        _text(parent, (x + 14, y + 4 + 24 * number), sign, "legend", style="text-anchor:middle;font-weight:bold")
        _text(parent, (x + 38, y + 4 + 24 * number), meaning, "legend")


def _pair(arrow: Transition) -> tuple[str, str]:
    return arrow.source, arrow.target


def _text(parent: Xml.Element, place: Place, text: str, kind: str, **more: str) -> None:
    attributes = {"x": f"{place[0]:g}", "y": f"{place[1]:g}", "class": kind, **more}
    Xml.SubElement(parent, "text", attributes).text = text


def _rect(parent: Xml.Element, frame: tuple[float, float, float, float], **more: str) -> None:
    names = ("x", "y", "width", "height")
    attributes = {name: f"{value:g}" for name, value in zip(names, frame, strict=True)}
    Xml.SubElement(parent, "rect", {**attributes, **more})


def _arrowhead(parent: Xml.Element, color: str) -> None:
    attributes = {"id": f"head{color[1:]}", "viewBox": "0 0 10 10", "refX": "9", "refY": "5", "orient": "auto"}
    marker = Xml.SubElement(parent, "marker", {**attributes, "markerWidth": "7", "markerHeight": "7"})
    Xml.SubElement(marker, "path", d="M0 0L10 5L0 10z", fill=color)


def _frame(parent: Xml.Element, name: str, frame: tuple[float, float, float, float]) -> None:
    group = Xml.SubElement(parent, "g", {"data-state": name})
    Xml.SubElement(group, "title").text = STATES[name]
    dashes = {"stroke-dasharray": "6 4"} if name in ("active", "recover") else {}
    _rect(group, frame, rx="14", fill="#f3f6f9" if name != "active" else "#fafcfd", stroke=PALE, **dashes)
    _text(group, (frame[0] + 16, frame[1] + 24), name.replace("_", " "), "region")


def _state(parent: Xml.Element, name: str, place: Place) -> None:
    x, y = place
    width, height = BOX
    group = Xml.SubElement(parent, "g", {"data-state": name})
    frame = (x - width / 2, y - height / 2, width, height)
    _rect(group, frame, rx="12", fill=PAPER, stroke=INK, **{"stroke-width": "1.6"})
    lines = _lines(STATES[name])
    top = y - 2 - 6.5 * (len(lines) - 1)
    _text(group, (x, top), name.replace("_", " "), "name")
    for number, line in enumerate(lines, start=1):
        _text(group, (x, top + 3 + 13 * number), line, "words")


def _lines(text: str) -> list[str]:
    """Break a sentence into as few lines as fit into a state, of about the same length."""
    number = len(textwrap.wrap(text, WIDEST))
    return next(lines for width in range(1, WIDEST + 1) if len(lines := textwrap.wrap(text, width)) == number)


def _circle(parent: Xml.Element, name: str, place: Place) -> None:
    """Draw a history state, or the final state."""
    group = Xml.SubElement(parent, "g", {"data-state": name})
    Xml.SubElement(group, "title").text = STATES[name]
    at = {"cx": f"{place[0]:g}", "cy": f"{place[1]:g}"}
    end = name == "done"
    Xml.SubElement(group, "circle", {**at, "r": "9" if end else "13", "fill": PAPER, "stroke": INK})
    if end:
        Xml.SubElement(group, "circle", {**at, "r": "5", "fill": INK})
    else:
        _text(group, (place[0], place[1] + 5), "H*" if name == "resume_here" else "H", "name")


def _beginning(parent: Xml.Element, begin: Place, end: Place) -> None:
    """Draw the dot at which a region begins, and its arrow."""
    Xml.SubElement(parent, "circle", {"cx": f"{begin[0]:g}", "cy": f"{begin[1]:g}", "r": "6", "fill": INK})
    _path(parent, (begin, end), INK)


def _path(parent: Xml.Element, points: Sequence[Place], color: str) -> None:
    """Draw a line with rounded corners and an arrowhead."""
    d = f"M{points[0][0]:g} {points[0][1]:g}"
    for before, corner, after in zip(points, points[1:], points[2:], strict=False):
        near, far = _towards(corner, before), _towards(corner, after)
        d += f"L{near[0]:g} {near[1]:g}Q{corner[0]:g} {corner[1]:g} {far[0]:g} {far[1]:g}"
    d += f"L{points[-1][0]:g} {points[-1][1]:g}"
    style = {"fill": "none", "stroke": color, "stroke-width": "1.8", "marker-end": f"url(#head{color[1:]})"}
    Xml.SubElement(parent, "path", {"d": d, **style})


def _towards(corner: Place, end: Place) -> Place:
    length = max(abs(end[0] - corner[0]), abs(end[1] - corner[1]))
    share = min(0.5, CORNER_RADIUS / length)
    return corner[0] + share * (end[0] - corner[0]), corner[1] + share * (end[1] - corner[1])


def _line(parent: Xml.Element, pair: tuple[str, str], group: Sequence[Transition]) -> None:
    route = ROUTES[pair]
    events = " ".join(arrow.event or arrow.guard for arrow in group)
    element = Xml.SubElement(parent, "g", {"data-from": pair[0], "data-to": pair[1], "data-on": events})
    Xml.SubElement(element, "title").text = " ".join(
        EVENTS[Event(arrow.event)] if arrow.event else arrow.guard for arrow in group
    )
    _path(element, route.points, route.color)


def _label(parent: Xml.Element, pair: tuple[str, str], group: Sequence[Transition]) -> None:
    route = ROUTES[pair]
    x, y = route.label
    for number, line in enumerate(_label_lines(group)):
        _text(parent, (x, y + LINE_PX * number), line, "label", style=f"fill:{route.color}")


def _label_lines(group: Iterable[Transition]) -> Iterator[str]:
    """Yield events and guards, and the action once."""
    action = ""
    for arrow in group:
        if arrow.label:
            yield arrow.label.replace(" and ", " & ")
        action = arrow.action
    if action:
        yield f"/ {action}"
