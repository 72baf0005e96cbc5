"""What the monitor recognises by itself, and the CSV files of ``monitor`` and ``sensor watch``."""

import csv
import io
import math
import os
import subprocess
import sys
import threading

import pytest

from firmware_protocol.direct import GetInputValues
from firmware_protocol.enums import InputPort, SensorType
from nxtdrive.cli.commands.monitor import _plots
from nxtdrive.cli.main import DONE, NO_BRICK, main
from nxtdrive.cli.safe_console import SafeConsole
from nxtdrive.tools.monitor import HISTORY_S, TYPES, History, MotorState, SensorState, Snapshot, identify_sensors, look
from sim_backend.devices import GenericI2CDevice, TemperatureSensor, UltrasonicSensor

FAST = ("--nxt", "sim://?pace=fast")
PORTS = (1, 2, 3, 4)


def _types(brick):
    return [brick.request(GetInputValues(InputPort(port))).type for port in range(4)]


def test_an_ultrasonic_sensor_needs_no_name(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 34))
    found = identify_sensors(room.brick, PORTS)
    assert sorted(found) == [4]
    row = look(room.brick, {}, found).sensors[3]
    assert (row.name, row.value, row.text) == ("ultrasonic sensor", 340.0, "distance: 340 mm")


def test_a_port_without_a_digital_sensor_stays_as_it_was(lab):
    room = lab()
    room.attach(4, None)
    room.brick.touch(1).set_up()
    before = _types(room.brick)
    assert before[0] is SensorType.SWITCH
    assert identify_sensors(room.brick, PORTS) == {}
    assert _types(room.brick) == before
    row = look(room.brick, {}).sensors[0]
    assert (row.name, row.text) == ("touch sensor", "no")


def test_digital_sensors_say_what_they_are_as_far_as_they_can(lab):
    room = lab()
    room.attach(2, TemperatureSensor(lambda: 21.5))
    room.attach(3, GenericI2CDevice())
    rows = look(room.brick, {}, identify_sensors(room.brick, PORTS)).sensors
    assert (rows[1].name, rows[1].text) == ("temperature sensor", "temperature: 21.5 °C")
    assert rows[2].name.endswith("(digital)")
    assert (rows[0].name, rows[0].analog) == ("not set up", False)


def test_a_sensor_that_was_pulled_out_leaves_its_row(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 34))
    found = identify_sensors(room.brick, PORTS)
    room.attach(4, None)
    assert "plugged in?" in look(room.brick, {}, found).sensors[3].text


def test_an_echo_that_is_missing_is_reported_in_words(lab):
    room = lab()
    room.attach(4, UltrasonicSensor(lambda: None))
    assert look(room.brick, {}, identify_sensors(room.brick, PORTS)).sensors[3].text == "distance: no echo"


def test_every_type_of_the_firmware_has_plain_words():
    assert set(TYPES) == set(SensorType)
    assert not [name for name in TYPES.values() if "low speed" in name]


def _rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_watched_values_are_kept_as_rows_with_their_units(capsys, tmp_path):
    table = tmp_path / "distances.csv"
    assert main(["sensor", "watch", "4", "--every", "0.5", "--count", "3", "--csv", str(table), *FAST]) == DONE
    rows = _rows(table)
    assert list(rows[0]) == ["time_s", "distance_mm"]
    assert [float(row["time_s"]) for row in rows] == pytest.approx([0, 0.5, 1], abs=0.01)
    assert all(float(row["distance_mm"]) > 0 for row in rows)
    assert capsys.readouterr().out.count("distance") == 3


def test_yes_and_no_are_numbers_in_a_table(capsys, tmp_path):
    table = tmp_path / "touch.csv"
    assert main(["sensor", "watch", "1", "touch", "--count", "2", "--csv", str(table), *FAST]) == DONE
    assert [row["pressed"] for row in _rows(table)] == ["0", "0"]


def test_a_snapshot_is_a_row_with_a_column_for_each_sensor(capsys, tmp_path):
    table = tmp_path / "robot.csv"
    assert main(["monitor", "--once", "--sensor", "1=touch", "--csv", str(table), *FAST]) == DONE
    (row,) = _rows(table)
    assert {"time_s", "battery_mv", "A_angle_deg", "port1_pressed", "port2_raw", "port4_distance_mm"} <= set(row)
    assert "ultrasonic sensor" in capsys.readouterr().out


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no /dev/full here")
@pytest.mark.parametrize("words", [["sensor", "watch", "4", "--count", "3"], ["monitor", "--once"]])
def test_a_full_disk_is_a_sentence(words, refused):
    said = refused(*words, "--csv", "/dev/full", *FAST)
    assert "/dev/full cannot be written (No space left on device)" in said
    assert "Traceback" not in said


def test_a_table_in_a_missing_folder_is_refused_before_the_brick_is_opened(refused, tmp_path):
    path = tmp_path / "nowhere" / "x.csv"
    assert "nowhere" in refused("sensor", "watch", "4", "--csv", path, "--nxt", "tcp://127.0.0.1:1")


@pytest.mark.parametrize("words", [["sensor", "watch", "4"], ["monitor"]])
def test_the_table_of_an_earlier_run_is_kept_until_there_is_a_reading(words, tmp_path):
    table = tmp_path / "earlier.csv"
    table.write_text("time_s,distance_mm\n0.0,310\n", encoding="utf-8")
    assert main([*words, "--csv", str(table), "--nxt", "tcp://127.0.0.1:1"]) == NO_BRICK
    assert table.read_text(encoding="utf-8") == "time_s,distance_mm\n0.0,310\n"


def test_the_table_of_an_earlier_run_is_replaced(tmp_path):
    table = tmp_path / "earlier.csv"
    table.write_text("something longer than a single reading\n" * 99, encoding="utf-8")
    assert main(["sensor", "watch", "1", "touch", "--count", "1", "--csv", str(table), *FAST]) == DONE
    assert len(table.read_text(encoding="utf-8").splitlines()) == 2


def _snapshot(time_s, angle_deg=0, value=None, raw=500, kind="switch"):
    motors = tuple(MotorState(port, 60, "running", angle_deg if port == "A" else 0) for port in "ABC")
    sensors = tuple(
        SensorState(port, kind, "temperature sensor (RCX)", raw, value, "temperature: 21.5 °C") for port in PORTS
    )
    return Snapshot(time_s, 7900, 2.0, motors, sensors)


def test_a_plot_spans_the_last_minute_between_its_lowest_and_highest_reading():
    history = History()
    for tenth in range(int(HISTORY_S * 20)):
        history.add(_snapshot(tenth / 10, angle_deg=tenth))
    plot = history.plot("A", 6)
    assert (plot.lowest, plot.highest) == (600, 1199)
    assert plot.heights == pytest.approx([(99.5 * part + 49.5) / 599 for part in range(6)], abs=0.02)


def test_a_plot_begins_at_the_right_and_has_gaps():
    history = History()
    for time_s, value in ((0.0, 100), (1.0, 100), (15.0, None), (30.0, 300), (31.0, 200)):
        history.add(_snapshot(time_s, value=value, kind="low speed 9v"))
    assert history.plot("4", 4).heights == [None, 0.0, None, 0.75]
    history.add(_snapshot(90.5, value=None, kind="low speed 9v"))
    assert history.plot("4", 4).heights == [0.0, None, None, None]
    history.add(_snapshot(91.5, value=None, kind="low speed 9v"))
    assert history.plot("4", 4) is None


@pytest.mark.parametrize(
    ("value", "kind", "plotted"),
    [(21.5, "low speed 9v", 21.5), (True, "switch", 1.0), (None, "switch", 500.0), ("red", "color full", None)],
)
def test_what_is_plotted_is_the_measurement_or_the_converter_value(value, kind, plotted):
    history = History()
    history.add(_snapshot(0.0, value=value, kind=kind))
    plot = history.plot("2", 8)
    assert (plot.highest if plot else None) == plotted


@pytest.mark.parametrize("width", [20, 40, 80, 200])
@pytest.mark.parametrize("encoding", ["utf-8", "ascii"])
def test_the_screen_fits_a_narrow_terminal(width, encoding):
    history = History()
    for tenth in range(600):
        history.add(snapshot := _snapshot(tenth / 10, round(360 * math.sin(tenth / 60)), value=tenth % 90 > 45))
    screen = io.TextIOWrapper(io.BytesIO(), encoding=encoding, errors="replace")
    console = SafeConsole(file=screen, width=width, height=20, force_terminal=True, color_system=None)
    console.print(_plots(snapshot, history, console))
    screen.seek(0)
    lines = screen.read().splitlines()
    assert max(map(len, lines)) <= width
    assert len(lines) <= 20
    if width >= 40:
        assert lines[0].split()[:2] == ["A", "running,"]
        assert lines[1].rstrip().endswith(" -360 to 360")
        assert lines[7].strip().endswith(" 0 to 1")
        assert {*"▁█"} <= {*lines[1]} or {*"_#"} <= {*lines[1]}


@pytest.mark.parametrize(
    ("word", "text"),
    [("9=touch", "--sensor 9=touch has no port '9': ports are 1 to 4."), ("4", "--sensor 4 is not PORT=KIND.")],
)
def test_a_port_that_does_not_exist_is_reported(word, text, refused):
    assert text in refused("monitor", "--once", "--sensor", word, *FAST)


@pytest.mark.slow
def test_a_program_that_reads_the_output_gets_each_snapshot_at_once():
    command = [sys.executable, "-m", "nxtdrive", "monitor", "--nxt", "sim://?pace=fast", "--every", "1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8") as monitor:
        watchdog = threading.Timer(60, monitor.kill)
        watchdog.start()
        seen = sum("battery" in next(monitor.stdout, "") for _ in range(60))
        monitor.stdout.close()  # as `head` does
        assert monitor.stderr.read() == ""
        watchdog.cancel()
    assert seen > 2
