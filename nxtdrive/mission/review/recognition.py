"""Hints at targets that the camera did not recognise, and at other things that it took for one."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from behaviors.events import Event, Reason
from behaviors.mission.targets import ColorTarget, PictureTarget
from nxtdrive.mission.files import own_room
from nxtdrive.mission.review.reviewed_run import Hints, ReviewedRun, Transition
from nxtdrive.mission.truth import FAR_MM, Truth, codes_on
from nxtdrive.transports.address import Address

ROUND = (Reason.FULL_TURN_WITHOUT_SIGHTING, Reason.NEVER_SEEN)
"""A search that ends for one of these reasons has looked in all directions, if the target was never seen before."""
NEAR_MM = 1000.0
"""An object that is nearer may be what the robot arrived at, even if the camera does not show all of it."""


def something_else(run: ReviewedRun, transition: Transition) -> Hints:
    """Check after an arrival whether something that passes for the target is near or in view."""
    truth, target = run.truth, transition.target
    if truth is None or transition.sighting.get("distance_mm") is None:
        return
    names = run.lookalikes(target)
    if not any(truth.in_front_of_camera(name) or truth.lens_distance_mm(name) < NEAR_MM for name in names):
        color = isinstance(run.mission.target[target], ColorTarget)
        remedy = "Choose another colour, or learn this one: `nxtdrive calibrate colors`" if color else "Take that away"
        text = (
            f"{target}: the robot stopped in front of something else, which the camera took for it; in this world "
            f"{target} is not there. {remedy}; the run's video shows what it was."
        )
        yield target, text


def never_seen(run: ReviewedRun, transition: Transition) -> Hints:
    """Say why, or what to try, if a search has looked in all directions without ever having seen its target."""
    target = transition.target
    if transition.event != Event.SEARCH_FAILED or transition.reason not in ROUND or target in run.seen:
        return
    if run.truth is None:
        yield target, _not_recognised(run, target)
    elif not (names := run.lookalikes(target)):
        yield target, _not_in_this_world(run, run.truth, target)
    elif (whole_from_mm := min(map(run.truth.whole_from_mm, names))) > FAR_MM:
        least = f"only from {whole_from_mm / 1000:.1f} m away" if math.isfinite(whole_from_mm) else "from nowhere"
        text = (
            f"{target} hangs too high or stands too low: the camera sees the whole of it {least}. In this world, "
            "bring its centre_height_mm nearer to the camera's height_mm, or set the camera's tilt_deg."
        )
        yield target, text


def _not_in_this_world(run: ReviewedRun, truth: Truth, target: str) -> str:
    fronts = truth.front_images()
    codes = {name: [] if run.by_name else codes_on(fronts[name], run.detectors[target].detector) for name in fronts}
    names = [f"{name} ({', '.join(said)})" if said else name for name, said in codes.items()]
    has = f"It has {', '.join(names)}" if names else "It has no objects"
    advice = _advice(run, target, named=target in fronts)
    return f"Nothing in sight looks like {target}, and nothing in this world does. {has}. {advice}"


def _advice(run: ReviewedRun, target: str, *, named: bool) -> str:
    """Return what to do about a world without a target; `named` says whether an object of it has the target's name."""
    room = own_room(run.file) if run.file else None
    if room and room.is_file() and Path(run.world).resolve() != room.resolve():
        return f"Open the mission's own with --nxt {shlex.quote(str(Address('sim', str(room))))}."
    if named:
        return f"Its {target} is not what [target.{target}] describes: correct one of the two."
    if room and room.is_file():
        return f"Put {target} into {room}."
    if room:
        new = f"`nxtdrive world new {shlex.quote(str(room))}` makes one to change."
        return f"Open another with --nxt sim://WORLD.toml, or write the room of this mission: {new}"
    return "Open another with --nxt sim://WORLD.toml; `nxtdrive mission new` writes a mission with its world."


def _not_recognised(run: ReviewedRun, target: str) -> str:
    """Suggest what to try in a real room."""
    file = shlex.quote(str(run.file)) if run.file else ""
    mission = f" --mission {file}" if file else ""
    command = f"nxtdrive detect try {shlex.quote(run.camera)}{mission} --target {shlex.quote(target)}"
    # a run does not try the pictures: that takes a second for each
    pictured = file and isinstance(run.mission.target[target], PictureTarget)
    more = f" `nxtdrive mission check {file}` warns of a picture that is hard to find." if pictured else ""
    return (
        f"Nothing in sight looked like {target}. Give it more light, stand it nearer, upright and at the camera's "
        f"height, and check its height_mm; `{command}` shows what the camera finds.{more}"
    )


def not_reached(run: ReviewedRun) -> Hints:
    """Check at the end whether a room of the user's own has a target that was not reached."""
    if not Path(run.world).is_file():
        return
    check = f"`nxtdrive world check {shlex.quote(run.world)}` warns if the robot cannot see or reach it."
    for target in dict.fromkeys(run.mission.mission.targets):
        if target not in run.reached and run.lookalikes(target):
            seen = target in run.seen
            what = "was seen, but not reached" if seen else "was never seen, although this world has it"
            need = "more time" if seen else "more light, a nearer start, or more time"
            more = f"If it finds nothing, give the mission {need} (time_limit_s, rounds)."
            yield target, f"{target} {what}. {check} {more}"
