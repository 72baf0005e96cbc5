"""Starting and stopping programs; the programs themselves are those of the golden records."""

import json
from pathlib import Path

import pytest

from firmware_protocol.direct import GetInputValues, MessageRead, MessageWrite, StartProgram, StopProgram
from firmware_protocol.enums import InputPort, SensorType
from firmware_protocol.errors import BrickBusy, BrickError, LocalProtocolError, MailboxEmpty
from firmware_protocol.status import Status
from nxtdrive.brick import Brick, open_brick
from nxtdrive.cli.main import DONE, main
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.simulation import Simulation

GOLDEN = Path(__file__).parents[1] / "golden" / "firmware.jsonl"


def _content(name):
    """The bytes of a program that the golden records write to the brick."""
    content, writing = b"", False
    for line in GOLDEN.read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        if record["scenario"] != "program_lifecycle" or "request" not in record:
            continue
        request = bytes.fromhex(record["request"])
        if request[:2] == b"\x01\x81":
            writing = request[2:22].rstrip(b"\0").decode() == name
        elif request[:2] == b"\x01\x83" and writing:
            content += request[3:]
    return content


@pytest.fixture
def room(lab):
    """A brick with a program that runs forever, one that ends at once and one that cannot run."""
    made = lab()
    for name in ("loop.rxe", "end.rxe", "bad.rxe"):
        made.brick.files.write(name, _content(name))
    return made


def test_a_program_runs_until_it_is_stopped(room):
    assert room.brick.programs.running is None
    room.brick.programs.start("loop.rxe")
    assert room.brick.programs.running == "loop.rxe"
    assert room.brick.programs.stop()
    assert room.brick.programs.running is None


def test_a_start_right_after_an_end_is_not_lost(room):
    """The firmware says OK and does nothing for 750 ms after a program has ended."""
    for _ in range(3):
        room.brick.programs.start("loop.rxe")
        assert room.brick.programs.running == "loop.rxe"
        room.brick.programs.stop()


def test_a_start_that_the_firmware_would_lose_is_an_error(room, monkeypatch):
    monkeypatch.setattr("nxtdrive.onboard.programs.BUSY_S", 0.1)
    room.brick.programs.start("loop.rxe")
    room.brick.programs.stop()
    with pytest.raises(BrickBusy, match="user interface is busy"):
        room.brick.programs.start("loop.rxe")


def test_a_very_short_program_counts_as_started(room):
    room.brick.programs.start("end.rxe")
    room.brick.sleep(0.1)
    assert room.brick.programs.running is None


def test_a_file_that_is_not_a_good_program_is_an_error(room):
    with pytest.raises(BrickBusy, match=r"cannot run bad\.rxe"):
        room.brick.programs.start("bad.rxe")


def test_a_start_that_says_ok_and_does_nothing_is_an_error(room):
    deliver = room.simulation.deliver
    room.simulation.deliver = lambda telegram: (
        b"\x02\0\0" if telegram[:2] == StartProgram("x").encode()[:2] else deliver(telegram)
    )
    begun_s = room.brick.now()
    with pytest.raises(BrickBusy, match=r"loop\.rxe did not start"):
        room.brick.programs.start("loop.rxe")
    assert room.brick.now() - begun_s < 5.0


def test_what_the_brick_refuses_to_say_is_not_that_no_program_runs(room):
    room.simulation.deliver = lambda telegram: bytes((2, telegram[1], Status.BAD_ARGUMENTS)) + bytes(20)
    with pytest.raises(BrickError) as caught:
        _ = room.brick.programs.running
    assert caught.value.status is Status.BAD_ARGUMENTS


@pytest.mark.parametrize("after_ms", [200, None])
def test_a_stop_returns_when_the_program_has_ended_and_not_before(room, after_ms):
    room.brick.programs.start("loop.rxe")
    simulation, deliver = room.simulation, room.simulation.deliver

    def slowly(telegram):
        if telegram != StopProgram().encode():
            return deliver(telegram)
        if after_ms is not None:
            simulation.at(simulation.now_ms + after_ms, lambda: deliver(telegram))
        return b"\x02\x01\0"

    simulation.deliver = slowly
    begun_s = room.brick.now()
    if after_ms is None:
        with pytest.raises(BrickBusy, match="does not stop"):
            room.brick.programs.stop()
        assert room.brick.now() - begun_s < 1.0
    else:
        assert room.brick.programs.stop()
        assert room.brick.now() - begun_s == pytest.approx(after_ms / 1000, abs=0.05)
        assert room.brick.programs.running is None


@pytest.mark.parametrize("box", [1, 4, 10])
def test_messages_go_to_their_mailbox_of_the_program_and_come_from_its_own(room, box):
    programs = room.brick.programs
    programs.start("loop.rxe")
    programs.write_message(box, "to the program")
    arrived = room.brick.request(MessageRead(box - 1, 0, True)).text
    assert arrived == "to the program"
    room.brick.request(MessageWrite.text(10 + box - 1, "from the program"))
    assert programs.read_message(box, remove=False) == "from the program"
    assert programs.read_message(box) == "from the program"
    with pytest.raises(MailboxEmpty):
        programs.read_message(box)


def test_a_second_program_is_refused(room):
    room.brick.programs.start("loop.rxe")
    with pytest.raises(BrickBusy, match=r"loop\.rxe is running"):
        room.brick.programs.start("end.rxe")


@pytest.mark.parametrize("name", ["notes.txt", "hello.rso", "settings.sys", "program", "x.rxe.bak"])
def test_what_would_wedge_the_brick_is_not_started(direct, name):
    with Brick(direct) as brick, pytest.raises(LocalProtocolError, match="hang"):
        brick.programs.start(name)
    assert direct.sent == []


def test_a_missing_program_is_named_as_such(direct):
    """The firmware would answer "out of range"."""
    with Brick(direct) as brick, pytest.raises(BrickError) as caught:
        brick.programs.start("nothing.rxe")
    assert caught.value.status is Status.FILE_NOT_FOUND
    assert all(telegram[:2] != StartProgram("x").encode()[:2] for telegram in direct.sent)


def test_stopping_twice_sends_one_stop_and_the_next_program_lives(room):
    """A second stop right behind the first would end the next program at its start."""
    room.brick.programs.start("loop.rxe")
    assert room.brick.programs.stop()
    assert not room.brick.programs.stop()
    room.brick.programs.start("loop.rxe")
    room.brick.sleep(1)
    assert room.brick.programs.running == "loop.rxe"


def test_without_a_program_no_stop_is_sent(direct):
    with Brick(direct) as brick:
        assert not brick.programs.stop()
    assert StopProgram().encode() not in direct.sent


def test_our_motors_are_at_rest_before_a_program_resets_them(room):
    room.brick.motor("A").run(500)
    room.brick.sleep(0.5)
    room.brick.programs.start("loop.rxe")
    room.brick.sleep(2)
    assert not room.output("A").actual_speed, "no lease is renewed under the program"


def test_sensors_are_set_up_again_after_a_program(room):
    sensor = room.brick.touch(1)
    assert not sensor.pressed
    room.brick.programs.start("loop.rxe")
    assert room.brick.request(GetInputValues(InputPort.IN_1)).type is SensorType.NONE
    room.brick.programs.stop()
    assert not sensor.pressed
    assert room.brick.request(GetInputValues(InputPort.IN_1)).type is SensorType.SWITCH


def test_the_monitor_leaves_the_sensors_of_a_running_program_alone(room):
    from nxtdrive.tools.monitor import identify_sensors, look
    from sim_backend.devices import UltrasonicSensor

    brick, sonar = room.brick, room.attach(4, UltrasonicSensor(lambda: 40))
    found = identify_sensors(brick, {1, 2, 3, 4})
    assert look(brick, {}, found).sensors[3].value == 400
    brick.programs.start("loop.rxe")
    assert identify_sensors(brick, {1, 2, 3, 4}) == {}
    before = vars(sonar).copy()
    row = look(brick, {}, found).sensors[3]
    assert (row.name, row.value) == ("not set up", None)
    assert vars(sonar) == before
    assert brick.request(GetInputValues(InputPort.IN_4)).type is SensorType.NONE


@pytest.fixture
def busy():
    """The address of a brick on which a program runs."""
    simulation = Simulation("open")
    with shared("busy", lambda: SimTransport(simulation)) as address:
        with open_brick(address) as brick:
            brick.files.write("loop.rxe", _content("loop.rxe"))
            brick.programs.start("loop.rxe")
        yield address


@pytest.mark.parametrize("action", [("read", "1", "touch"), ("identify",), ("registers", "4", "0x10")])
def test_a_command_that_sets_up_ports_says_that_a_program_is_running(busy, action, capsys):
    assert main(["sensor", *action, "--nxt", busy]) == DONE
    assert "loop.rxe is running" in capsys.readouterr().err
    assert main(["program", "stop", "--nxt", busy]) == DONE
    assert main(["sensor", *action, "--nxt", busy]) == DONE
    assert capsys.readouterr().err == ""


def test_the_doctor_leaves_motors_and_ports_of_a_running_program_alone(busy, capsys):
    assert main(["doctor", "--nxt", busy, "--wiggle", "--yes"]) == DONE
    printed = capsys.readouterr().out
    assert "loop.rxe is running" in printed
    assert "motor B" not in printed
    with open_brick(busy) as brick:
        assert brick.request(GetInputValues(InputPort.IN_4)).type is SensorType.NONE
