"""Draw ``map.png``: where the robot was by its own odometry, what it saw, what it decided, and what each number means.

Everything but the true room of a simulated world, in grey, is as the robot measured it, in the frame of its start.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

from PIL import Image

from behaviors.journal import Record, end_of, start_of
from behaviors.mission import Mission
from behaviors.mission.robot import CameraTable
from nxtdrive.drawing.blocks import Note, Tag
from nxtdrive.drawing.floor_view import Area, Axes
from nxtdrive.drawing.page import Page, draw_page
from nxtdrive.drawing.sheet import DIM, Color
from nxtdrive.recording.map.events import MapEvent, Numbering, numbering
from nxtdrive.recording.map.painter import MapPainter, on_page
from nxtdrive.recording.map.scene import START, Line, MapScene, gather, target_place
from nxtdrive.recording.map.style import mark_style, target_color
from nxtdrive.recording.wording import spaced, target_outcome_words

AXES = Axes("to the right of the start, m", "ahead of the start, m", up=True)
MARGIN_MM, SMALLEST_MM = 250.0, 1600.0
"""Around everything that is shown; and the map's least width and height."""
ROOM_MM = 1500.0
"""Parts of the true room nearer than this to something the robot saw are on the map."""
SHOWN_REST = 6
"""Kinds of events without a number that are listed."""
START_MARK_MM = (0.0, 80.0, 160.0, 240.0)
"""Along the arrow of the start: no number may cover it."""
RULE = "Numbers: what repeats at one place shares one; of the rest the last three and the first of each kind."


def draw_map(
    records: Sequence[Record],
    mission: Mission | None = None,
    room: Sequence[Line] = (),
    room_at_end: Sequence[Line] = (),
) -> Image.Image:
    """Draw the map of a run.

    Args:
        records: The whole journal.
        mission: The mission, for its profile and its camera's angle of view.
        room: The true room at the start of a simulated run, in the frame of the start.
        room_at_end: The same at the end.

    Returns:
        An RGB image.
    """
    return draw_page(map_page(records, mission, room, room_at_end))


def map_page(
    records: Sequence[Record],
    mission: Mission | None = None,
    room: Sequence[Line] = (),
    room_at_end: Sequence[Line] = (),
) -> Page:
    """Compose the map of a run; arguments as in `draw_map`."""
    scene = gather(records, mission)
    shown = numbering(scene.events)
    area = _area(scene, [*room, *room_at_end])
    camera = mission.camera if mission else CameraTable()
    at_start = set(room)
    painter = MapPainter(scene, shown, camera, room, [line for line in room_at_end if line not in at_start])
    begun = start_of(records)
    places = {target: target_place(points) for target, points in scene.sightings.items()}
    return Page(
        title=str(begun.data.get("mission", "")) if begun else "A mission that did not begin",
        subtitle="; ".join(_result(records, mission)),
        area=area,
        axes=AXES,
        paint=painter.paint,
        keys=list(painter.keys(area)),
        heading="What happened" if shown.numbered else "",
        notes=list(number_notes(shown, lambda event: mark_style(event).color)),
        tags=[
            *(
                Tag(on_page(place), target, target_color(i), number=False)
                for i, (target, place) in enumerate(places.items())
            ),
            *(
                Tag(on_page(each.first.pose.point), str(number), mark_style(each.first).color)
                for number, each in enumerate(shown.numbered, start=1)
            ),
        ],
        avoid=[on_page(pose.point) for pose, _ in scene.poses],
        keep=[on_page(point) for point in (*places.values(), *map(START.ahead, START_MARK_MM))],
    )


def _area(scene: MapScene, room: Sequence[Line]) -> Area:
    """Return the floor that the map shows."""
    points = [on_page(point) for point in scene.points()]
    seen = Area.around(points, 0.0, 0.0)
    corners = [on_page(corner) for x0, y0, x1, y1 in room for corner in ((x0, y0), (x1, y1))]
    return Area.around([*points, *(each for each in corners if seen.holds(each, ROOM_MM))], MARGIN_MM, SMALLEST_MM)


def _result(records: Sequence[Record], mission: Mission | None) -> Iterator[str]:
    """Yield the profile, how the mission ended, and the outcome for each target."""
    if mission:
        yield f"profile {mission.mission.profile}"
    end = end_of(records)
    if end is None:
        yield f"the record stops at {records[-1].time_s:.1f} s" if records else "nothing was recorded"
        return
    yield f"{spaced(str(end.data.get('ending', 'ended')))} after {end.time_s:.1f} s"
    times_s = {record.target: record.time_s for record in records if record.data.get("to") == "reached"}
    outcomes = end.data.get("targets")
    for target, outcome in outcomes.items() if isinstance(outcomes, dict) else ():
        when = f" at {times_s[target]:.1f} s" if target in times_s and outcome == "reached" else ""
        yield f"{target}: {target_outcome_words(str(outcome))}{when}"


def number_notes(shown: Numbering, color_of: Callable[[MapEvent], Color]) -> Iterator[Note]:
    """Yield the meaning of the numbers on a map, and the events without one."""
    for number, group in enumerate(shown.numbered, start=1):
        head, *more = map(_arrowed, group.first.words)
        yield Note(str(number), f"{group.when} · {head}", tuple(more), color_of(group.first))
    if shown.rest:
        lines = [f"{count} × {_arrowed(words)}" for words, count in shown.rest[:SHOWN_REST]]
        others = sum(count for _, count in shown.rest[SHOWN_REST:])
        lines += [f"{others} others"] if others else []
        total = sum(count for _, count in shown.rest)
        yield Note("", f"and {total} more, without numbers:", (*lines, RULE), DIM)


def _arrowed(words: str) -> str:
    return words.replace("->", "→")
