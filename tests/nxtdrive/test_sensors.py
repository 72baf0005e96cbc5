"""Sensors on the simulated brick, and what can go wrong on a bus."""

import pytest

from firmware_protocol.direct import LSRead, LSWrite, SetInputMode
from firmware_protocol.enums import InputPort, SensorMode, SensorType
from firmware_protocol.errors import BrickError, LinkTimeout, LocalProtocolError
from firmware_protocol.status import Status
from nxtdrive.sensors import I2CSensor
from sim_backend.devices import GenericI2CDevice, TouchSensor, UltrasonicSensor

LINKS = pytest.mark.parametrize("latency_ms", [1, 2, 45])


@LINKS
def test_a_button_is_pressed_or_not(lab, latency_ms):
    room, down = lab(latency_ms=latency_ms), []
    room.attach(2, TouchSensor(lambda: bool(down)))
    touch = room.brick.touch(2)
    assert not touch.pressed
    down.append(True)
    room.brick.sleep(0.1)
    assert touch.pressed


@LINKS
@pytest.mark.parametrize(("echo_cm", "distance_mm"), [(30, 300.0), (0, 0.0), (None, None)])
def test_a_distance_is_in_millimetres_and_none_without_an_echo(lab, latency_ms, echo_cm, distance_mm):
    room = lab(latency_ms=latency_ms)
    room.attach(3, UltrasonicSensor(lambda: echo_cm))
    room.brick.sleep(0.2)
    sonar = room.brick.ultrasonic(3)
    sonar.set_up()
    room.brick.sleep(0.2)
    assert sonar.distance_mm == distance_mm


def test_a_port_that_a_program_has_set_to_the_same_type_in_another_mode_is_set_up(lab):
    room = lab()
    room.attach(2, TouchSensor(lambda: True))
    room.brick.request(SetInputMode(InputPort.IN_2, SensorType.SWITCH, SensorMode.RAW))
    assert room.brick.touch(2).pressed


def test_a_sonar_that_was_switched_off_is_switched_on_again(lab):
    room = lab()
    room.attach(3, UltrasonicSensor(lambda: 50))
    first = room.brick.ultrasonic(3)
    first.write(0x41, 0x00)
    assert first.read(0x41, 1) == b"\0"
    second = room.brick.ultrasonic(3)
    second.set_up()
    room.brick.sleep(0.2)
    assert second.distance_mm == 500.0


@LINKS
def test_a_measurement_can_be_fetched_later(lab, latency_ms):
    room = lab(latency_ms=latency_ms)
    distances = [40]
    room.attach(3, UltrasonicSensor(lambda: distances[0]))
    sonar = room.brick.ultrasonic(3)
    sonar.set_up()
    room.brick.sleep(0.2)
    for centimetres in (40, 90, 20):
        distances[0] = centimetres
        room.brick.sleep(0.2)
        sonar.start()
        there = False
        while not there:
            there, distance_mm = sonar.poll()
        assert distance_mm == centimetres * 10


def test_a_register_can_be_fetched_later(lab):
    room = lab()
    room.attach(4, GenericI2CDevice()).write(bytes((0x10, 11, 22, 33)))
    sensor = I2CSensor(room.brick.link, 4)
    for register, value in ((0x10, 11), (0x11, 22)):
        sensor.start_read(register)
        assert sensor.fetch() is None, "the bus is busy"
        room.brick.sleep(0.02)
        assert sensor.fetch() == value


def test_a_byte_that_was_not_fetched_is_not_that_of_the_next_register(lab):
    room = lab()
    room.attach(4, GenericI2CDevice()).write(bytes((0x10, 11, 22, 33)))
    sensor = I2CSensor(room.brick.link, 4)
    sensor.start_read(0x10)
    room.brick.sleep(0.02)
    sensor.start_read(0x12)
    assert sensor.fetch() is None
    room.brick.sleep(0.02)
    assert sensor.fetch() == 33


def test_a_byte_whose_request_was_lost_is_not_that_of_the_next_register(lab):
    room = lab()
    room.attach(4, GenericI2CDevice()).write(bytes((0x10, 11, 22, 33)))
    sensor = I2CSensor(room.brick.link, 4)
    assert sensor.read(0x11, 1) == bytes((22,))
    deliver = room.simulation.deliver
    lost = LSRead(InputPort.IN_4).encode()
    room.simulation.deliver = lambda telegram: None if telegram == lost else deliver(telegram)
    with pytest.raises(LinkTimeout):
        sensor.read(0x10, 1)
    room.simulation.deliver = deliver
    assert sensor.read(0x12, 1) == bytes((33,))


def test_a_write_to_a_sensor_that_is_not_there_is_an_error(lab):
    room = lab()
    room.attach(4, None)
    with pytest.raises(BrickError) as caught:
        I2CSensor(room.brick.link, 4).write(0x10, 1)
    assert caught.value.status is Status.BUS_ERROR


@pytest.mark.parametrize("fails", ["fetched", "started anew"])
def test_a_measurement_that_a_reset_of_its_port_ends_can_be_started_again(lab, fails):
    room = lab()
    room.attach(3, UltrasonicSensor(lambda: 40))
    sonar = room.brick.ultrasonic(3)
    sonar.set_up()
    sonar.start()
    room.brick.request(SetInputMode(InputPort.IN_3, SensorType.NONE, SensorMode.RAW))
    with pytest.raises(BrickError):
        sonar.poll() if fails == "fetched" else sonar.start()
    sonar.start()
    room.brick.sleep(0.05)
    assert sonar.poll() == (True, 400.0)


def test_a_measurement_that_begins_during_another_one_is_not_taken_for_no_echo(lab):
    """As when the safety stop and a program use one sonar."""
    room = lab()
    room.attach(3, UltrasonicSensor(lambda: 40))
    sonar, polled = room.brick.ultrasonic(3), []
    assert sonar.distance_mm == 400.0

    def meanwhile():
        sonar.start()
        polled.append(sonar.poll())

    room.simulation.at(room.simulation.now_ms + 4, meanwhile)
    assert sonar.distance_mm == 400.0
    assert polled == [(False, None)]
    while not polled[-1][0]:
        polled.append(sonar.poll())
        room.brick.sleep(0.01)
        assert len(polled) < 20
    assert polled[-1] == (True, 400.0)


def test_unfetched_bytes_are_not_the_next_answer(lab):
    room = lab()
    device = room.attach(4, GenericI2CDevice())
    device.write(bytes((0x10, 11, 22, 33)))
    sensor = I2CSensor(room.brick.link, 4)
    assert sensor.read(0x10, 3) == bytes((11, 22, 33))
    room.brick.request(LSWrite.transaction(InputPort.IN_4, bytes((0x02, 0x10)), 2))
    room.brick.sleep(0.1)
    fresh = I2CSensor(room.brick.link, 4)
    assert fresh.read(0x12, 1) == bytes((33,))


def test_registers_can_be_written(lab):
    room = lab()
    room.attach(4, GenericI2CDevice())
    sensor = I2CSensor(room.brick.link, 4)
    sensor.write(0x20, 1, 2, 3)
    assert sensor.read(0x20, 3) == bytes((1, 2, 3))


@pytest.mark.parametrize("value", [-1, 256, 1.5])
def test_a_value_that_is_no_byte_is_refused(lab, value):
    room = lab()
    room.attach(4, GenericI2CDevice())
    sensor = I2CSensor(room.brick.link, 4)
    with pytest.raises(LocalProtocolError, match="values"):
        sensor.write(0x20, 1, value)
    for use in (sensor.write, sensor.read):
        with pytest.raises(LocalProtocolError, match="register"):
            use(value, 1)


def test_a_sensor_that_is_not_there_is_a_bus_error_and_may_come_back(lab):
    room = lab()
    room.attach(4, None)
    sensor = I2CSensor(room.brick.link, 4)
    with pytest.raises(BrickError) as caught:
        sensor.read(0x10, 1)
    assert caught.value.status is Status.BUS_ERROR
    room.attach(4, GenericI2CDevice()).write(bytes((0x10, 7)))
    assert sensor.read(0x10, 1) == bytes((7,))


@pytest.mark.parametrize("size", [0, 16])
def test_the_firmware_loses_sixteen_bytes_so_they_are_not_asked_for(lab, size):
    with pytest.raises(LocalProtocolError, match="15"):
        I2CSensor(lab().brick, 4).read(0x10, size)
