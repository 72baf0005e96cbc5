"""Review of a run for people, besides its journal: hints at what to fix, and in the simulator the truth."""

from __future__ import annotations

import math
import shlex
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from behaviors.adaptive.arrival import TUNING as ARRIVAL
from behaviors.events import Event, Reason
from behaviors.journal import Record, RecordKind
from behaviors.mission.robot import brick_id
from behaviors.mission.targets import ColorTarget, MarkerTarget, PictureTarget, QrTarget
from behaviors.plausibility import TOLERANCE_MM, contradicts
from behaviors.profile_names import THESIS
from firmware_protocol.errors import NXTError
from nxtdrive.mission.detectors import build_detectors
from nxtdrive.mission.files import own_room
from nxtdrive.mission.truth import FAR_MM, Truth, codes_on, recognised
from nxtdrive.transports.address import Address

if TYPE_CHECKING:
    from behaviors.mission import Mission
    from nxtdrive.brick import Brick
    from nxtdrive.vision.detection import Image, TargetDetector

ROUND = (Reason.FULL_TURN_WITHOUT_SIGHTING, Reason.NEVER_SEEN)
"""A search that ends for one of these reasons has looked in all directions, if the target was never seen before."""
GIVEN_UP = ("given_up", "time_up")
"""Endings of a mission that had time to reach its targets."""
WIRING_KEYS = {"left", "right", "left_reversed", "right_reversed"}
STOPPED = (Reason.BLOCKED_SHORT, Reason.BLOCKED_LONG)
STOPS_BEFORE_WARNING = 2
"""A target in front of which the robot was stopped this many times may be nearer than its size says."""

NEAR_MM = 1000.0
"""An object that is nearer may be what the robot arrived at, even if the camera does not show all of it."""

FLAT_TARGETS = (PictureTarget, MarkerTarget, QrTarget)

SCALE_TOLERANCE = 0.25
"""A hint says so if driving or the truth shows that distances by size are wrong by more: a field of view from a data
sheet and a height by ruler together may be wrong by less."""

BUILD_TOLERANCE = 0.1
"""A robot whose wheels or track differ by more from what its mission says turns and drives too wrongly to arrive."""


class RunReview:
    """Observes a run; receives its records.

    Args:
        mission: What the robot does.
        truth: Of a simulated world, or None.
        say: Called with each hint, as soon as there is one.
        file: The mission's file, for the command in a hint; None for the built-in one.
        by_name: Whether a target is the simulated world's object of its name, whatever that looks like.
        camera: The camera's source, for the command in a hint.
        world: The file or the name of the simulated world; empty for the default one.

    Attributes:
        hints: What to check or change, one sentence or two each.
        arrivals: For each target that was reached: ``target``, ``time_s``, ``believed_mm`` by its size or None,
            ``sonar_mm`` or None; in the simulator also ``true_mm`` and ``there``, whether it really stands in front of
            the target.
    """

    def __init__(
        self,
        mission: Mission,
        truth: Truth | None,
        say: Callable[[str], None],
        file: Path | None = None,
        *,
        by_name: bool = False,
        camera: str = "0",
        world: str = "",
    ) -> None:
        self.hints: list[str] = []
        self.arrivals: list[dict[str, object]] = []
        self._mission, self._truth, self._say, self._file = mission, truth, say, file
        self._by_name, self._camera, self._world = by_name, shlex.quote(camera), Path(world)
        self._seen: set[str] = set()
        self._reached: set[str] = set()
        self._reported: set[str] = set()
        self._stopped: Counter[str] = Counter()
        self._look: Mapping[str, Any] = {}
        self._nearer: dict[str, tuple[float, float]] = {}
        self._alike: dict[str, list[str]] = {}

    def compare_brick(self, brick: Brick) -> None:
        """Give a hint if the mission or its robot file describes another robot."""
        if self._truth is not None:
            self._compare_build(self._truth.build())
        described = self._mission.calibration
        if not described.brick_id:  # the brick need not be asked
            return
        with suppress(NXTError):  # a lost link is the mission's concern, not a hint's
            address = brick.info().bluetooth_address
            if described.describes_another(address):
                self._add_hint(
                    f"The robot file describes the brick {described.brick_id}, and this one is {brick_id(address)}. "
                    "Name this robot's file with --robot, or make one: nxtdrive calibrate --robot FILE."
                )

    def _compare_build(self, build: Mapping[str, Sequence[str | float]]) -> None:
        robot = self._mission.robot
        wrong = {key: fits[0] for key, fits in build.items() if fits and not _describes(getattr(robot, key), fits)}
        if wrong:
            texts = {key: f'"{fits}"' if isinstance(fits, str) else f"{fits:g}" for key, fits in wrong.items()}
            keys = ", ".join(f"{key} = {text}" for key, text in texts.items())
            self._add_hint(
                f"The robot of this world is not built as the mission says. Write {keys} into [robot] of the mission "
                "or of its robot file, or change [robot] of the world."
            )

    def __call__(self, record: Record) -> None:
        """Learn from a record."""
        if record.kind is RecordKind.LOOK:
            self._look = record.data
            if record.data["sighting"] is not None:
                self._seen.add(record.target)
        elif record.kind is RecordKind.TRANSITION:
            self._transition(record)
        elif record.kind is RecordKind.END:
            self._end()
            if record.data["ending"] in GIVEN_UP:
                self._doubt_room()
                if self._seen and not self._reached:
                    self._doubt_motors()

    def _transition(self, record: Record) -> None:
        target, data = record.target, cast("Mapping[str, Any]", record.data)
        if data["to"] == "reached":
            sighting = data["evidence"].get("sighting", {})  # another package's skill need not report one
            arrival = self._arrive(record.time_s, target, sighting.get("distance_mm"))
            if not data["evidence"].get("passes_over") and (sizes := self._contradiction(target)):
                self._wrong_size(target, *sizes)
            left_over = 1.0 if sighting.get("bound") else self._true_share(arrival)
            self._scaled(target, left_over * data["evidence"].get("scale", 1.0))
        elif data["event"] == Event.SEARCH_FAILED and data["reason"] in ROUND:
            if target not in self._seen and self._truth is not None:
                self._missing(target, self._truth)
            elif target not in self._seen:
                self._unseen(target)
        elif data.get("reason") == Reason.RANGE_MISMATCH:
            range_mm, distance_mm = (data["evidence"].get(name) for name in ("range_mm", "distance_mm"))
            if range_mm is not None and distance_mm is not None and not self._is_true(target, distance_mm):
                self._wrong_size(target, range_mm, distance_mm)
        elif data.get("reason") == Reason.APPROACH_TIMEOUT:
            self._slow(target)
        elif data.get("reason") in STOPPED and (sizes := self._contradiction(target)) and sizes[0] < sizes[1]:
            self._stopped[target] += 1
            self._nearer[target] = sizes

    def _arrive(self, time_s: float, target: str, believed_mm: float | None) -> dict[str, Any]:
        self._reached.add(target)
        arrival: dict[str, Any] = {"target": target, "time_s": time_s, "believed_mm": believed_mm}
        arrival["sonar_mm"] = self._look.get("range_mm")
        if self._truth is not None:
            arrival |= self._compared_with_truth(target, believed_mm, self._truth)
            if believed_mm is not None:
                self._compare_place(target, self._truth)
        self.arrivals.append(arrival)
        return arrival

    def _compare_place(self, target: str, truth: Truth) -> None:
        """Add a hint if nothing that passes for the target is near or in view."""
        names = self._lookalikes(target, truth)
        if any(truth.in_front_of_camera(name) or truth.lens_distance_mm(name) < NEAR_MM for name in names):
            return
        color = isinstance(self._mission.target[target], ColorTarget)
        remedy = "Choose another colour, or learn this one: `nxtdrive calibrate colors`" if color else "Take that away"
        self._hint(
            target,
            f"{target}: the robot stopped in front of something else, which the camera took for it; in this world "
            f"{target} is not there. {remedy}; the run's video shows what it was.",
        )

    def _contradiction(self, target: str) -> tuple[float, float] | None:
        """Return echo and distance by size of the last look, if they contradict each other.

        In the simulator the echo may be known to come from something else, such as what is in the way.
        """
        sighting, range_mm = self._look.get("sighting"), self._look.get("range_mm")
        if (
            sighting is None
            or sighting.get("bound")
            or range_mm is None
            or abs(sighting["bearing_deg"]) > ARRIVAL.ahead_deg
        ):
            return None
        distance_mm = sighting["distance_mm"]
        thesis = self._mission.mission.profile == THESIS
        tolerance_mm = TOLERANCE_MM if thesis else self._mission.adaptive.sonar_tolerance_mm
        wrong = contradicts(range_mm, distance_mm, tolerance_mm) and not self._is_true(target, distance_mm)
        return (range_mm, distance_mm) if wrong else None

    def _is_true(self, target: str, distance_mm: float) -> bool:
        """Return whether a distance by size is known to be right."""
        truth = self._truth
        return truth is not None and any(
            truth.in_front_of_camera(name) and not contradicts(truth.lens_distance_mm(name), distance_mm)
            for name in self._lookalikes(target, truth)
        )

    def _compared_with_truth(self, target: str, believed_mm: float | None, truth: Truth) -> dict[str, object]:
        """Compare an arrival with the truth: with the object in view that is the target, else the nearest such."""
        names = self._lookalikes(target, truth)
        objects = sorted((not truth.in_front_of_camera(name), truth.lens_distance_mm(name)) for name in names)
        if not objects:
            return {"true_mm": None, "there": False}
        hidden, true_mm = objects[0]
        return {
            "true_mm": round(true_mm, 1),
            "there": not hidden and (believed_mm is None or not contradicts(true_mm, believed_mm)),
        }

    def _missing(self, target: str, truth: Truth) -> None:
        """Add a hint if the search looked in all directions and this world has no such object, or only a high one."""
        if names := self._lookalikes(target, truth):
            self._high(target, min(map(truth.whole_from_mm, names)))
            return
        fronts = {name: self._described(name, front, target) for name, front in truth.front_images().items()}
        has = f"It has {', '.join(fronts.values())}" if fronts else "It has no objects"
        room = own_room(self._file) if self._file else None
        if room and room.is_file() and self._world.resolve() != room.resolve():
            advice = f"Open the mission's own with --nxt {shlex.quote(str(Address('sim', str(room))))}."
        elif target in fronts:
            advice = f"Its {target} is not what [target.{target}] describes: correct one of the two."
        elif room and room.is_file():
            advice = f"Put {target} into {room}."
        elif room:
            advice = (
                "Open another with --nxt sim://WORLD.toml, or write the room of this mission: "
                f"`nxtdrive world new {shlex.quote(str(room))}` makes one to change."
            )
        else:
            advice = "Open another with --nxt sim://WORLD.toml; `nxtdrive mission new` writes a mission with its world."
        self._hint(target, f"Nothing in sight looks like {target}, and nothing in this world does. {has}. {advice}")

    def _high(self, target: str, whole_from_mm: float) -> None:
        if whole_from_mm > FAR_MM:
            least = f"only from {whole_from_mm / 1000:.1f} m away" if math.isfinite(whole_from_mm) else "from nowhere"
            self._hint(
                target,
                f"{target} hangs too high or stands too low: the camera sees the whole of it {least}. In this world, "
                "bring its centre_height_mm nearer to the camera's height_mm, or set the camera's tilt_deg.",
            )

    def _described(self, name: str, front: Image, target: str) -> str:
        """Return an object's name, and which codes are on it if the target is one."""
        said = [] if self._by_name else codes_on(front, self._detectors[target].detector)
        return f"{name} ({', '.join(said)})" if said else name

    def _unseen(self, target: str) -> None:
        file = shlex.quote(str(self._file)) if self._file else ""
        mission = f" --mission {file}" if file else ""
        command = f"nxtdrive detect try {self._camera}{mission} --target {shlex.quote(target)}"
        # a run does not try the pictures: that takes a second for each
        pictured = file and isinstance(self._mission.target[target], PictureTarget)
        more = f" `nxtdrive mission check {file}` warns of a picture that is hard to find." if pictured else ""
        self._hint(
            target,
            f"Nothing in sight looked like {target}. Give it more light, stand it nearer, upright and at the camera's "
            f"height, and check its height_mm; `{command}` shows what the camera finds.{more}",
        )

    def _wrong_size(self, target: str, range_mm: float, distance_mm: float) -> None:
        height_mm = self._mission.target[target].height_mm
        fits_mm = float(f"{height_mm * (range_mm + self._mission.sonar_ahead_mm) / distance_mm:.2g}")
        self._hint(
            target,
            f"{target}: the sonar says {range_mm / 1000:.1f} m, its size in the picture says "
            f"{distance_mm / 1000:.1f} m. Is height_mm = {height_mm:g} right? "
            f"If the echo came from {target}, it is about {fits_mm:g} mm high.",
        )

    def _slow(self, target: str) -> None:
        """Ask for the ports: a robot one wheel of which stands still goes round in circles in front of its target."""
        left, right = self._mission.robot.left, self._mission.robot.right
        self._hint(
            target,
            f"{target}: the robot drove to it for a long time and did not arrive. If it went round in circles, is the "
            f"left wheel's motor on port {left} and the right one's on port {right}? `nxtdrive motor turn {left} 360 "
            "--nxt ADDRESS` turns the left wheel forwards if it is; other ports are left and right in [robot].",
        )

    def _true_share(self, arrival: Mapping[str, Any]) -> float:
        """Return the true distance over the estimated one; 1 without the truth, and in front of what is not flat.

        A camera sees the top of a box as well, so the box looks higher than it is.
        """
        flat = isinstance(self._mission.target[arrival["target"]], FLAT_TARGETS)
        if not flat or not arrival.get("there") or not arrival["believed_mm"]:
            return 1.0
        return float(arrival["true_mm"] / arrival["believed_mm"])

    def _scaled(self, target: str, factor: float) -> None:
        """Warn if driving or the ground truth shows that distances by size are wrong by more than data sheets allow."""
        if abs(math.log(factor)) > math.log(1.0 + SCALE_TOLERANCE):
            height_mm = self._mission.target[target].height_mm
            self._hint(
                target,
                f"{target}: its size in the picture gave {1 / factor:.2g} times the true distance. Is "
                f"height_mm = {height_mm:g} right? It may be about {float(f'{height_mm * factor:.2g}'):g} mm high; or "
                f"hfov_deg = {self._mission.camera.hfov_deg:g} is wrong, which `nxtdrive calibrate camera` measures.",
            )

    def _end(self) -> None:
        for target, times in self._stopped.items():
            if target not in self._reached and times >= STOPS_BEFORE_WARNING:
                self._wrong_size(target, *self._nearer[target])

    def _doubt_room(self) -> None:
        """Hint at the check of a room of the user's own that has a target which was never seen."""
        if self._truth is None or not self._world.is_file():
            return
        check = f"nxtdrive world check {shlex.quote(str(self._world))}"
        for target in dict.fromkeys(self._mission.mission.targets):
            if target not in self._seen and self._lookalikes(target, self._truth):
                self._hint(
                    target,
                    f"{target} was never seen, although this world has it. `{check}` warns if the robot cannot see or "
                    "reach it.",
                )

    def _doubt_motors(self) -> None:
        """Hint at exchanged or reversed motors, unless they were measured or are a simulated robot's usual ones."""
        described = self._mission.robot.model_fields_set & WIRING_KEYS
        if self._mission.calibration.motors is None and (self._truth is None or described):
            self._add_hint(
                "The robot saw a target and reached none. If it turned or drove the wrong way, its motors are "
                "exchanged or reversed, and [robot] does not say so: `nxtdrive calibrate motors` finds out."
            )

    def _lookalikes(self, target: str, truth: Truth) -> list[str]:
        """Return the names of the objects of the world that pass for a target."""
        if target not in self._alike:
            known = [target] if self._by_name else recognised(self._detectors[target].detector, truth)
            self._alike[target] = known
        return self._alike[target]

    @cached_property
    def _detectors(self) -> dict[str, TargetDetector]:
        return build_detectors(self._mission)

    def _hint(self, target: str, text: str) -> None:
        """Add a hint about a target that has none yet."""
        if target not in self._reported:
            self._reported.add(target)
            self._add_hint(text)

    def _add_hint(self, text: str) -> None:
        self.hints.append(text)
        self._say(text)


def _describes(value: str | float, fits: Sequence[str | float]) -> bool:
    """Return whether a key of [robot] describes the robot: a length roughly, a port exactly unless it is 0 for none."""
    if isinstance(value, float):
        return any(isinstance(each, int | float) and abs(value / each - 1) <= BUILD_TOLERANCE for each in fits)
    return value in (0, *fits)
