"""A lost link is opened again while the program makes no requests: by the link's thread, or by sleeping."""

import contextlib
import logging
import math
from itertools import pairwise

import pytest

from behaviors.ports import StopReason
from firmware_protocol.direct import GetOutputState, KeepAlive, PlayTone
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickNotFound, Interrupted, LinkLost
from nxtdrive.link.core import FIRST_PAUSE_S, LONGEST_PAUSE_S, LinkCore, LinkState
from nxtdrive.motion.motor import MotorSettings
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from nxtdrive.tools.monitor import watch
from sim_backend.devices import ColorSensor, TemperatureSensor, UltrasonicSensor
from sim_backend.link import LinkFaults

FOR_EVER_MS = 10**9
THREADED = pytest.mark.parametrize("way", ["threaded"])
"""For what cannot happen where the program itself does the link's work."""


@pytest.fixture(params=["stepped", "threaded"])
def way(request):
    """Both ways of driving the link."""
    return request.param


@pytest.fixture
def away(lab):
    """Makes rooms whose cable is out from 1 s on, and that reconnect by themselves."""

    def make(until_ms):
        room = lab(faults=LinkFaults(unplugged_ms=((1000, until_ms),)))
        room.brick.link.reconnecting = True
        return room

    return make


# --- the state machine alone ---


def test_pauses_double_up_to_the_longest():
    core, now, pauses = LinkCore(), 0.0, []
    core.set_reconnecting(True, now)
    core.lose(LinkLost("gone."), now)
    for _ in range(8):
        assert not core.begin_attempt(core.attempt_due - 0.01)
        pauses.append(core.attempt_due - now)
        now = core.attempt_due
        assert core.begin_attempt(now)
        assert core.state is LinkState.REOPENING
        core.attempt_failed(BrickNotFound("not yet."), now)
        assert core.state is LinkState.LOST
    assert pauses[:4] == pytest.approx([FIRST_PAUSE_S, 2 * FIRST_PAUSE_S, 4 * FIRST_PAUSE_S, 8 * FIRST_PAUSE_S])
    assert pauses[-1] == pytest.approx(LONGEST_PAUSE_S)


def test_each_loss_begins_with_the_shortest_pause_and_no_failure():
    core, now = LinkCore(), 0.0
    core.set_reconnecting(True, now)
    for _ in range(2):
        core.lose(LinkLost("gone."), now)
        assert core.last_failure == ""
        assert core.attempt_due == now + FIRST_PAUSE_S
        for pauses in (2, 4):
            now = core.attempt_due
            assert core.begin_attempt(now)
            core.attempt_failed(BrickNotFound("not yet."), now)
            assert core.last_failure == "not yet."
            assert core.attempt_due == now + pauses * FIRST_PAUSE_S
        assert core.begin_attempt(core.attempt_due)
        core.reopened("usb://")


def test_an_attempt_that_fails_is_the_last_if_the_link_is_not_to_reconnect_any_more():
    core = LinkCore()
    core.set_reconnecting(True, 0.0)
    core.lose(LinkLost("gone."), 0.0)
    core.begin_attempt(1.0)
    core.set_reconnecting(False, 1.0)
    core.attempt_failed(BrickNotFound("not yet."), 1.0)
    assert math.isinf(core.attempt_due)


def test_only_one_thread_attempts_and_the_link_is_open_again_afterwards():
    core = LinkCore()
    core.set_reconnecting(True, 0.0)
    core.lose(LinkLost("gone."), 0.0)
    assert [core.begin_attempt(1.0), core.begin_attempt(1.0), core.begin_attempt()] == [True, False, False]
    core.reopened("usb://")
    assert (core.state, core.due) == (LinkState.OPEN, float("inf"))
    assert not core.begin_attempt(2.0), "a thread that is late leaves the link open"


def test_a_loss_is_reported_only_to_a_program_that_drove_motors():
    for driven in (False, True):
        core = LinkCore()
        core.motors_driven = driven
        core.set_reconnecting(True, 0.0)
        core.lose(LinkLost("gone."), 0.0)
        core.lose(LinkLost("gone."), 5.0)
        assert core.attempt_due == FIRST_PAUSE_S, "the second to find out changes nothing"
        assert core.interrupted is driven
        core.acknowledge()
        assert not core.interrupted


def test_without_the_wish_to_reconnect_there_is_nothing_to_attempt():
    core = LinkCore()
    core.motors_driven = True
    core.timers.repeat("awake", b"", 1.0, 0.0)
    core.lose(LinkLost("gone."), 0.0)
    assert (core.due, core.interrupted) == (float("inf"), False)
    assert not core.begin_attempt(10.0)
    assert core.begin_attempt(), "the program itself may try"


def test_motions_are_stepped_while_the_link_is_lost():
    """In their next step they end."""
    core = LinkCore()
    core.steps_due = 1.0
    core.lose(LinkLost("gone."), 0.0)
    assert core.due == 1.0
    core.set_reconnecting(True, 0.0)
    assert core.due == FIRST_PAUSE_S


def test_a_closed_link_stays_closed():
    core = LinkCore()
    core.set_reconnecting(True, 0.0)
    core.lose(LinkLost("gone."), 0.0)
    core.begin_attempt(1.0)
    core.close()
    core.attempt_failed(BrickNotFound("not yet."), 1.0)
    core.reopened("usb://")
    core.set_reconnecting(True, 2.0)
    assert not core.begin_attempt(), "not even when the program wants to"
    assert core.state is LinkState.CLOSED
    assert math.isinf(core.attempt_due)


# --- over the simulated brick ---


def test_an_idle_program_finds_the_link_open_again_and_its_sensors_set(away):
    room = away(3000)
    brick = room.brick
    touch = brick.touch(1)
    touch.set_up()
    begin = brick.now()
    brick.sleep(10)
    assert brick.now() - begin == pytest.approx(10, abs=0.0011)
    assert not brick.link.lost
    transport = brick.link.transport
    assert not touch.pressed
    assert brick.link.transport is transport, "nothing was left to do"


@pytest.mark.parametrize(
    ("make", "read"),
    [
        (lambda: ColorSensor(lambda: (200, 20, 20)), lambda brick: brick.color(2).color),
        (lambda: TemperatureSensor(lambda: 21.3125), lambda brick: brick.temperature(2).celsius),
        (lambda: UltrasonicSensor(lambda: 50), lambda brick: brick.ultrasonic(2).distance_mm),
    ],
)
@pytest.mark.parametrize("later_s", [0, 1])
def test_a_sensor_is_set_up_again_when_its_brick_was_switched_off(away, make, read, later_s):
    room = away(3000)
    room.attach(2, make())
    before = read(room.brick)

    def switch_off_and_on():
        room.simulation.brick.input.reset()
        room.simulation.brick.low_speed.reset()
        room.attach(2, make())

    room.simulation.at(2000, switch_off_and_on)
    room.brick.sleep(2)
    while room.brick.link.lost:
        room.brick.sleep(0.01)
    room.brick.sleep(later_s)
    assert [read(room.brick), read(room.brick)] == [before, before]


def test_two_runs_are_the_same(away):
    def run():
        room = away(3000)
        room.brick.sleep(2)
        seen = [room.brick.touch(1).pressed, room.brick.now()]
        room.brick.sleep(10)
        return [*seen, room.brick.ultrasonic(4).distance_mm, room.simulation.now_ms]

    assert run() == run()


def test_a_loss_is_one_warning_and_the_return_one_message(away, caplog):
    caplog.set_level(logging.INFO, "nxtdrive")
    room = away(3000)
    room.brick.sleep(2.5)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    room.brick.sleep(5)
    assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]


def test_sleep_lasts_its_full_time_also_when_the_brick_stays_away(away, caplog):
    room = away(FOR_EVER_MS)
    begin = room.brick.now()
    room.brick.sleep(100)
    assert room.brick.now() - begin == pytest.approx(100, abs=0.0011)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    with pytest.raises(
        LinkLost, match=r"did not come back within 30 s\. The last .* failed: the cable .* was unplugged"
    ):
        assert room.brick.battery_v
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    "go_on",
    [
        lambda brick: brick.request(GetOutputState(OutputPort.A)),
        lambda brick: brick.link.send(PlayTone(440, 100)),
        lambda brick: brick.motor("A").run(300),
        lambda brick: brick.sleep(5),
    ],
    ids=["question", "command", "motor", "sleep"],
)
def test_a_program_that_drove_motors_gets_one_error_and_nothing_is_driven_again_by_itself(away, go_on):
    room = away(3000)
    room.brick.motor("B").run(300)
    room.idle(6)
    with pytest.raises(Interrupted, match="is back, but"):
        go_on(room.brick)
    room.idle(1)
    assert not room.output("A").actual_speed
    assert not room.output("B").actual_speed
    room.brick.motor("B").run(300)
    go_on(room.brick)


def test_a_motion_ends_when_its_link_is_known_to_be_lost(away):
    room = away(8000)
    motion = room.brick.motor("A").run_angle(300, 3000, wait=False)
    room.idle(2)
    with pytest.raises(LinkLost):
        motion.join()
    room.idle(3)
    assert room.output("A").rotation < 1000 / 1000 * FULL_SPEED_DEG_S
    assert not room.output("A").actual_speed


def test_a_program_that_has_joined_a_lost_motion_gets_no_second_error(away):
    room = away(3000)
    with pytest.raises(LinkLost):
        room.brick.motor("A").run_angle(300, 3000)
    assert room.simulation.now_ms < 1500, "nothing waits for the brick on behalf of a motion that is over"
    room.brick.sleep(5)
    assert room.brick.battery_v


def test_what_cannot_be_sent_to_a_lost_link_fails_at_once(away):
    room = away(FOR_EVER_MS)
    room.brick.sleep(5)
    begin_ms = room.simulation.now_ms
    with pytest.raises(LinkLost, match="not back yet"):
        room.brick.link.send(PlayTone(440, 100))
    assert room.simulation.now_ms == begin_ms


def test_a_second_loss_is_noticed_too_by_an_idle_program(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000), (10_000, FOR_EVER_MS))))
    room.brick.link.reconnecting = True
    room.brick.sleep(8)
    assert room.brick.link.state is LinkState.OPEN
    room.brick.sleep(4.5)
    assert room.brick.link.lost


def test_without_reconnection_a_motion_on_a_lost_link_fails_at_once(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.simulation.advance(1500)
    with pytest.raises(LinkLost):
        room.brick.motor("A").run_angle(300, 90)
    assert room.simulation.now_ms < 2000


def test_leaving_does_not_wait_for_a_brick_that_is_away(away):
    room = away(FOR_EVER_MS)
    room.brick.link.mark_driven(OutputPort.A)
    room.idle(2)
    room.brick.close()
    assert room.simulation.now_ms < 2500
    assert room.brick.link.state is LinkState.CLOSED


def test_a_program_may_reconnect_by_itself(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    motor = room.brick.motor("A")
    motor.run(300)
    with pytest.raises(LinkLost):
        room.brick.sleep(2)
    with pytest.raises(LinkLost):
        room.brick.link.reconnect()
    room.idle(3)
    room.brick.link.reconnect()
    room.brick.sleep(1)
    assert not room.output("A").actual_speed, "what ran before is not started again"
    motor.run(300)
    room.brick.sleep(1)
    assert room.output("A").actual_speed


@pytest.mark.parametrize(
    "begin", [lambda motor: motor.run(300), lambda motor: motor.run_angle(300, 3000, wait=False)], ids=["run", "angle"]
)
def test_a_motion_does_not_outlast_a_link_that_the_program_reopens(lab, begin):
    room = lab()
    motor = room.brick.motor("A")
    begin(motor)
    room.brick.sleep(1)
    room.brick.link.reconnect()
    with pytest.raises(LinkLost, match="during the motion"):
        motor.join()
    room.brick.sleep(0.5)
    assert not room.output("A").actual_speed


def test_a_program_that_reconnects_by_itself_gets_no_error_about_the_loss_afterwards(away):
    room = away(3000)
    room.brick.link.mark_driven(OutputPort.A)
    room.brick.sleep(2.5)
    assert room.brick.link.lost
    room.simulation.advance(1000)
    room.brick.link.reconnect()
    assert room.brick.battery_v


def test_what_was_to_be_sent_over_a_lost_link_is_not_sent_over_the_next(away, mocker):
    room = away(3000)
    link = room.brick.link
    link.send_at("A", PlayTone(440, 100), 8.0)
    room.brick.sleep(5)
    assert link.state is LinkState.OPEN
    send = mocker.patch.object(link, "_send", wraps=link._send)
    room.brick.sleep(5)
    sent = [call.args[0] for call in send.call_args_list]
    assert KeepAlive().encode(want_reply=False) in sent
    assert PlayTone(440, 100).encode(want_reply=False) not in sent


# --- races between the program, its other threads and the link's own ---


def test_an_attempt_that_another_thread_makes_is_not_work_for_the_link():
    core = LinkCore()
    core.set_reconnecting(True, 0.0)
    core.lose(LinkLost("gone."), 0.0)
    assert core.begin_attempt()
    assert core.due == float("inf"), "the link's thread would spin until the attempt is over"


def test_an_attempt_of_the_program_that_fails_is_repeated_by_the_link(away):
    room = away(3000)
    room.simulation.advance(1500)
    with pytest.raises(LinkLost):
        room.brick.link.reconnect()
    room.brick.sleep(5)
    assert room.brick.link.state is LinkState.OPEN


def test_a_link_that_is_lost_while_the_program_reopens_it_is_an_error_at_once(lab, mocker):
    room = lab()
    link = room.brick.link
    link.reconnecting = True
    mocker.patch.object(type(link.transport), "send", side_effect=LinkLost("gone."))
    with pytest.raises(LinkLost, match="gone"):
        link.reconnect()
    assert room.simulation.time_s < 1


@pytest.mark.parametrize("wished", [True, False])
def test_reconnecting_may_be_chosen_after_the_loss(lab, wished):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    room.brick.link.reconnecting = not wished
    room.simulation.advance(1500)
    with contextlib.suppress(LinkLost):
        room.brick.link.reconnect_timeout_s = 0.0
        room.brick.request(KeepAlive())
    room.brick.link.reconnecting = wished
    room.brick.sleep(5)
    assert room.brick.link.state is (LinkState.OPEN if wished else LinkState.LOST)


def test_a_motion_that_meets_the_loss_in_its_first_step_does_not_keep_the_link_from_reopening(away):
    room = away(3000)
    room.simulation.advance(1500)
    with pytest.raises(Interrupted):
        room.brick.motor("A").run_angle(300, 90)
    assert room.simulation.time_s < 5.5
    room.brick.motor("A").run_angle(300, 90)
    assert room.output("A").rotation == pytest.approx(90, abs=3)


def test_cancelling_a_motion_does_not_wait_for_the_lost_link_and_the_error_comes_afterwards(away):
    room = away(8000)
    motion = room.brick.motor("A").run_angle(300, 3000, wait=False)
    room.brick.motor("B").run(300)
    room.simulation.advance(1000 - room.simulation.now_ms)
    begin = room.brick.now()
    motion.cancel()
    assert room.brick.now() - begin < 1
    with pytest.raises(Interrupted):
        room.brick.sleep(20)


@THREADED
def test_what_is_asked_while_the_link_is_being_reopened_waits_for_its_end(lab):
    room = lab(latency_ms=45, faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    link = room.brick.link
    link.reconnecting = True
    lost = link.transport
    room.brick.motor("A").run(300)
    while link.state is not LinkState.REOPENING or link.transport is lost:
        room.idle(0.01)
    with pytest.raises(Interrupted):
        room.brick.motor("B").run(300)
    room.idle(0.5)
    assert not room.output("B").rotation, "the program has to be told before it drives again"
    room.brick.motor("B").run(300)


@THREADED
def test_closing_ends_the_wait_for_a_lost_link(away):
    room = away(FOR_EVER_MS)
    brick = room.brick
    brick.sleep(2)

    def close_later():
        brick.link.transport.sleep(3)
        brick.close()

    lockstep = brick.link.transport.lockstep
    closing = lockstep.start(close_later, "program")
    with pytest.raises(LinkLost) as told:
        brick.request(KeepAlive())
    lockstep.join(closing, 5)
    assert "did not come back" not in str(told.value)
    assert room.simulation.time_s < 7


@pytest.mark.parametrize("reconnecting", [True, False])
def test_waiting_for_a_motor_without_stall_detection_ends_when_its_link_is_lost(lab, reconnecting):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    room.brick.link.reconnecting = reconnecting
    motor = room.brick.motor("A", settings=MotorSettings(stall_s=None))
    motor.run(300)
    with pytest.raises(LinkLost):
        motor.join()
    assert motor.done
    assert room.simulation.time_s < 5


@pytest.mark.parametrize("speed_deg_s", [300, 0])
def test_a_motor_without_stall_detection_is_done_when_its_link_is_lost(away, speed_deg_s):
    room = away(3000)
    motor = room.brick.motor("A", settings=MotorSettings(stall_s=None))
    motor.run(speed_deg_s)
    with pytest.raises(Interrupted):
        room.brick.sleep(6)
    assert motor.done
    with pytest.raises(LinkLost):
        motor.join()


def test_a_loss_that_a_motion_has_reported_is_not_reported_again(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    with pytest.raises(LinkLost):
        room.brick.motor("A").run_angle(300, 3000)
    room.brick.sleep(1)


def test_joining_a_lost_motion_again_does_not_hide_the_next_loss(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 2000), (8000, 9000))))
    room.brick.link.reconnecting = True
    motion = room.brick.motor("A").run_angle(300, 3000, wait=False)
    with pytest.raises(LinkLost):
        motion.join()
    room.brick.sleep(5)
    room.brick.motor("B").run(300)
    with pytest.raises(LinkLost):
        motion.join()
    with pytest.raises(Interrupted):
        room.brick.sleep(10)


def test_a_program_that_was_told_of_a_loss_in_vain_gets_no_second_error(away):
    room = away(3000)
    room.brick.link.mark_driven(OutputPort.A)
    room.brick.link.reconnect_timeout_s = 0.0
    room.brick.sleep(2)
    with pytest.raises(LinkLost, match="is not back yet"):
        assert room.brick.battery_v
    room.brick.sleep(5)
    assert room.brick.battery_v


@THREADED
def test_a_loss_that_the_links_thread_notices_is_an_error_of_the_program_alone(lab, caplog):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.brick.motor("A").run(300)
    with pytest.raises(LinkLost):
        room.brick.sleep(5)
    assert not caplog.records


@THREADED
def test_an_unexpected_error_does_not_end_the_links_thread(away, monkeypatch, caplog):
    room = away(3000)
    reopen, errors = type(room.brick.link.transport).reopen, [RuntimeError("a defect in a transport")]

    def fail_once(transport, timeout_s):
        if errors:
            raise errors.pop()
        return reopen(transport, timeout_s)

    monkeypatch.setattr(type(room.brick.link.transport), "reopen", fail_once)
    room.brick.sleep(10)
    assert not errors
    assert room.brick.link.state is LinkState.OPEN
    assert "a defect in a transport" in caplog.text


@THREADED
def test_closing_ends_the_motions_of_other_threads_too(lab):
    """One that starts while motors are being stopped would be waited for without end."""
    room = lab()
    lockstep, motor, stops = room.brick.link.transport.lockstep, room.brick.motor("A"), []

    def turn_for_ever():
        with contextlib.suppress(LinkLost):
            while True:
                stops.append(motor.run_angle(300, 3000))

    program = lockstep.start(turn_for_ever, "program")
    room.idle(1)
    room.brick.close()
    lockstep.join(program, 5)
    assert program.over
    assert set(stops) == {StopReason.CANCELLED}


def test_a_monitor_continues_when_the_brick_is_back(away):
    room = away(4000)
    room.brick.link.reconnect_timeout_s = 0.0
    losses, times = [], []
    for snapshot in watch(room.brick, {4: room.brick.ultrasonic(4)}, 0.25, on_loss=losses.append):
        times.append(snapshot.time_s)
        if snapshot.time_s > 8:
            break
    gaps = [later - earlier for earlier, later in pairwise(times)]
    assert len(losses) == 1
    assert max(gaps) == pytest.approx(3.5, abs=1.5)
    assert sorted(gaps)[-2] < 0.6
    assert snapshot.sensors[3].text == "distance: no echo", "its port is set up again"


def test_a_monitor_outlasts_a_brick_that_is_silent_for_a_while(lab):
    room = lab(faults=LinkFaults(silent_ms=((1000, 5000), (7000, 8500))))
    losses = []
    for snapshot in watch(room.brick, {}, 0.25, on_loss=losses.append):
        if snapshot.time_s > 12:
            break
    assert len(losses) == 2
