"""When the events of a world happen."""

import pytest

from firmware_protocol.errors import ConfigError

LENA = "[[pictures]]\nname = 'lena'\nat_mm = [3000, 1500]\nfacing_deg = 180\n"
ANNA = "[[people]]\nname = 'anna'\nenters_from_mm = [2500, 2800]\n"


def event(name, when, action):
    return f"[[events]]\nname = '{name}'\nwhen = {{ {when} }}\n{action}\n"


def times_s(room, name):
    return [time_ms / 1000 for time_ms, happened in room.scheduler.log if happened == name]


def test_a_picture_vanishes_and_comes_back_by_the_clock(world, drive):
    room = world(
        LENA
        + event("gone", "at_s = 1", "picture = 'lena'\npresent = false")
        + event("back", "after = 'gone', delay_s = 2", "picture = 'lena'\nto_mm = [2000, 1400]\nfacing_deg = 170")
    )
    drive(room, 2000)
    assert not room.pictures["lena"].present
    assert not any(panel.texture == "lena" for panel in room.panels())
    drive(room, 2000)
    assert room.pictures["lena"].at_mm == (2000, 1400)
    assert room.pictures["lena"].facing_deg == pytest.approx(170)
    assert room.scheduler.log == [(1000, "gone"), (3000, "back")]


def test_a_person_walks_in_stays_and_leaves(world, drive):
    room = world(ANNA + event("visit", "at_s = 1", "person = 'anna'\nto_mm = [2500, 1200]\nstays_s = 4"))
    anna = room.people["anna"]
    drive(room, 2000)
    assert anna.walking
    assert 1200 < anna.at_mm[1] < 2800
    drive(room, 2000)
    assert anna.at_mm == (2500, 1200)
    assert not anna.walking
    drive(room, 6000)
    assert not anna.present


def test_a_person_steps_between_robot_and_picture_once_it_was_seen_long_enough(world, drive):
    room = world(LENA + ANNA + event("block", "sees = 'lena', for_s = 1.5", "person = 'anna'\nblocks = 'lena'"))
    assert room.in_view("lena")
    drive(room, 1400)
    assert room.scheduler.log == []
    drive(room, 4000)
    assert times_s(room, "block") == [1.6]
    assert not room.in_view("lena")
    assert room.people["anna"].at_mm == pytest.approx((2400, 1500), abs=1)


@pytest.mark.parametrize(
    ("condition", "happens"), [("robot_beyond_mm = 1900", True), ("robot_within_mm = 1900", False)]
)
def test_the_robots_distance_counts(world, drive, condition, happens):
    room = world(LENA + event("gone", f"sees = 'lena', {condition}", "picture = 'lena'\npresent = false"))
    drive(room, 500)
    assert bool(room.scheduler.log) is happens


def test_an_event_happens_when_the_robot_comes_near(world, drive):
    room = world(LENA + event("gone", "of = 'lena', robot_within_mm = 1500", "picture = 'lena'\npresent = false"))
    while not room.scheduler.log:
        drive(room, 100, 60, 60)
    assert 1500 - 30 < room.robot_distance_mm("lena") < 1500


def test_events_follow_the_end_of_others(world, drive):
    room = world(
        LENA
        + ANNA
        + event("visit", "at_s = 0", "person = 'anna'\nto_mm = [2500, 1200]\nstays_s = 2")
        + event("gone", "after_end_of = 'visit'", "picture = 'lena'\npresent = false")
    )
    drive(room, 10_000)
    [end_s] = times_s(room, "gone")
    assert end_s == pytest.approx(0.1 + 2 * 1.6 / 0.8 + 2, abs=0.5)


def test_a_person_may_be_sent_away(world, drive):
    room = world(
        ANNA
        + event("come", "at_s = 0", "person = 'anna'\nto_mm = [2500, 1200]")
        + event("go", "after = 'come', delay_s = 20", "person = 'anna'\nleaves = true")
    )
    drive(room, 20_000)
    assert room.people["anna"].present
    drive(room, 3_000)
    assert not room.people["anna"].present


@pytest.mark.parametrize(("times", "visits"), [(1, 1), (2, 2), (0, 3)])
def test_an_event_happens_as_often_as_it_may(world, drive, times, visits):
    action = f"person = 'anna'\nblocks = 'lena'\nstays_s = 2\ntimes = {times}"
    room = world(LENA + ANNA + event("visit", "sees = 'lena', for_s = 4", action))
    drive(room, 28_000)
    assert len(times_s(room, "visit")) == visits


def test_a_person_may_come_again_and_again(world, drive):
    action = "person = 'anna'\nto_mm = [2500, 2000]\nstays_s = 1\ntimes = 0"
    room = world(ANNA + event("patrol", "at_s = 1, delay_s = 4", action))
    drive(room, 25_000)
    first_s, second_s, third_s = times_s(room, "patrol")
    assert first_s == 5
    assert second_s - first_s == third_s - second_s == pytest.approx(1 + 2 + 4, abs=0.5)


def test_the_second_view_can_be_the_trigger(world, drive):
    room = world(LENA + event("second look", "sees = 'lena', view_number = 2", "picture = 'lena'\npresent = false"))
    drive(room, 2000)
    assert room.scheduler.log == []
    drive(room, 600, 40, -40)
    drive(room, 600, -40, 40)
    drive(room, 500)
    assert times_s(room, "second look")


def test_drawn_durations_differ_by_seed_and_repeat_for_one(world, drive):
    def stay_s(seed):
        action = "person = 'anna'\nto_mm = [2500, 2000]\nstays_s = [2, 12]"
        after = event("over", "after_end_of = 'visit'", "picture = 'lena'\npresent = false")
        room = world(LENA + ANNA + event("visit", "at_s = 0", action) + after, seed=seed)
        drive(room, 18_000)
        return times_s(room, "over")

    assert stay_s(1) == stay_s(1)
    assert len({tuple(stay_s(seed)) for seed in range(4)}) == 4


def test_a_walking_person_waits_for_the_robot(world, drive):
    person = "[[people]]\nname = 'anna'\nenters_from_mm = [1000, 2800]\n"
    room = world(person + event("cross", "at_s = 0", "person = 'anna'\nto_mm = [1000, 200]"))
    drive(room, 5000)
    assert room.contact_count == 0
    assert room.people["anna"].walking
    drive(room, 1500, 60, 60)
    drive(room, 4000)
    assert room.people["anna"].at_mm == (1000, 200)


def test_a_picture_rides_to_and_fro_at_its_speed(world, drive):
    there = event("there", "at_s = 1", "picture = 'lena'\nto_mm = [3000, 2500]\nspeed_mm_s = 100\ntimes = 0")
    room = world(LENA + there + event("back", "after_end_of = 'there'", "picture = 'lena'\nto_mm = [3000, 1500]"))
    lena = room.pictures["lena"]
    drive(room, 1000)
    assert room.quiet is False
    drive(room, 5000)
    assert lena.at_mm == pytest.approx((3000, 2000), abs=15)
    assert lena.facing_deg == pytest.approx(180)
    drive(room, 5000)
    assert times_s(room, "back")[0] == pytest.approx(11.0, abs=0.2)


def test_a_picture_on_a_vehicle_waits_for_the_robot(world, drive):
    picture = "[[pictures]]\nname = 'lena'\nat_mm = [1000, 2800]\nfacing_deg = 270\n"
    room = world(picture + event("ride", "at_s = 0", "picture = 'lena'\nto_mm = [1000, 200]\nspeed_mm_s = 400"))
    drive(room, 5000)
    assert room.contact_count == 0
    assert room.pictures["lena"].rides
    drive(room, 1500, 60, 60)
    drive(room, 6000)
    assert room.pictures["lena"].at_mm == (1000, 200)
    assert room.contact_count == 0


@pytest.mark.parametrize("action", ["person = 'anna'\nto_mm = [1, 1]", "picture = 'lena'\npresent = false"])
def test_only_a_picture_with_a_place_to_go_rides(world, action):
    with pytest.raises(ConfigError, match="speed_mm_s is for a picture that rides to to_mm"):
        world(LENA + ANNA + event("ride", "at_s = 1", f"{action}\nspeed_mm_s = 100"))


def test_the_world_rests_when_nothing_moves(world, drive):
    room = world(ANNA + event("visit", "at_s = 1", "person = 'anna'\nto_mm = [2500, 2000]\nstays_s = 5"))
    assert room.quiet
    drive(room, 1500)
    assert not room.quiet
    drive(room, 2000)
    assert room.quiet
    drive(room, 500, 40, 40)
    assert not room.quiet
    drive(room, 300)
    assert room.quiet
