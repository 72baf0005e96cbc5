"""The sensors of world files, read as any program reads them: by telegrams."""

import math

import pytest

from firmware_protocol.direct import GetInputValues, LSRead, LSWrite, SetInputMode, SetOutputState
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, RegulationMode, RunState, SensorMode, SensorType
from firmware_protocol.iomap import INPUT
from nxtdrive.brick import Brick
from nxtdrive.transports.sim import SimTransport
from sim_backend.devices import ColorSensor, TemperatureSensor
from sim_backend.simulation import Simulation

PERCENT, RAW, CELSIUS = SensorMode.PERCENT, SensorMode.RAW, SensorMode.CELSIUS
BLACK, BLUE, GREEN, YELLOW, RED, WHITE = range(1, 7)


@pytest.fixture
def room(world_file):
    """Makes a simulation of the empty room with more in it, and opens its brick."""
    bricks = []

    def make(extra, **options):
        simulation = Simulation(world_file(extra), **options)
        bricks.append(Brick(SimTransport(simulation)))
        return simulation, bricks[-1]

    yield make
    for brick in bricks:
        brick.close()


def sensor(kind, port=2, **keys):
    lines = [f"{key} = {value!r}" for key, value in {"kind": kind, "port": port, **keys}.items()]
    return "\n".join(["[[sensors]]", *lines, ""])


def read(brick, sensor_type, mode, port=InputPort.IN_2, settle_s=0.45):
    brick.request(SetInputMode(port, sensor_type, mode))
    brick.sleep(settle_s)
    values = brick.request(GetInputValues(port))
    assert values.valid
    return values


def transact(brick, message, size, port=InputPort.IN_2):
    brick.request(LSWrite.transaction(port, bytes(message), size))
    brick.sleep(0.03)
    return brick.request(LSRead(port)).received if size else b""


def digital(brick, port=InputPort.IN_2):
    brick.request(SetInputMode(port, SensorType.LOW_SPEED_9V, RAW))
    brick.sleep(0.03)


def power(brick, left, right):
    for port, percent in ((OutputPort.B, left), (OutputPort.C, right)):
        brick.request(
            SetOutputState(
                port, percent, OutputMode.MOTOR_ON | OutputMode.BRAKE, RegulationMode.IDLE, 0, RunState.RUNNING, 0
            )
        )


# light


@pytest.mark.parametrize(("color", "percent"), [("black", 32), ("white", 68), ("red", 57), ("blue", 33), ("grey", 50)])
def test_the_light_sensors_lamp_shows_how_much_red_the_floor_reflects(room, color, percent):
    _, brick = room(
        sensor("light", noise_percent=0) + f"[[patches]]\ncolor = '{color}'\nat_mm = [1080, 1500]\nsize_mm = [20, 20]\n"
    )
    assert read(brick, SensorType.LIGHT_ACTIVE, PERCENT).scaled == pytest.approx(percent, abs=1)


def test_without_its_lamp_the_light_sensor_sees_the_rooms_light(room):
    ahead = sensor("light", noise_percent=0, looks="ahead")
    for ambient in (10, 80):
        _, brick = room(ahead + f"[light]\nambient_percent = {ambient}\n")
        assert read(brick, SensorType.LIGHT_INACTIVE, PERCENT).scaled == pytest.approx(ambient, abs=1)
    _, brick = room(sensor("light", noise_percent=0))
    assert read(brick, SensorType.LIGHT_INACTIVE, PERCENT).scaled < 10


def test_the_light_sensor_crosses_a_line_of_tape(room):
    tape = "[[patches]]\ncolor = 'black'\nalong_mm = [[1400, 500], [1400, 1500], [1600, 2500]]\nwidth_mm = 30\n"
    simulation, brick = room(sensor("light", noise_percent=0) + tape)
    read(brick, SensorType.LIGHT_ACTIVE, PERCENT)
    dark = []
    power(brick, 25, 25)
    while simulation.truth.pose.x_mm < 1400 and simulation.time_s < 20:
        brick.sleep(0.01)
        if brick.request(GetInputValues(InputPort.IN_2)).scaled < 40:
            dark.append(simulation.truth.pose.x_mm + 80)
    assert min(dark) == pytest.approx(1400 - 15, abs=4)
    assert max(dark) == pytest.approx(1400 + 15, abs=4)


def test_later_patches_lie_on_top_and_turn_with_their_facing(room):
    carpet = "[[patches]]\ncolor = 'white'\nat_mm = [1080, 1500]\nsize_mm = [400, 400]\n"
    strip = "[[patches]]\ncolor = 'black'\nat_mm = [1080, 1600]\nsize_mm = [300, 20]\nfacing_deg = {}\n"
    for facing_deg, percent in ((0, 68), (90, 32)):
        _, brick = room(sensor("light", noise_percent=0) + carpet + strip.format(facing_deg))
        assert read(brick, SensorType.LIGHT_ACTIVE, PERCENT).scaled == pytest.approx(percent, abs=1)


def test_noise_does_not_depend_on_the_number_of_readings(room):
    def readings(step_ms):
        simulation, brick = room(sensor("light", noise_percent=3), seed=5)
        read(brick, SensorType.LIGHT_ACTIVE, PERCENT)
        simulation.advance(1000 - simulation.now_ms)
        seen = []
        for _ in range(20):
            for _ in range(20 // step_ms):
                simulation.advance(step_ms)
            seen.append(simulation.brick.input.ports[1].raw)
        return seen

    assert readings(20) == readings(4)
    assert len(set(readings(20))) > 10


# colour


@pytest.mark.parametrize(
    ("color", "number"),
    [("black", BLACK), ("blue", BLUE), ("green", GREEN), ("yellow", YELLOW), ("red", RED), ("white", WHITE)],
)
@pytest.mark.parametrize("ambient_percent", [0, 50, 100])
def test_the_colour_sensor_names_the_colour_of_the_floor(room, color, number, ambient_percent):
    _, brick = room(
        sensor("color") + f"[light]\nambient_percent = {ambient_percent}\n"
        f"[[patches]]\ncolor = '{color}'\nat_mm = [1080, 1500]\nsize_mm = [20, 20]\n"
    )
    assert read(brick, SensorType.COLOR_FULL, RAW).scaled == number


def test_the_colour_sensor_is_valid_after_400_ms(room):
    _, brick = room(sensor("color"))
    brick.request(SetInputMode(InputPort.IN_2, SensorType.COLOR_FULL, RAW))
    brick.sleep(0.395)
    assert not brick.request(GetInputValues(InputPort.IN_2)).valid
    brick.sleep(0.01)
    assert brick.request(GetInputValues(InputPort.IN_2)).valid


def test_a_colour_sensor_may_be_plugged_in_later(room):
    simulation, brick = room("")
    brick.request(SetInputMode(InputPort.IN_3, SensorType.COLOR_FULL, RAW))
    brick.sleep(1)
    assert not brick.request(GetInputValues(InputPort.IN_3)).valid
    simulation.brick.attach_sensor(3, ColorSensor(lambda: (60, 8, 8)))
    brick.sleep(0.5)
    assert brick.request(GetInputValues(InputPort.IN_3)).scaled == RED
    simulation.brick.attach_sensor(3, None)
    brick.sleep(0.5)
    assert not brick.request(GetInputValues(InputPort.IN_3)).valid


@pytest.mark.parametrize(
    ("lamp", "expected"),
    [(SensorType.COLOR_RED, 60), (SensorType.COLOR_GREEN, 8), (SensorType.COLOR_BLUE, 8), (SensorType.COLOR_NONE, 0)],
)
def test_one_lamp_shows_one_component(room, lamp, expected):
    _, brick = room(
        sensor("color", noise_percent=0)
        + "[light]\nambient_percent = 0\n[[patches]]\ncolor = 'red'\nat_mm = [1080, 1500]\nsize_mm = [20, 20]\n"
    )
    full_scale = 500 / 0.93 / 10.23
    assert read(brick, lamp, PERCENT).scaled == pytest.approx(expected * full_scale / 100, abs=1)


def test_the_map_shows_what_the_colour_sensor_sees(room):
    _, brick = room(
        sensor("color", noise_percent=0)
        + "[light]\nambient_percent = 0\n[[patches]]\ncolor = 'yellow'\nat_mm = [1080, 1500]\nsize_mm = [20, 20]\n"
    )
    read(brick, SensorType.COLOR_FULL, PERCENT)

    def of_port_2(name):
        spot = INPUT.field(name, 1)
        return spot.decode(brick.request(spot.read()).data)

    assert of_port_2("ColorADRaw") == [71 + 375, 71 + 300, 71 + 50, 71]
    assert of_port_2("ColorSensorRaw") == [375, 300, 50, 0]
    assert of_port_2("ColorSensorValue") == [36, 29, 4, 0]
    assert of_port_2("ColorBoolean") == [1, 1, 1, 1]
    assert of_port_2("ColorCalibration") == [1 << 16] * 12
    assert of_port_2("ColorCalLimits") == [400, 200]


def test_firmware_1_05_knows_no_colour_sensor(room):
    _, brick = room(sensor("color"), firmware="1.05")
    assert read(brick, SensorType.COLOR_FULL, RAW).scaled not in range(1, 7)


# sound


def test_a_noise_fades_with_distance_and_ends(room):
    simulation, brick = room(
        sensor("sound", noise_db=0) + "[surroundings]\nsound_db = 40\n"
        "[[sounds]]\nat_mm = [2000, 1500]\nlevel_db = 80\nfrom_s = 2\nfor_s = 3\n"
        "[[sounds]]\nat_mm = [3000, 1500]\nlevel_db = 80\nfrom_s = 10\n"
    )
    values = {}
    read(brick, SensorType.SOUND_DB, PERCENT)
    for second in (1, 3, 6, 11):
        simulation.advance(second * 1000 - simulation.now_ms)
        values[second] = brick.request(GetInputValues(InputPort.IN_2)).normalized / 10.23
    assert values[1] == values[6] == pytest.approx(100 * 10 ** (-50 / 20), abs=0.3)
    assert values[3] == pytest.approx(100 * 10 ** (-10 / 20), abs=0.3)
    assert values[11] == pytest.approx(values[3] / 2, abs=0.3)


def test_both_types_of_the_sound_sensor_measure_the_same(room):
    _, brick = room(sensor("sound", noise_db=0) + "[surroundings]\nsound_db = 80\n")
    readings = {read(brick, kind, PERCENT).scaled for kind in (SensorType.SOUND_DB, SensorType.SOUND_DBA)}
    assert readings == {31}


# temperature


@pytest.mark.parametrize("temperature_c", [-15.0, 0.0, 21.5, 40.0, 65.0])
def test_the_analog_temperature_sensor_is_read_through_the_firmwares_table(room, temperature_c):
    _, brick = room(
        sensor("temperature", model="rcx") + f"[surroundings]\ntemperature_c = {temperature_c}\n",
    )
    # a step of the converter is up to half a degree, more at the cold end
    assert read(brick, SensorType.TEMPERATURE, CELSIUS).scaled / 10 == pytest.approx(temperature_c, abs=1)


@pytest.mark.parametrize(
    ("resolution", "expected"), [(0x00, b"\x15\x00"), (0x20, b"\x15\x40"), (0x40, b"\x15\x60"), (0x60, b"\x15\x60")]
)
def test_the_digital_temperature_sensor_rounds_to_its_resolution(room, resolution, expected):
    _, brick = room(sensor("temperature") + "[surroundings]\ntemperature_c = 21.4\n")
    digital(brick)
    transact(brick, [0x98, 0x01, resolution], 0)
    assert transact(brick, [0x98, 0x01], 1) == bytes([resolution])
    assert transact(brick, [0x98, 0x00], 2) == expected


def test_the_digital_temperature_sensor_counts_below_zero(room):
    _, brick = room(sensor("temperature") + "[surroundings]\ntemperature_c = -10.5\n")
    digital(brick)
    assert int.from_bytes(transact(brick, [0x98, 0x00], 2), "big", signed=True) / 256 == -10.5


def test_a_shut_down_temperature_sensor_measures_on_command(room):
    simulation, brick = room("")
    weather = [20.0]
    simulation.brick.attach_sensor(3, TemperatureSensor(lambda: weather[0]))
    digital(brick, InputPort.IN_3)

    def ask(*message, size=0):
        return transact(brick, [0x98, *message], size, InputPort.IN_3)

    ask(0x01, 0x01)
    weather[0] = 30.0
    assert ask(0x00, size=2) == b"\x14\x00"
    ask(0x01, 0x81)
    assert ask(0x01, size=1) == b"\x01"
    assert ask(0x00, size=2) == b"\x1e\x00"
    assert (ask(0x02, size=2), ask(0x03, size=2)) == (b"\x4b\x00", b"\x50\x00")
    ask(0x03, 0x20, 0x00)
    assert ask(0x03, size=2) == b"\x20\x00"


# compass


@pytest.mark.parametrize(
    ("north_deg", "heading_deg"), [(270, 90), (0, 0), (90, 270), (1, 359)], ids=["up", "right", "down", "odd"]
)
def test_the_compass_points_north(room, north_deg, heading_deg):
    _, brick = room(sensor("compass", noise_deg=0) + f"[surroundings]\nnorth_deg = {north_deg}\n")
    digital(brick)
    half, odd, low, high = transact(brick, [0x02, 0x42], 4)
    assert 2 * half + odd == low + 256 * high == heading_deg


def test_the_compass_identifies_itself(room):
    _, brick = room(sensor("compass"))
    digital(brick)
    assert transact(brick, [0x02, 0x08], 8) == b"HiTechnc"
    assert transact(brick, [0x02, 0x10], 8) == b"Compass "


def test_the_compass_turns_with_the_robot_and_stands_still_while_it_calibrates(room):
    simulation, brick = room(sensor("compass", noise_deg=0))
    digital(brick)
    power(brick, 30, -30)
    brick.sleep(0.3)
    power(brick, 0, 0)
    brick.sleep(0.5)

    def heading_deg():
        return int.from_bytes(transact(brick, [0x02, 0x44], 2), "little")

    assert heading_deg() == pytest.approx(90 + simulation.truth.pose.heading_deg, abs=1)
    before = heading_deg()
    transact(brick, [0x02, 0x41, 0x43], 0)
    power(brick, 30, -30)
    brick.sleep(0.3)
    power(brick, 0, 0)
    brick.sleep(0.5)
    assert heading_deg() == before
    transact(brick, [0x02, 0x41, 0x00], 0)
    assert heading_deg() == pytest.approx(90 + simulation.truth.pose.heading_deg, abs=1)


def test_iron_turns_the_needle_near_it(room):
    iron = "[[magnets]]\nat_mm = [1000, {y}]\nradius_mm = 1000\ndeflection_deg = 40\n"
    turned = []
    for y in (1500, 2000, 2700):
        _, brick = room(sensor("compass", noise_deg=0) + iron.format(y=y))
        digital(brick)
        turned.append(90 - int.from_bytes(transact(brick, [0x02, 0x44], 2), "little"))
    assert turned == [40, 20, 0]


# touch, ultrasonic, any digital sensor


def test_a_bumper_at_the_back_feels_the_wall_behind(room):
    _, brick = room(sensor("touch", direction_deg=180))
    assert read(brick, SensorType.SWITCH, SensorMode.BOOLEAN).scaled == 0
    assert read(brick, SensorType.SWITCH, SensorMode.BOOLEAN, InputPort.IN_1).scaled == 0
    power(brick, -50, -50)
    brick.sleep(8)
    assert brick.request(GetInputValues(InputPort.IN_2)).scaled == 1
    assert brick.request(GetInputValues(InputPort.IN_1)).scaled == 0


def test_an_ultrasonic_sensor_may_look_sideways(room):
    look = sensor("ultrasonic", at_mm=[0.0, 50.0], direction_deg=90, noise_mm=0)
    _, brick = room(look)
    digital(brick)
    assert transact(brick, [0x02, 0x42], 1) == bytes([math.floor((3000 - 1500 - 50) / 10)])


def test_a_digital_sensor_of_any_kind_is_a_set_of_registers(room):
    _, brick = room(
        "[[sensors]]\nkind = 'i2c'\nport = 3\naddress = 0x14\nregisters = { '0x08' = 'ACME', 66 = [1, 2, 255] }\n"
    )
    digital(brick, InputPort.IN_3)
    assert transact(brick, [0x14, 0x08], 4, InputPort.IN_3) == b"ACME"
    transact(brick, [0x14, 0x43, 7], 0, InputPort.IN_3)
    assert transact(brick, [0x14, 0x42], 3, InputPort.IN_3) == b"\x01\x07\xff"


def test_unread_sensors_do_not_change_a_run(room):
    many = sensor("light") + sensor("compass", port=3)
    poses = []
    for extra in ("", many):
        simulation, brick = room(extra + "[ultrasonic]\nnoise_mm = 20\n", seed=3)
        power(brick, 50, 50)
        brick.sleep(2)
        poses.append(simulation.truth.pose)
    assert poses[0] == poses[1]


@pytest.mark.slow
def test_a_line_follower_goes_round_the_bundled_track():
    simulation = Simulation("track")
    with Brick(SimTransport(simulation)) as brick:
        read(brick, SensorType.LIGHT_ACTIVE, PERCENT, InputPort.IN_3)
        quarters, edge = set(), 50
        while simulation.time_s < 60 and len(quarters) < 4:
            # the right edge of the tape, driven clockwise: dark means too far left
            error = edge - brick.request(GetInputValues(InputPort.IN_3)).scaled
            power(brick, round(25 + error * 0.6), round(25 - error * 0.6))
            brick.sleep(0.02)
            x_mm, y_mm, _ = simulation.truth.pose
            quarters.add((x_mm > 2000, y_mm > 1300))
        assert len(quarters) == 4
        assert simulation.truth.contacts == 0
