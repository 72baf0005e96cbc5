"""``nxtdrive motor``: what is printed, and the exit codes."""

from pathlib import Path

import pytest

from nxtdrive.brick import open_brick
from nxtdrive.cli.main import DONE, USAGE, main
from nxtdrive.testing import SimWorld
from nxtdrive.transports.trace_file import read_trace

PROGRAMS = Path(__file__).parents[2] / "golden" / "programs"

SET_OUTPUT_A = bytes([0x00, 0x04, 0])
"""How the request begins, with a reply, that sets the motor on port A."""


def test_a_motor_turns_by_an_angle(answered):
    answer = answered("motor", "turn", "a", "-90", "--nxt", "sim://")
    assert (answer["port"], answer["stop"]) == ("A", "done")
    assert answer["turned_deg"] == pytest.approx(-90, abs=3)


@pytest.mark.parametrize(("words", "turned_deg"), [(["--speed", "200"], 400), (["--power", "-50"], -780)])
def test_a_motor_turns_for_a_time(words, turned_deg, answered):
    assert answered("motor", "run", "A", *words, "--nxt", "sim://")["turned_deg"] == pytest.approx(turned_deg, rel=0.15)


def test_text_says_it_in_one_line(printed):
    assert printed("motor", "turn", "B", "180", "--nxt", "sim://").startswith("motor B done: turned 1")


@pytest.mark.parametrize(("words", "stopped"), [(["A", "c"], ["A", "C"]), ([], ["A", "B", "C"])])
def test_motors_started_by_other_programs_are_stopped(words, stopped, answered):
    assert answered("motor", "stop", *words, "--nxt", "sim://") == {"stopped": stopped}


def test_a_negative_angle_may_be_written_as_any_number(answered):
    assert answered("motor", "turn", "A", "-1e2", "--nxt", "sim://")["turned_deg"] == pytest.approx(-100, abs=2)


@pytest.mark.parametrize("words", [["turn", "B", "90"], ["run", "B", "--seconds", "0.1"], ["stop"]])
def test_a_program_that_drives_the_motors_too_is_named(words, capsys):
    with SimWorld() as world:
        with open_brick(world.address) as brick:
            brick.files.write("dance.rxe", (PROGRAMS / "dance.rxe").read_bytes())
            brick.programs.start("dance.rxe")
            main(["motor", *words, "--nxt", world.address])
        said = capsys.readouterr().err
        assert said == (
            "nxtdrive: warning: dance.rxe is running on the brick and may drive the motors too. "
            "`nxtdrive program stop` ends it.\n"
        )


def test_a_port_without_a_motor_is_refused(refused):
    assert "not a motor port" in refused("motor", "stop", "D", "--nxt", "sim://")


@pytest.mark.parametrize(("ports", "code", "braked"), [(["A", "Q"], USAGE, 0), (["A"], DONE, 1)])
def test_no_motor_is_stopped_if_a_port_is_wrong(ports, code, braked, tmp_path):
    trace = tmp_path / "stop.nxttrace"
    assert main(["motor", "stop", *ports, "--nxt", "sim://", "--trace", str(trace)]) == code
    assert sum(each.request[:3] == SET_OUTPUT_A for each in read_trace(trace).exchanges()) == braked


def test_a_list_may_continue_after_an_option(answered, refused):
    assert answered("motor", "stop", "A", "c", "--nxt", "sim://") == {"stopped": ["A", "C"]}
    assert "unrecognized arguments: --jsn C" in refused("motor", "stop", "A", "--json", "--jsn", "C")
