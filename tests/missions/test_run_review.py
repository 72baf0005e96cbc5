"""Output of a run besides its journal: hints, and the true distance beside the estimate."""

from __future__ import annotations

import math
from pathlib import Path

import cv2
import pytest

from behaviors.events import Event, Reason
from behaviors.journal import Record, RecordKind
from behaviors.mission import Mission, described_by, load_mission
from behaviors.mission.robot import CalibrationTable, MeasuredTable, RobotTable, load_robot_file
from nxtdrive.brick import open_brick
from nxtdrive.mission.review.reviewed_run import ReviewedRun
from nxtdrive.mission.review.run_review import RunReview
from nxtdrive.mission.truth import truth_of
from nxtdrive.vision.camera import Frame
from sim_backend.bundled import PICTURES, WORLDS
from sim_backend.simulation import Simulation
from sim_backend.world.event_tables import Event as DisturbingEvent

WITH_SHEET = """
floor = { size_mm = [3000, 3000] }
robot = { start_mm = [500, 500] }
boxes = [{ name = "crate", at_mm = [500, 2500], size_mm = [300, 300], height_mm = 300 }]
pictures = [{ name = "sheet", file = "sheet.png", at_mm = [2500, 2500], facing_deg = 225, size_mm = [200, 200] }]
"""
QR_MISSION = """
mission = { name = "bin", targets = ["bin"] }
target.bin = { detector = "qr", text = "Muelleimer", height_mm = 150 }
"""

FACE_MISSION = """
mission = { name = "granny", targets = ["granny"] }
target.granny = { detector = "haar", cascade = "haarcascade_frontalface_alt2", height_mm = 200 }
"""


def _reviewed(perform, world: str, mission: Mission, *, geometric: bool = True, file: Path | None = None) -> RunReview:
    """The review of a mission in a bundled world."""
    made: list[RunReview] = []

    def arrange(simulation: Simulation) -> None:
        made.append(RunReview(ReviewedRun(mission, simulation.truth, file), lambda _: None))

    def observe(record: Record) -> None:
        made[0](record)

    perform(world, mission, geometric=geometric, arrange=arrange, observer=observe)
    return made[0]


def _with(mission: Mission, height_mm: float, profile: str, limit_s: float = 20.0) -> Mission:
    table = mission.mission.model_copy(update={"profile": profile, "time_limit_s": limit_s})
    target = {name: each.model_copy(update={"height_mm": height_mm}) for name, each in mission.target.items()}
    return mission.model_copy(update={"mission": table, "target": target})


def _unsuccessful(target: str) -> Record:
    data = {"source": "search", "to": "select", "event": Event.SEARCH_FAILED, "reason": Reason.NEVER_SEEN}
    return Record(10.0, RecordKind.TRANSITION, "select", target, {**data, "evidence": {}})


def test_a_target_that_the_simulated_world_does_not_have_is_named_with_what_it_has(perform, mission_for):
    review = _reviewed(perform, "open", _with(mission_for("rilakkuma"), 297.0, "thesis"))
    [hint] = review.hints
    assert "nothing in this world does. It has lena." in hint
    assert "nxtdrive mission new" in hint


def test_the_room_beside_the_mission_is_recommended(perform, mission_for, tmp_path):
    (tmp_path / "bear-world.toml").touch()
    review = _reviewed(perform, "open", _with(mission_for("rilakkuma"), 297.0, "thesis"), file=tmp_path / "bear.toml")
    assert f"--nxt sim://{tmp_path}/bear-world.toml" in review.hints[0]


def test_a_mission_file_without_a_room_is_to_get_one(mission_for):
    review = RunReview(
        ReviewedRun(mission_for("rilakkuma"), Simulation("open").truth, Path("my bear.toml")), lambda _: None
    )
    review(_unsuccessful("rilakkuma"))
    [hint] = review.hints
    assert "`nxtdrive world new 'my bear-world.toml'`" in hint


def test_a_target_that_the_missions_own_room_does_not_have_is_to_be_added(mission_for, here):
    Path("bear-world.toml").touch()
    truth = Simulation("open").truth
    for world in ("bear-world.toml", str(here / "bear-world.toml")):
        review = RunReview(ReviewedRun(mission_for("rilakkuma"), truth, Path("bear.toml"), world=world), lambda _: None)
        review(_unsuccessful("rilakkuma"))
        [hint] = review.hints
        assert hint.endswith("It has lena. Put rilakkuma into bear-world.toml.")


def test_the_codes_of_the_simulated_world_are_reported_where_one_was_looked_for(tmp_path):
    cv2.imwrite(str(tmp_path / "sheet.png"), cv2.resize(cv2.QRCodeEncoder.create().encode("Mülleimer"), (300, 300)))
    room = tmp_path / "room.toml"
    room.write_text(WITH_SHEET, encoding="utf-8")
    (tmp_path / "bin.toml").write_text(QR_MISSION, encoding="utf-8")
    review = RunReview(ReviewedRun(load_mission(tmp_path / "bin.toml"), Simulation(room).truth), lambda _: None)
    review(_unsuccessful("bin"))
    [hint] = review.hints
    assert "nothing in this world does. It has sheet (QR code 'Mülleimer'), crate. " in hint


def test_a_face_that_is_a_small_part_of_a_portrait_belongs_to_the_world(tmp_path):
    face = cv2.resize(cv2.imread(str(PICTURES / "lena.png")), (200, 280))
    portrait = cv2.copyMakeBorder(face, 60, 100, 120, 120, cv2.BORDER_CONSTANT, value=(150, 150, 150))
    cv2.imwrite(str(tmp_path / "sheet.png"), portrait)
    room = tmp_path / "room.toml"
    room.write_text(WITH_SHEET, encoding="utf-8")
    (tmp_path / "granny.toml").write_text(FACE_MISSION, encoding="utf-8")
    review = RunReview(ReviewedRun(load_mission(tmp_path / "granny.toml"), Simulation(room).truth), lambda _: None)
    review(_unsuccessful("granny"))
    assert review.hints == []


@pytest.mark.parametrize(
    ("centre_mm", "tilt_deg", "said"), [(450, 0, None), (1400, 0, "only from 3.1 m away"), (1400, -25, "from nowhere")]
)
def test_a_picture_that_hangs_too_high_for_the_camera_is_reported(centre_mm, tilt_deg, said, mission_for, tmp_path):
    room = tmp_path / "room.toml"
    picture = f'{{ name = "lena", at_mm = [2500, 2500], facing_deg = 225, centre_height_mm = {centre_mm} }}'
    camera = f"camera = {{ tilt_deg = {tilt_deg} }}\n"
    text = f"floor = {{ size_mm = [3000, 3000] }}\nrobot = {{ start_mm = [500, 500] }}\npictures = [{picture}]\n"
    room.write_text(camera + text, encoding="utf-8")
    review = RunReview(ReviewedRun(mission_for("lena"), Simulation(room).truth), lambda _: None)
    review(_unsuccessful("lena"))
    assert len(review.hints) == (said is not None)
    assert all(said in hint and "too high" in hint for hint in review.hints)


def test_an_object_of_the_targets_name_that_looks_otherwise_is_to_be_corrected(mission_for):
    mission = mission_for("lena")
    disguised = mission.model_copy(update={"target": {"lena": mission_for("rilakkuma").target["rilakkuma"]}})
    review = RunReview(ReviewedRun(disguised, Simulation("open").truth), lambda _: None)
    review(_unsuccessful("lena"))
    [hint] = review.hints
    assert hint.endswith("It has lena. Its lena is not what [target.lena] describes: correct one of the two.")


def test_a_target_that_the_simulated_world_hides_is_no_reason_for_a_hint(perform, mission_for):
    assert _reviewed(perform, "arena", _with(mission_for("lena"), 297.0, "thesis")).hints == []


@pytest.mark.parametrize("reached", [False, True])
def test_a_target_that_was_seen_and_not_reached_in_a_room_of_ones_own_leads_to_the_check_of_that_room(
    reached, mission_for, here
):
    Path("room.toml").write_text((WORLDS / "open.toml").read_text(encoding="utf-8"), encoding="utf-8")
    review = RunReview(ReviewedRun(mission_for("lena"), Simulation("open").truth, world="room.toml"), lambda _: None)
    sighting = {"bearing_deg": 0.0, "distance_mm": 1000.0, "confidence": 1.0}
    review(Record(1.0, RecordKind.LOOK, "search", "lena", {"sighting": sighting, "range_mm": None}))
    if reached:
        review(Record(5.0, RecordKind.TRANSITION, "reached", "lena", {"source": "arrive", "to": "reached"}))
    review(Record(600.0, RecordKind.END, "finished", "", {"ending": "time_up"}))
    assert len(review.hints) == (not reached)
    for hint in review.hints:
        assert hint.startswith("lena was seen, but not reached. `nxtdrive world check room.toml`")
        assert "time_limit_s" in hint


@pytest.mark.parametrize(("ending", "hints"), [("time_up", 1), ("given_up", 1), ("interrupted", 0), ("achieved", 0)])
def test_a_target_that_was_never_found_in_a_room_of_ones_own_leads_to_the_check_of_that_room(
    ending, hints, mission_for, here
):
    Path("room.toml").write_text((WORLDS / "open.toml").read_text(encoding="utf-8"), encoding="utf-8")
    for world, expected in (("room.toml", hints), ("open", 0)):
        review = RunReview(ReviewedRun(mission_for("lena"), Simulation("open").truth, world=world), lambda _: None)
        review(_unsuccessful("lena"))
        review(Record(600.0, RecordKind.END, "finished", "", {"ending": ending}))
        assert len(review.hints) == expected
        assert all("`nxtdrive world check room.toml`" in hint for hint in review.hints)
        assert all("time_limit_s" in hint for hint in review.hints), "that check may find nothing"


@pytest.mark.parametrize(("by_name", "hints"), [(False, 1), (True, 0)])
def test_vision_by_name_takes_the_object_of_that_name_for_the_target(by_name, hints, mission_for):
    said: list[str] = []
    mission = mission_for("lena")
    disguised = mission.model_copy(update={"target": {"lena": mission_for("rilakkuma").target["rilakkuma"]}})
    RunReview(ReviewedRun(disguised, Simulation("open").truth, by_name=by_name), said.append)(_unsuccessful("lena"))
    assert len(said) == hints


def test_what_has_been_carried_off_belongs_to_the_world(mission_for):
    simulation = Simulation("open")
    simulation.world.place("lena", None, None, present=False)
    review = RunReview(ReviewedRun(mission_for("lena"), simulation.truth), lambda _: None)
    review(_unsuccessful("lena"))
    assert review.hints == []


def test_a_real_room_in_which_nothing_looks_like_the_target_leads_to_what_to_try(mission_for):
    said: list[str] = []
    review = RunReview(
        ReviewedRun(mission_for("lena"), None, Path("my mission.toml"), camera="http://pi:8081/a b"), said.append
    )
    review(_unsuccessful("lena"))
    review(_unsuccessful("lena"))
    [hint] = said
    assert hint == review.hints[0]
    assert "nxtdrive detect try 'http://pi:8081/a b' --mission 'my mission.toml' --target lena" in hint
    assert "`nxtdrive mission check 'my mission.toml'` warns of a picture that is hard to find" in hint


def test_a_target_that_was_seen_before_is_not_called_invisible(mission_for):
    review = RunReview(ReviewedRun(mission_for("lena"), None), lambda _: None)
    sighting = {"bearing_deg": 0.0, "distance_mm": 900.0, "confidence": 0.9, "box": [0, 0, 9, 9]}
    review(Record(1.0, RecordKind.LOOK, "search", "lena", {"pose": [0, 0, 0], "range_mm": 860.0, "sighting": sighting}))
    review(_unsuccessful("lena"))
    assert review.hints == []


@pytest.mark.slow
@pytest.mark.parametrize("profile", [pytest.param("adaptive", marks=pytest.mark.nightly), "thesis"])
def test_a_wrong_height_is_named_with_both_distances_and_the_height_that_fits(perform, mission_for, profile):
    [hint] = _reviewed(perform, "open", _with(mission_for("lena"), 20.0, profile), geometric=False).hints
    assert "the sonar says 1.9 m, its size in the picture says 0.1 m" in hint
    assert "height_mm = 20" in hint
    assert "about 300 mm high" in hint


@pytest.mark.slow
@pytest.mark.parametrize(("height_mm", "profile", "there"), [(297.0, "adaptive", True), (20.0, "thesis", False)])
def test_the_truth_stands_beside_the_belief(perform, mission_for, height_mm, profile, there):
    [arrival] = _reviewed(perform, "open", _with(mission_for("lena"), height_mm, profile), geometric=False).run.arrivals
    assert arrival["target"] == "lena"
    assert arrival["there"] is there
    assert (arrival["true_mm"] == pytest.approx(arrival["believed_mm"], rel=0.1)) is there
    assert arrival["sonar_mm"] == pytest.approx(arrival["true_mm"], abs=80)


@pytest.mark.parametrize(("share", "simulated", "hints"), [(1.0, True, 0), (0.5, True, 1), (1.0, False, 1)])
def test_in_the_simulator_an_obstacle_before_the_target_does_not_cast_doubt_on_its_height(
    share, simulated, hints, mission_for
):
    truth = Simulation("open").truth  # the robot looks at lena
    review = RunReview(ReviewedRun(mission_for("lena"), truth if simulated else None), lambda _: None)
    box = {"bearing_deg": 0.0, "distance_mm": share * truth.lens_distance_mm("lena"), "confidence": 0.9, "box": [0] * 4}
    data = {"source": "arrive", "to": "select", "event": Event.ARRIVE_FAILED, "reason": Reason.BLOCKED_LONG}
    look = {"pose": [0, 0, 0], "range_mm": 300.0, "sighting": box}
    for time_s in (1.0, 2.0):
        review(Record(time_s, RecordKind.LOOK, "arrive", "lena", look))
        review(Record(time_s, RecordKind.TRANSITION, "select", "lena", {**data, "evidence": {}}))
    review(Record(3.0, RecordKind.END, "finished", "lena", {"ending": "interrupted", "targets": {}, "error": ""}))
    assert sum("Is height_mm" in hint for hint in review.hints) == hints


@pytest.mark.parametrize(("away_mm", "hints"), [(400, 0), (2500, 1)])
def test_in_the_simulator_an_arrival_at_something_else_is_reported(away_mm, hints, mission_for):
    simulation = Simulation("open")
    at, facing_deg = simulation.truth.pictures["lena"][:2], simulation.truth.pictures["lena"].heading_deg
    ahead = (math.cos(math.radians(facing_deg)), math.sin(math.radians(facing_deg)))
    turned_deg = facing_deg + (180 if away_mm < 1000 else 90)
    simulation.world.place_robot([at[i] + away_mm * ahead[i] for i in (0, 1)], turned_deg)
    review = RunReview(ReviewedRun(mission_for("lena"), simulation.truth), lambda _: None)
    data = {"source": "verify", "to": "reached", "event": Event.ARRIVED, "reason": Reason.WITHIN_REACH}
    review(
        Record(
            10.0, RecordKind.TRANSITION, "reached", "lena", {**data, "evidence": {"sighting": {"distance_mm": 400.0}}}
        )
    )
    assert sum("something else" in hint for hint in review.hints) == hints


def test_an_arrival_and_a_failure_without_measurements_are_no_defect(mission_for):
    """As a skill of another package may report them."""
    review = RunReview(ReviewedRun(mission_for("lena"), Simulation("open").truth), lambda _: None)
    bare = {"source": "arrive", "event": Event.MISTAKEN, "reason": Reason.RANGE_MISMATCH, "evidence": {}}
    review(Record(1.0, RecordKind.TRANSITION, "select", "lena", {**bare, "to": "select"}))
    review(Record(2.0, RecordKind.TRANSITION, "reached", "lena", {**bare, "to": "reached", "event": Event.ARRIVED}))
    [arrival] = review.run.arrivals
    assert (arrival["believed_mm"], arrival["sonar_mm"]) == (None, None)
    assert arrival["true_mm"] > 0
    assert review.hints == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("height_mm", "limit_s", "said"), [(600.0, 120.0, "nxtdrive calibrate camera"), (150.0, 60.0, "about 300 mm high")]
)
def test_double_and_half_the_height_are_reported_when_driving_has_shown_it(
    perform, mission_for, height_mm, limit_s, said
):
    mission = _with(mission_for("lena"), height_mm, "adaptive", limit_s)
    [hint] = _reviewed(perform, "open", mission, geometric=False).hints
    assert f"height_mm = {height_mm:.0f}" in hint
    assert said in hint


@pytest.mark.parametrize(("target", "hints"), [({"detector": "color", "color": "green"}, 0), (None, 1)])
def test_a_box_seen_from_above_may_look_nearer_than_it_is(target, hints, mission_for):
    mission = mission_for("lena")
    described = mission.model_dump() | {"target": {"green": target or mission.model_dump()["target"]["lena"]}}
    described["mission"]["targets"] = ["green"]
    said: list[str] = []
    review = RunReview(
        ReviewedRun(Mission.model_validate(described), Simulation("colors").truth, by_name=True), said.append
    )
    evidence = {"sighting": {"distance_mm": 500.0, "bearing_deg": 0.0}}
    arrived = {"source": "arrive", "to": "reached", "event": Event.ARRIVED, "reason": Reason.WITHIN_REACH}
    review(Record(2.0, RecordKind.TRANSITION, "reached", "green", {**arrived, "evidence": evidence}))
    assert (review.run.arrivals[0]["there"], len(said)) == (True, hints)


@pytest.mark.parametrize(("brick_id", "hints"), [("", 0), ("001653010203", 0), ("0016530A1B2C", 1)])
def test_the_robot_file_of_another_brick_is_reported(brick_id, hints, mission_for, tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(f'[robot]\nradius_mm = 140.0\n[calibration]\nbrick_id = "{brick_id}"\n', encoding="utf-8")
    mission = described_by(mission_for("lena"), load_robot_file(path))
    said: list[str] = []
    review = RunReview(ReviewedRun(mission, None), said.append)
    with open_brick("sim://open") as brick:
        review.compare_brick(brick)
    assert (mission.robot.radius_mm, len(said), len(review.hints)) == (140.0, hints, hints)
    assert all("describes the brick 0016530A1B2C, and this one is 001653010203" in hint for hint in said)


OTHER_BUILD = """
floor = { size_mm = [3000, 3000] }
sensors = [{ kind = "ultrasonic", port = 3 }]
[robot]
start_mm = [500, 500]
left_port = "A"
ultrasonic_port = 2
touch_port = 0
wheel_diameter_mm = 81.6
track_mm = 118
"""


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ({}, ['Write left = "A", ultrasonic = 2, wheel_diameter_mm = 81.6 into [robot]']),
        ({"left": "A", "ultrasonic": 2, "wheel_diameter_mm": 80.0}, []),
        ({"left": "A", "ultrasonic": 3, "wheel_diameter_mm": 80.0}, []),  # the second one
        ({"left": "A", "ultrasonic": 0, "wheel_diameter_mm": 80.0}, []),  # the mission uses none
        (
            {"left": "A", "ultrasonic": 2, "wheel_diameter_mm": 80.0, "axle_track_mm": 150.0},
            ["axle_track_mm = 118 into"],
        ),
    ],
)
def test_a_simulated_robot_that_is_built_otherwise_than_the_mission_says_is_reported_at_the_start(
    robot, said, mission_for, tmp_path
):
    world = tmp_path / "other.toml"
    world.write_text(OTHER_BUILD, encoding="utf-8")
    mission = mission_for("lena").model_copy(update={"robot": RobotTable(**robot)})
    with open_brick(f"sim://{world}") as brick:
        review = RunReview(ReviewedRun(mission, truth_of(brick)), lambda _: None)
        review.compare_brick(brick)
    assert len(review.hints) == len(said)
    assert all(part in hint for part, hint in zip(said, review.hints, strict=True))


@pytest.mark.parametrize(("battery_mv", "hints"), [(8000, 0), (7100, 0), (6940, 1)])
def test_a_weak_battery_is_reported_once(battery_mv, hints, mission_for):
    review = RunReview(ReviewedRun(mission_for("lena"), None), lambda _: None)
    for time_s in (0.0, 30.0):
        review(Record(time_s, RecordKind.CALL, "search", "lena", {"verb": "arrive", "battery_mv": battery_mv}))
    assert len(review.hints) == hints
    assert all("6.9 V" in hint and "Charge it" in hint for hint in review.hints)


def test_after_an_approach_without_an_arrival_the_ports_of_the_motors_are_asked_for(mission_for):
    said: list[str] = []
    review = RunReview(ReviewedRun(mission_for("lena"), None), said.append)
    data = {"source": "arrive", "to": "select", "event": Event.ARRIVE_FAILED, "reason": Reason.APPROACH_TIMEOUT}
    for time_s in (60.0, 120.0):
        review(Record(time_s, RecordKind.TRANSITION, "select", "lena", {**data, "evidence": {}}))
    [hint] = said
    assert "is the left wheel's motor on port B and the right one's on port C?" in hint
    assert "nxtdrive motor turn B 360 --nxt ADDRESS" in hint


def test_after_an_approach_with_a_pressed_bumper_the_bumper_is_asked_for_instead(mission_for):
    review = RunReview(ReviewedRun(mission_for("lena"), None), lambda _: None)
    data = {"source": "arrive", "to": "select", "event": Event.ARRIVE_FAILED, "reason": Reason.APPROACH_TIMEOUT}
    review(Record(60.0, RecordKind.TRANSITION, "select", "lena", {**data, "evidence": {"touching": True}}))
    [hint] = review.hints
    assert "bumper on port 1 sticks" in hint
    assert "nxtdrive sensor watch 1 touch --nxt ADDRESS" in hint


@pytest.mark.parametrize(
    ("robot", "calibrated", "simulated", "asked"),
    [
        ({}, False, False, True),
        ({}, True, False, False),  # its motors were measured
        ({}, False, True, False),  # a simulated robot is wired as usual
        ({"left_reversed": True}, False, True, True),
    ],
)
def test_after_a_mission_that_saw_a_target_and_reached_none_the_motors_are_doubted(
    mission_for, robot, calibrated, simulated, asked
):
    mission = mission_for("lena")
    if calibrated:
        measured = MeasuredTable(date="2026-05-03", method="marker sheet")
        mission = mission.model_copy(update={"calibration": CalibrationTable(motors=measured)})
    mission = mission.model_copy(update={"robot": RobotTable(**robot)})
    review = RunReview(ReviewedRun(mission, Simulation("open").truth if simulated else None), lambda _: None)
    sighting = {"bearing_deg": 3.0, "distance_mm": 900.0, "bound": False}
    review(Record(10.0, RecordKind.LOOK, "search", "lena", {"sighting": sighting, "range_mm": None}))
    review(Record(90.0, RecordKind.END, "finished", "lena", {"ending": "given_up", "targets": {}, "error": ""}))
    assert any("`nxtdrive calibrate motors` finds out" in hint for hint in review.hints) == asked


def test_a_target_called_like_another_subject_of_a_hint_keeps_its_own_hint(mission_for):
    motors = mission_for("lena")
    motors = motors.model_copy(
        update={
            "mission": motors.mission.model_copy(update={"targets": ["motors"]}),
            "target": {"motors": motors.target["lena"]},
        }
    )
    review = RunReview(ReviewedRun(motors, None), lambda _: None)
    review(_unsuccessful("motors"))
    review(Record(20.0, RecordKind.LOOK, "search", "motors", {"sighting": {}}))
    review(Record(30.0, RecordKind.END, "finished", "motors", {"ending": "given_up"}))
    assert [
        any("Nothing in sight looked like motors" in hint for hint in review.hints),
        any("`nxtdrive calibrate motors` finds out" in hint for hint in review.hints),
    ] == [True, True]


ROUND_AND_ON = [(0.0, 0.0, 60.0 * number) for number in range(6)] + [(200.0, 300.0, 360.0)]
"""Poses of a robot that turns round and drives on."""


def _looks(review: RunReview, poses, ranges_mm) -> list[str]:
    """Let a robot look from these poses, with these echoes; return the hints about its sonar or camera."""
    for pose, range_mm in zip(poses, ranges_mm, strict=False):
        data = {"pose": list(pose), "range_mm": range_mm, "sighting": None}
        review(Record(1.0, RecordKind.LOOK, "search", "lena", data))
    return [hint for hint in review.hints if "sonar" in hint or "camera" in hint]


@pytest.fixture(name="review")
def _review(mission_for):
    return RunReview(ReviewedRun(mission_for("lena"), None), lambda _: None)


@pytest.mark.parametrize(
    ("poses", "ranges_mm", "says"),
    [
        (ROUND_AND_ON, [None] * 7, "received no echo"),
        (ROUND_AND_ON * 2, [1230.0] * 14, "measured 1230 mm all the time"),
        (ROUND_AND_ON, [None] * 6 + [900.0], ""),
        (ROUND_AND_ON, [1230.0, 1240.0] * 4, ""),
        (ROUND_AND_ON[:6], [None] * 6, ""),
        ([(100.0 * number, 0.0, 10.0) for number in range(20)], [None] * 20, ""),
    ],
)
def test_a_sonar_that_measures_nothing_wherever_the_robot_looks_is_mentioned_once(review, poses, ranges_mm, says):
    hints = _looks(review, poses, ranges_mm)
    assert len(hints) == bool(says)
    assert all(says in hint and "nxtdrive sensor watch 4 --nxt ADDRESS" in hint for hint in hints)


def test_a_sonar_that_has_failed_was_reported_as_such(review):
    review(Record(0.0, RecordKind.SENSOR, "search", "lena", {"sensor": "sonar", "answers": False, "error": "gone"}))
    assert not _looks(review, ROUND_AND_ON, [None] * 7)


@pytest.mark.parametrize(("fault", "hints"), [("fogged", 1), (None, 0)])
def test_a_lens_that_is_fogged_wherever_the_robot_looks_is_mentioned_once(review, fault, hints):
    simulation = Simulation("room")
    if fault:
        simulation.world.perform(DisturbingEvent(name="it", when={"at_s": 0}, camera=True, fault=fault), None)
    for number, pose in enumerate(ROUND_AND_ON * 2):
        simulation.world.place_robot((500 + pose[0], 1400 + pose[1]), pose[2])
        simulation.advance(1000)
        review.see(Frame(simulation.camera_frame(), float(number), number))
        _looks(review, [pose], [float(number)])
    assert len([hint for hint in review.hints if "Wipe its lens" in hint]) == hints


def test_a_wheel_that_slipped_for_long_is_mentioned_once(review):
    said = []
    for slipped_s in (4.0, 31.0, 40.0):
        evidence = {"wheel": "right", "lost_share": 0.52, "slipped_s": slipped_s}
        data = {"source": "slipping", "to": "gripping", "event": Event.WHEEL_GRIPS, "reason": Reason.FRAMES_TURNED}
        review(Record(0.0, RecordKind.TRANSITION, "suspended", "lena", {**data, "evidence": evidence}))
        said.append([hint for hint in review.hints if "slipped" in hint])
    assert said[0] == []
    assert said[1] == said[2]
    assert said[1][0].startswith("The right wheel slipped for 31 s and lost about 52 % of its way. Wipe its tyre")


def test_a_link_that_is_lost_again_and_again_is_mentioned_once(review):
    data = {"source": "up", "to": "down", "event": Event.LINK_LOST, "reason": Reason.LINK_LOST, "evidence": {}}
    said = []
    for _ in range(5):
        review(Record(0.0, RecordKind.TRANSITION, "suspended", "lena", data))
        said.append(len([hint for hint in review.hints if "out of reach 3 times" in hint]))
    assert said == [0, 0, 1, 1, 1]
