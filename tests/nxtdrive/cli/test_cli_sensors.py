"""``sensor``, ``monitor``, ``tone`` and ``message`` on the simulated brick of the bundled world."""

import json

import pytest

from nxtdrive.cli.main import DONE, LINK_LOST, REFUSED, USAGE, main

FAST = ("--nxt", "sim://?pace=fast")


def _run(capsys, *words):
    code = main(list(words))
    captured = capsys.readouterr()
    return code, captured.out, captured.err


def test_a_distance_is_read_with_its_unit(capsys):
    code, out, _ = _run(capsys, "sensor", "read", "4", "ultrasonic")
    assert code == DONE
    assert out.startswith("distance  ")
    assert out.rstrip().endswith(" mm")


def test_a_digital_sensor_need_not_be_named(capsys):
    code, out, _ = _run(capsys, "sensor", "read", "4", "--json")
    reading = json.loads(out)
    assert code == DONE
    assert (reading["quantity"], reading["unit"]) == ("distance", "mm")
    assert reading["value"] > 0


def test_an_analog_sensor_must_be_named(capsys):
    code, _, err = _run(capsys, "sensor", "read", "1")
    assert code == USAGE
    assert "touch" in err


@pytest.mark.parametrize("action", [("read",), ("watch", "--count", "1")])
@pytest.mark.parametrize("kind", ["compass", "temperature", "touch", "color"])
def test_another_kind_than_the_one_plugged_in_is_refused_by_its_name(capsys, kind, action):
    code, out, err = _run(capsys, "sensor", *action, "4", kind)
    assert (code, out) == (USAGE, "")
    assert f"has a sensor of the kind ultrasonic (LEGO Sonar), not {kind}" in err


def test_an_empty_port_has_no_temperature(capsys):
    code, out, err = _run(capsys, "sensor", "read", "3", "rcx-temperature")
    assert (code, out) == (LINK_LOST, "")
    assert "Plug in" in err


def test_an_unknown_kind_lists_the_known_ones(capsys):
    code, _, err = _run(capsys, "sensor", "read", "1", "nose")
    assert code == USAGE
    assert "ultrasonic" in err


def test_watching_prints_as_many_values_as_asked_for_at_the_pace_asked_for(capsys):
    code, out, _ = _run(capsys, "sensor", "watch", "1", "touch", "--every", "0.1", "--count", "5", "--json")
    readings = [json.loads(line) for line in out.splitlines()]
    assert code == DONE
    assert [reading["value"] for reading in readings] == [False] * 5
    assert readings[-1]["time_s"] - readings[0]["time_s"] == pytest.approx(0.4, abs=0.01)


def test_every_port_lists_its_device(capsys):
    _, out, _ = _run(capsys, "sensor", "identify", "--json")
    found = json.loads(out)
    assert found["4"]["product"] == "Sonar"
    assert found["2"] is None
    _, out, _ = _run(capsys, "sensor", "identify")
    assert "4  LEGO Sonar" in out
    assert "2  nothing digital" in out


def test_registers_are_shown_as_bytes_and_text(capsys):
    code, out, _ = _run(capsys, "sensor", "registers", "4", "0x10", "5")
    assert code == DONE
    assert out.split() == ["0x10", "53", "6f", "6e", "61", "72", "Sonar"]


def test_a_register_without_a_sensor_is_refused_by_the_brick(capsys):
    code, _, err = _run(capsys, "sensor", "registers", "2", "0x10", "5")
    assert code == REFUSED
    assert "Traceback" not in err


def test_a_snapshot_of_the_whole_brick(capsys):
    code, out, _ = _run(capsys, "monitor", "--once", "--json", "--sensor", "4=ultrasonic", *FAST)
    snapshot = json.loads(out)
    assert code == DONE
    assert [motor["port"] for motor in snapshot["motors"]] == ["A", "B", "C"]
    assert {motor["state"] for motor in snapshot["motors"]} == {"off"}
    assert snapshot["battery_mv"] > 5000
    assert snapshot["latency_ms"] == pytest.approx(2, abs=1)
    sonar = snapshot["sensors"][3]
    assert sonar["type"] == "low speed 9v"
    assert sonar["name"] == "ultrasonic sensor"
    assert sonar["text"] == f"distance: {sonar['value']:g} mm"


def test_the_monitor_is_a_table(capsys):
    code, out, _ = _run(capsys, "monitor", "--once", *FAST)
    assert code == DONE
    assert "motor, off" in out
    assert "battery" in out


@pytest.mark.parametrize("word", ["4", "5=touch", "x=touch"])
def test_the_monitor_says_how_sensors_are_named(word, capsys):
    code, _, err = _run(capsys, "monitor", "--once", "--sensor", word, *FAST)
    assert code == USAGE
    assert "4=ultrasonic" in err


def test_a_sensor_that_does_not_answer_leaves_its_row_without_a_value(lab):
    from nxtdrive.tools.monitor import look
    from sim_backend.devices import UltrasonicSensor

    room = lab()
    room.attach(4, UltrasonicSensor(lambda: 40))
    sonar = room.brick.ultrasonic(4)
    assert look(room.brick, {4: sonar}).sensors[3].value == 400.0
    room.attach(4, None)
    row = look(room.brick, {4: sonar}).sensors[3]
    assert row.value is None
    assert row.text


def test_a_running_motor_is_seen_running(lab):
    from nxtdrive.tools.monitor import look

    brick = lab().brick
    brick.motor("A").dc(50)
    brick.sleep(0.2)
    state = look(brick, {}).motors[0]
    assert (state.power, state.state) == (50, "running")
    assert state.angle_deg > 0


def test_a_tone_is_played_to_its_end(capsys):
    assert _run(capsys, "tone", "440", "100")[0] == DONE


def test_without_a_program_there_are_no_mailboxes(capsys):
    for words in (("message", "write", "1", "hello"), ("message", "read", "1")):
        code, _, err = _run(capsys, *words)
        assert code == REFUSED
        assert "program" in err
