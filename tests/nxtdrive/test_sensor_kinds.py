"""Every sensor of the driver on its simulated device: values, ages, round trips, and identification."""

from itertools import islice

import pytest

from firmware_protocol.direct import LSRead, SetInputMode
from firmware_protocol.enums import InputPort, SensorMode, SensorType
from firmware_protocol.status import Status
from nxtdrive.errors import BrickError, ConfigError, LinkTimeout, LocalProtocolError, SensorTimeout
from nxtdrive.sensors import Color, Identity, RcxTemperature, Reading, identify
from nxtdrive.sensors.i2c import bus_time_s
from nxtdrive.sensors.kinds import KINDS, in_words, make_sensor
from sim_backend.devices import (
    ColorSensor,
    Compass,
    GenericI2CDevice,
    LightSensor,
    RcxTemperatureSensor,
    SoundSensor,
    TemperatureSensor,
    TouchSensor,
    UltrasonicSensor,
)
from sim_backend.firmware.brick import SimBrick
from sim_backend.link import LinkFaults

LINKS = pytest.mark.parametrize("latency_ms", [2, 45])


class EightEchoes(UltrasonicSensor):
    """Hears as many echoes as it is given after a single ping, and counts the pings."""

    def __init__(self, echoes_cm):
        super().__init__(lambda: echoes_cm[0])
        self.echoes_cm, self.pings = echoes_cm, 0

    def _measure(self):
        super()._measure()
        if self._mode == self.SINGLE_SHOT:
            self.pings += 1
            self._echoes = bytes(self.echoes_cm).ljust(8, b"\xff")


@LINKS
@pytest.mark.parametrize("percent", [0.0, 35.0, 80.0, 100.0])
def test_light_is_a_percentage_with_the_lamp_on_or_off(lab, latency_ms, percent):
    room = lab(latency_ms=latency_ms)
    room.attach(3, LightSensor(lambda: percent))
    for lamp, kind in ((True, SensorType.LIGHT_ACTIVE), (False, SensorType.LIGHT_INACTIVE)):
        light = room.brick.light(3, lamp=lamp)
        assert light.lamp is lamp
        assert light.percent == pytest.approx(percent, abs=1.0)
        assert 0.0 <= light.percent <= 100.0
        assert room.simulation.brick.input.ports[2].type == kind
    light.lamp = True
    assert light.percent == pytest.approx(percent, abs=1.0)
    assert room.simulation.brick.input.ports[2].type == SensorType.LIGHT_ACTIVE


def test_sound_grows_with_the_loudness_and_changes_its_weighing(lab):
    room, level_db = lab(), [60.0]
    room.attach(2, SoundSensor(lambda: level_db[0]))
    sound = room.brick.sound(2, dba=True)
    assert sound.dba
    soft = sound.percent
    level_db[0] = 80.0
    room.brick.sleep(0.1)
    assert soft < sound.percent < 100
    sound.dba = False
    assert not sound.dba
    assert sound.value == pytest.approx(sound.percent)
    assert room.simulation.brick.input.ports[1].type == SensorType.SOUND_DB


@LINKS
@pytest.mark.parametrize("celsius", [-12.5, 0.0, 21.4])
def test_both_thermometers_say_the_temperature(lab, latency_ms, celsius):
    room = lab(latency_ms=latency_ms)
    room.attach(1, TemperatureSensor(lambda: celsius))
    room.attach(2, RcxTemperatureSensor(lambda: celsius))
    assert room.brick.temperature(1).celsius == pytest.approx(celsius, abs=0.07)
    assert RcxTemperature(room.brick.link, 2).celsius == pytest.approx(celsius, abs=0.8)


def test_a_thermometer_that_is_plugged_in_later_measures_as_finely(lab):
    room = lab()
    sensor = room.brick.temperature(1)
    for celsius in (21.4, -12.6):
        room.attach(1, None)
        with pytest.raises(BrickError):
            _ = sensor.celsius
        room.attach(1, TemperatureSensor(lambda celsius=celsius: celsius))
        assert sensor.celsius == pytest.approx(celsius, abs=0.07)


@pytest.mark.parametrize("heading_deg", [0, 1, 179, 180, 359])
def test_the_compass_says_the_heading(lab, heading_deg):
    room = lab()
    room.attach(2, Compass(lambda: heading_deg))
    assert room.brick.compass(2).heading_deg == heading_deg


@pytest.mark.parametrize("registers", [(180, 0), (255, 255)])
def test_a_value_that_no_compass_gives_is_refused(lab, registers):
    room = lab()
    room.attach(4, GenericI2CDevice()).write(bytes((0x42, *registers)))
    with pytest.raises(SensorTimeout, match="0 to 359"):
        _ = room.brick.compass(4).heading_deg


def test_an_empty_port_has_no_temperature(lab):
    room = lab()
    room.attach(2, None)
    with pytest.raises(SensorTimeout, match="empty"):
        _ = RcxTemperature(room.brick.link, 2).celsius


@pytest.mark.parametrize(
    ("surface", "color"),
    [
        ((90, 5, 5), Color.RED),
        ((5, 60, 10), Color.GREEN),
        ((5, 5, 90), Color.BLUE),
        ((90, 80, 10), Color.YELLOW),
        ((95, 95, 95), Color.WHITE),
        ((3, 3, 3), Color.BLACK),
    ],
)
def test_the_colour_of_a_surface(lab, surface, color):
    room = lab()
    room.attach(3, ColorSensor(lambda: surface))
    sensor = room.brick.color(3)
    rgb = sensor.rgb
    assert max(range(3), key=rgb.__getitem__) == max(range(3), key=surface.__getitem__)
    assert sensor.color is color
    assert sensor.brightness_percent("red") > sensor.brightness_percent("off")
    assert sensor.rgb == pytest.approx(rgb, abs=20)
    assert sensor.color is color


def test_the_brightness_by_one_lamp_is_a_percentage_in_proportion_to_the_reflected_light(lab):
    room = lab()
    room.attach(3, ColorSensor(lambda: (100, 50, 0)))
    sensor = room.brick.color(3)
    red, green, blue, none = map(sensor.brightness_percent, ("red", "green", "blue", "off"))
    assert 10 < red < 100
    assert green == pytest.approx(red / 2, abs=2)
    assert blue == none == pytest.approx(0, abs=5)


def test_an_old_firmware_without_colours_is_reported(lab):
    room = lab(firmware="1.05")
    room.attach(3, ColorSensor(lambda: (50, 50, 50)))
    with pytest.raises(LocalProtocolError, match=r"1\.29"):
        _ = room.brick.color(3).color


def test_a_missing_colour_sensor_gives_no_colour(lab):
    room = lab()
    room.attach(3, None)
    sensor, begun_s = room.brick.color(3), room.brick.now()
    with pytest.raises(SensorTimeout, match="plugged in"):
        _ = sensor.color
    assert room.brick.now() - begun_s == pytest.approx(0.5, abs=0.05)
    assert not sensor.ready


def test_a_snapshot_has_all_echoes_and_the_sensor_measures_on_afterwards(lab):
    room = lab()
    device = room.attach(4, EightEchoes([80, 30, 120]))
    sonar = room.brick.ultrasonic(4)
    assert sonar.snapshot() == (300.0, 800.0, 1200.0)
    assert device.pings == 1
    device.echoes_cm[0] = 90
    assert sonar.distance_mm == 900.0
    assert sonar.snapshot() == (300.0, 900.0, 1200.0)
    device.echoes_cm[0] = 80
    sonar.start()
    room.brick.sleep(0.05)
    assert sonar.poll() == (True, 800.0)


@LINKS
def test_a_distance_costs_one_round_trip_and_the_time_on_the_bus(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    room.attach(4, UltrasonicSensor(lambda: 77))
    sonar = room.brick.ultrasonic(4)
    sonar.set_up()
    begun = room.brick.now()
    for _ in range(20):
        assert sonar.distance_mm == 770.0
    assert (room.brick.now() - begun) / 20 <= (latency_ms + 10) / 1000


@pytest.mark.parametrize("sent", [1, 2, 3, 8, 16])
@pytest.mark.parametrize("received", [0, 1, 2, 4, 8, 15])
def test_the_time_on_the_bus_is_foreseen(sent, received):
    brick = SimBrick()
    brick.attach_sensor(1, GenericI2CDevice())
    brick.receive(SetInputMode(InputPort.IN_1, SensorType.LOW_SPEED, SensorMode.RAW).encode())
    brick.tick(25)
    brick.low_speed.write(0, bytes([2]).ljust(sent, b"\0"), received)
    begun_ms = brick.now_ms
    while brick.low_speed.active:
        brick.tick()
    assert bus_time_s(sent, received) * 1000 == pytest.approx(brick.now_ms - begun_ms, abs=1.6)


def test_a_question_that_was_lost_is_asked_again(lab):
    room = lab(faults=LinkFaults(drop_requests=range(60, 10_000, 9)))
    room.attach(4, UltrasonicSensor(lambda: 50))
    sonar = room.brick.ultrasonic(4)
    readings = []
    for _ in range(60):
        try:
            readings.append(sonar.distance_mm)
        except LinkTimeout:  # the other telegram was lost, the one that is answered
            continue
    assert len(readings) > 30
    assert set(readings) == {500.0}


def test_a_reset_port_is_set_up_again(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 50))
    sonar = room.brick.ultrasonic(4)
    assert sonar.distance_mm == 500.0
    room.brick.request(SetInputMode(InputPort.IN_4, SensorType.NONE, SensorMode.RAW))
    assert sonar.distance_mm == 500.0


def test_readings_carry_the_time_at_which_they_held(lab):
    room = lab(latency_ms=45)
    room.attach(4, UltrasonicSensor(lambda: round(room.simulation.time_s * 10)))
    sonar = room.brick.ultrasonic(4)
    for reading in islice(sonar.watch(), 10):
        assert isinstance(reading, Reading)
        assert reading.time_s * 100 == pytest.approx(reading.value, abs=12)
        assert 0 < reading.age_s(room.brick.now()) < 0.1


def test_watching_keeps_the_pace_that_was_asked_for(lab):
    room = lab()
    room.attach(1, TouchSensor(lambda: True))
    times = [reading.time_s for reading in islice(room.brick.touch(1).watch(0.1), 11)]
    assert times[-1] - times[0] == pytest.approx(1.0, abs=0.02)


def test_digital_sensors_identify_themselves(lab):
    room = lab()
    room.attach(1, UltrasonicSensor(lambda: 10))
    room.attach(2, Compass(lambda: 10))
    room.attach(3, TemperatureSensor(lambda: 10))
    room.attach(4, None)
    found = [identify(room.brick.link, port) for port in (1, 2, 3, 4)]
    assert found[0] == Identity("V1.0", "LEGO", "Sonar", "ultrasonic")
    assert found[1].kind == "compass"
    assert found[2].kind == "temperature"
    assert found[3] is None


@pytest.mark.parametrize("fails_at", [0x02, 0x98])
def test_a_port_that_the_brick_refuses_is_no_port_without_a_sensor(lab, fails_at):
    """Such as one that a program sets to another type again and again."""
    room = lab()
    bus, addresses = room.simulation.brick.low_speed, []
    bus.write = lambda port, data, rx_size, options=0: addresses.append(data[0]) or True
    bus.status = lambda port: Status.CHANNEL_INVALID if addresses[-1:] == [fails_at] else Status.BUS_ERROR
    with pytest.raises(BrickError) as caught:
        identify(room.brick.link, 2)
    assert caught.value.status is Status.CHANNEL_INVALID


def test_an_unknown_digital_sensor_is_named_and_read_by_registers(lab):
    room = lab()
    device = room.attach(2, GenericI2CDevice(address=0x02))
    device.registers[:24] = b"V2.1\0old Acme\0\0\0\0Gyro\xff\xff\xff\xff"
    found = identify(room.brick.link, 2)
    assert (found.version, found.vendor, found.kind) == ("V2.1", "Acme", "i2c")
    sensor = room.brick.i2c(2)
    sensor.write(0x60, 5)
    assert sensor.read(0x60, 1) == b"\x05"


@pytest.mark.parametrize("address", [-2, 0, 0x100, 2.0, "0x02"])
def test_an_address_that_cannot_be_is_refused(lab, address):
    with pytest.raises(LocalProtocolError, match="address"):
        lab().brick.i2c(1, address)


def test_every_kind_can_be_made_by_name(lab):
    brick = lab().brick
    for kind in KINDS:
        sensor = make_sensor(kind, brick.link, 1)
        assert sensor.quantity
        assert sensor.link is brick.link
    with pytest.raises(ConfigError, match="ultrasonic"):
        make_sensor("smell", brick.link, 1)


@pytest.mark.parametrize(
    ("value", "unit", "words"),
    [(None, "mm", "no echo"), (310.0, "mm", "310 mm"), (True, "", "yes"), (Color.RED, "", "red"), (7, "°", "7°")],
)
def test_values_in_words(value, unit, words):
    assert in_words(value, unit) == words


def test_bytes_left_over_by_a_neighbour_program_are_not_a_reading(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 50))
    sonar = room.brick.ultrasonic(4)
    assert sonar.distance_mm == 500.0
    sonar.start_read(0x11)
    room.brick.sleep(0.1)
    assert sonar.distance_mm == 500.0
    assert room.brick.request(LSRead(InputPort.IN_4)).received == b""
