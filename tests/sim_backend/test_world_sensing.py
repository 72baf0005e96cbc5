"""Ultrasonic echoes and lines of sight."""

import pytest

QUIET = "[ultrasonic]\nnoise_mm = 0\n"
BOX = "[[boxes]]\nname = 'box'\nsize_mm = [200, 200]\nheight_mm = {height}\nat_mm = [{x}, {y}]\n"
LENA = "[[pictures]]\nname = 'lena'\nat_mm = [2500, 1500]\nfacing_deg = {facing}\n"
SENSOR_X_MM = 1000 + 100


def test_the_distance_is_from_the_sensor_in_whole_centimetres(world):
    room = world(QUIET + BOX.format(x=2100, y=1500, height=300))
    assert room.ultrasonic.distance_cm() == (2000 - SENSOR_X_MM) // 10


def test_without_anything_in_range_there_is_no_echo(world):
    assert world(QUIET).ultrasonic.distance_cm() is None


@pytest.mark.parametrize(("offset_mm", "detected"), [(0, True), (250, True), (330, True), (450, False)])
def test_the_beam_is_a_cone_of_15_degrees(world, offset_mm, detected):
    room = world(QUIET + BOX.format(x=2100, y=1500 + offset_mm, height=300))
    assert (room.ultrasonic.distance_cm() is not None) is detected


def test_nothing_is_nearer_than_3_cm(world, drive):
    room = world(QUIET + "[[walls]]\nfrom_mm = [1300, 500]\nto_mm = [1300, 2500]\n")
    drive(room, 3000, 40, 40)
    assert room.robot.bumper_pressed
    assert room.ultrasonic.distance_cm() == 3


def test_the_beam_passes_over_low_things(world):
    room = world(QUIET + BOX.format(x=1900, y=1500, height=60))
    assert room.ultrasonic.distance_cm() is None


@pytest.mark.parametrize(("limit_deg", "detected"), [(65, False), (90, True)])
def test_a_wall_alongside_reflects_the_echo_away(world, limit_deg, detected):
    wall = "[[walls]]\nfrom_mm = [500, 1750]\nto_mm = [3500, 1750]\n"
    room = world(QUIET + f"max_incidence_deg = {limit_deg}\n" + wall)
    assert (room.ultrasonic.distance_cm() is not None) is detected


def test_a_wall_at_45_degrees_gives_an_echo(world):
    room = world(QUIET + "[[walls]]\nfrom_mm = [1500, 1000]\nto_mm = [2500, 2000]\n")
    assert room.ultrasonic.distance_cm() is not None


def test_readings_scatter_as_much_as_the_file_says(world):
    room = world("[ultrasonic]\nnoise_mm = 20\ndropout = 0.2\n" + BOX.format(x=2100, y=1500, height=300))
    readings = [room.ultrasonic.distance_cm() for _ in range(500)]
    echoes = [reading for reading in readings if reading is not None]
    assert 350 < len(echoes) < 450
    assert sum(echoes) / len(echoes) == pytest.approx(90, abs=0.5)
    assert 1 < max(echoes) - 90 < 10


def test_a_person_gives_an_echo_only_while_there(world, drive):
    room = world(
        QUIET
        + """
        [[people]]
        name = "anna"
        enters_from_mm = [2000, 2800]
        [[events]]
        name = "come"
        when = { at_s = 1 }
        person = "anna"
        to_mm = [2000, 1500]
        stays_s = 5
        """
    )
    assert room.ultrasonic.distance_cm() is None
    drive(room, 5000)
    assert room.ultrasonic.distance_cm() == (2000 - 180 - SENSOR_X_MM) // 10
    drive(room, 5000)
    assert room.ultrasonic.distance_cm() is None


@pytest.mark.parametrize(("facing_deg", "seen"), [(180, True), (225, True), (240, False), (0, False)])
def test_a_picture_is_seen_from_its_front(world, facing_deg, seen):
    assert world(LENA.format(facing=facing_deg)).in_view("lena") is seen


@pytest.mark.parametrize(("height_mm", "seen"), [(120, True), (300, False)])
def test_a_low_box_hides_no_picture(world, height_mm, seen):
    assert world(LENA.format(facing=180) + BOX.format(x=1800, y=1500, height=height_mm)).in_view("lena") is seen


def test_a_picture_beside_the_view_is_not_seen(world, drive):
    room = world(LENA.format(facing=180))
    drive(room, 500, 40, -40)
    assert room.robot.heading_deg > 30
    assert not room.in_view("lena")


def test_the_camera_gets_the_same_panels_while_only_the_robot_moves(world, drive):
    room = world(LENA.format(facing=180))
    before = room.panels()
    drive(room, 500, 40, 40)
    assert room.panels() is before
