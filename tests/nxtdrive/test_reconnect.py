"""A lost link is opened again while the program makes no requests: by the link's thread, or by sleeping."""

import logging

import pytest

from firmware_protocol.direct import GetOutputState, PlayTone
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickNotFound, LinkLost
from nxtdrive.link.core import FIRST_PAUSE_S, LONGEST_PAUSE_S, Interrupted, LinkCore, LinkState
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from sim_backend.simulation import LinkFaults

FOR_EVER_MS = 10**9


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
    core.lose(LinkLost("gone."), now, reconnecting=True)
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


def test_only_one_thread_attempts_and_the_link_is_open_again_afterwards():
    core = LinkCore()
    core.lose(LinkLost("gone."), 0.0, reconnecting=True)
    assert [core.begin_attempt(1.0), core.begin_attempt(1.0)] == [True, False]
    core.reopened("usb://")
    assert (core.state, core.due) == (LinkState.OPEN, float("inf"))


def test_a_loss_is_told_only_to_a_program_that_drove_motors():
    for driven in (False, True):
        core = LinkCore()
        core.driven = driven
        core.lose(LinkLost("gone."), 0.0, reconnecting=True)
        core.lose(LinkLost("gone."), 5.0, reconnecting=True)
        assert core.attempt_due == FIRST_PAUSE_S, "the second to find out changes nothing"
        assert core.interrupted is driven
        core.acknowledge()
        assert not core.interrupted


def test_without_the_wish_to_reconnect_there_is_nothing_to_attempt():
    core = LinkCore()
    core.driven = True
    core.timers.repeat("awake", b"", 1.0, 0.0)
    core.lose(LinkLost("gone."), 0.0, reconnecting=False)
    assert (core.due, core.interrupted) == (float("inf"), False)
    assert not core.begin_attempt(10.0)
    assert core.begin_attempt(), "the program itself may try"


def test_a_closed_link_stays_closed():
    core = LinkCore()
    core.lose(LinkLost("gone."), 0.0, reconnecting=True)
    core.begin_attempt(1.0)
    core.close()
    core.attempt_failed(BrickNotFound("not yet."), 1.0)
    core.reopened("usb://")
    assert core.state is LinkState.CLOSED


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


def test_sleep_lasts_as_long_as_it_was_told_also_when_the_brick_stays_away(away, caplog):
    room = away(FOR_EVER_MS)
    begin = room.brick.now()
    room.brick.sleep(100)
    assert room.brick.now() - begin == pytest.approx(100, abs=0.0011)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    with pytest.raises(LinkLost, match="did not come back within 30 s"):
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
def test_a_program_that_drove_motors_is_told_once_and_nothing_is_driven_again_by_itself(away, go_on):
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


def test_a_program_that_has_joined_a_lost_motion_is_not_told_again(away):
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


def test_leaving_does_not_wait_for_a_brick_that_is_away(away):
    room = away(FOR_EVER_MS)
    room.brick.link.mark_driven(OutputPort.A)
    room.idle(2)
    room.brick.close()
    assert room.simulation.now_ms < 2500
    assert room.brick.link.state is LinkState.CLOSED


def test_a_program_may_reconnect_by_itself(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    room.simulation.advance(1500)
    with pytest.raises(LinkLost):
        assert room.brick.battery_v
    with pytest.raises(LinkLost):
        room.brick.link.reconnect()
    room.simulation.advance(2000)
    room.brick.link.reconnect()
    assert room.brick.battery_v
