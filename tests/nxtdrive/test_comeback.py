"""A lost link is opened again while nobody asks anything: by a thread on real links, by sleeping in the simulator."""

import logging
import threading

import pytest

from firmware_protocol.direct import GetOutputState, PlayTone
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import BrickNotFound, LinkLost, LinkTimeout
from nxtdrive.brick import Brick
from nxtdrive.link.reconnect import FIRST_PAUSE_S, LONGEST_PAUSE_S, Interrupted, Reconnector
from nxtdrive.motion.outputs import FULL_SPEED_DEG_S
from sim_backend.simulation import LinkFaults

WITHIN_S = 20
FOR_EVER_MS = 10**9
SET_OUTPUT_STATE, SET_INPUT_MODE, IO_MAP_WRITE = 0x04, 0x05, 0x95


@pytest.fixture
def cable(direct, monkeypatch):
    """A direct link, on the wall clock, with a cable that can be pulled; `cable.end` is the driver's end of it."""
    monkeypatch.setattr("nxtdrive.link.link.PROBE_S", 0.05)

    class Cable:
        def __init__(self):
            self.plugged = self.reads = True
            self.attempts = 0
            self.missed, self.returned = threading.Event(), threading.Event()
            self.end = End()

        @property
        def sent(self):
            """What went to the brick since the link was opened."""
            return self.end.sent

        def pull(self):
            self.plugged = False
            assert self.missed.wait(WITHIN_S), "nobody has noticed"

        def plug(self):
            self.plugged = True
            assert self.returned.wait(WITHIN_S), "nobody came back"

    class End(type(direct)):
        dead = False

        def send(self, telegram):
            if self.dead or not cable.plugged:
                self.dead = True
                raise LinkLost("the cable is out.")
            if not cable.reads:
                cable.missed.set()
                raise LinkTimeout("it takes no more telegrams.")
            super().send(telegram)

        def close(self):
            self.dead = True

        def reopen(self, timeout_s):
            cable.attempts += 1
            cable.missed.set()
            if not cable.plugged:
                raise BrickNotFound("no brick there.")
            cable.returned.set()
            cable.end = End()
            return cable.end

    cable = Cable()
    return cable


def settled(brick):
    """The background thread has finished its attempt."""
    while brick.lost:
        threading.Event().wait(0.001)


def test_an_idle_program_finds_the_link_open_again_and_its_sensors_set(cable):
    with Brick(cable.end, reconnecting=True) as brick:
        touch = brick.touch(1)
        touch.set_up()
        cable.pull()
        cable.plug()
        settled(brick)
        assert [telegram for telegram in cable.sent if telegram[1] == SET_INPUT_MODE]
        attempts = cable.attempts
        assert not touch.pressed
        assert brick.battery_mv
        assert cable.attempts == attempts


def test_a_loss_is_one_warning_and_the_return_one_message(cable, caplog):
    caplog.set_level(logging.INFO, "nxtdrive")
    with Brick(cable.end, reconnecting=True) as brick:
        cable.pull()
        while cable.attempts < 3:
            threading.Event().wait(0.01)
        assert [record.levelname for record in caplog.records] == ["WARNING"]
        cable.plug()
        settled(brick)
        assert [record.levelname for record in caplog.records] == ["WARNING", "INFO"]


@pytest.mark.parametrize(
    "go_on",
    [
        lambda brick: brick.request(GetOutputState(OutputPort.A)),
        lambda brick: brick.send(PlayTone(440, 100)),
        lambda brick: brick.motor("A").run(300),
        lambda brick: brick.sleep(0.01),
    ],
    ids=["question", "command", "motor", "sleep"],
)
def test_who_drove_motors_is_told_once_and_nothing_is_driven_again_by_itself(cable, go_on):
    with Brick(cable.end, reconnecting=True) as brick:
        brick.motor("B").run(300)
        cable.pull()
        cable.plug()
        settled(brick)
        with pytest.raises(Interrupted, match="is back, but a motion was under way"):
            go_on(brick)
        assert not {SET_OUTPUT_STATE, IO_MAP_WRITE} & {telegram[1] for telegram in cable.sent}
        brick.motor("B").run(300)
        go_on(brick)


def test_a_brick_that_never_comes_back_does_not_keep_the_program_from_leaving(cable):
    with Brick(cable.end, reconnecting=True) as brick:
        brick.motor("B").run(300)
        cable.pull()
    assert not [thread for thread in threading.enumerate() if thread.name == "nxtdrive heartbeat" and thread.is_alive()]
    assert brick.lost


def test_a_link_that_takes_nothing_for_a_while_does_not_end_the_heartbeat(cable):
    with Brick(cable.end, reconnecting=True) as brick:
        cable.reads = False
        assert cable.missed.wait(WITHIN_S)
        assert not brick.lost
        cable.reads = True
        said = len(cable.sent)
        while len(cable.sent) == said:
            threading.Event().wait(0.01)


def test_without_the_wish_to_come_back_nobody_tries(cable):
    with Brick(cable.end) as brick:
        brick.keep_alive()
        cable.plugged = False
        with pytest.raises(LinkLost, match="out"):
            brick.request(GetOutputState(OutputPort.A))
        assert cable.attempts == 0


# --- the pauses ---


def test_pauses_double_up_to_the_longest():
    now, attempts = [0.0], []

    def reopen():
        attempts.append(now[0])
        raise BrickNotFound("not yet.")

    way = Reconnector(lambda: now[0], reopen)
    way.begin(LinkLost("gone."), lambda: True)
    for _ in range(8):
        way.attempt()  # not due
        now[0] = way.due
        way.attempt()
    pauses = [after - before for before, after in zip([0.0, *attempts], attempts, strict=False)]
    assert pauses[0] == pytest.approx(FIRST_PAUSE_S)
    assert pauses[1:4] == pytest.approx([2 * FIRST_PAUSE_S, 4 * FIRST_PAUSE_S, 8 * FIRST_PAUSE_S])
    assert pauses[-1] == pytest.approx(LONGEST_PAUSE_S)


def test_a_loss_that_somebody_has_mended_meanwhile_is_none():
    way = Reconnector(lambda: 0.0, lambda: None)
    way.begin(LinkLost("gone."), lambda: False)
    assert way.lost is None


# --- virtual time ---


def test_a_sleeping_program_finds_the_link_open_again_at_the_time_it_asked_for(lab):
    def run():
        room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
        brick = room.brick
        brick.reconnecting = True
        touch = brick.touch(1)
        touch.set_up()
        begin = brick.now()
        brick.sleep(10)
        assert brick.now() - begin == pytest.approx(10, abs=0.0006)
        assert not brick.lost
        transport = brick.transport
        assert not touch.pressed
        assert brick.transport is transport, "nothing was left to do"
        return room.simulation.now_ms

    assert run() == run()


def test_sleep_lasts_as_long_as_it_was_told_also_when_the_brick_stays_away(lab, caplog):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.brick.reconnecting = True
    begin = room.brick.now()
    room.brick.sleep(100)
    assert room.brick.now() - begin == pytest.approx(100, abs=0.0006)
    assert [record.levelname for record in caplog.records] == ["WARNING"]
    with pytest.raises(LinkLost, match="did not come back within 30 s"):
        assert room.brick.battery_mv
    assert len(caplog.records) == 1


def test_a_motion_ends_when_its_link_is_known_to_be_lost(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 8000),)))
    room.brick.reconnecting = True
    move = room.brick.motor("A").run_angle(300, 3000, wait=False)
    room.brick.sleep(5)
    assert move.done
    with pytest.raises(LinkLost):
        move.join()
    room.simulation.advance(1000)
    assert room.output("A").rotation < 1000 / 1000 * FULL_SPEED_DEG_S
    assert not room.output("A").actual_speed


def test_who_has_joined_a_motion_is_not_told_again(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    room.brick.reconnecting = True
    with pytest.raises(LinkLost):
        room.brick.motor("A").run_angle(300, 3000)
    assert room.simulation.now_ms < 1500, "nobody waits for the brick on behalf of a motion that is over"
    room.brick.sleep(5)
    assert room.brick.battery_mv


def test_a_motion_that_meets_the_loss_first_leaves_it_to_the_program_to_hear_of_it(cable, monkeypatch):
    monkeypatch.setattr("nxtdrive.link.link.PULSE_S", 1e9)
    with Brick(cable.end, reconnecting=True) as brick:
        brick.motor("B").run(300)
        cable.plugged = False
        while not brick.lost:
            threading.Event().wait(0.001)
        cable.plugged = True
        with pytest.raises(Interrupted):
            brick.request(GetOutputState(OutputPort.A))
        assert brick.battery_mv


def test_what_cannot_be_told_to_a_lost_link_fails_at_once(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.brick.reconnecting = True
    room.brick.sleep(5)
    begin_ms = room.simulation.now_ms
    with pytest.raises(LinkLost, match="not back yet"):
        room.brick.send(PlayTone(440, 100))
    assert room.simulation.now_ms == begin_ms


def test_leaving_does_not_wait_for_a_brick_that_is_away(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.brick.reconnecting = True
    room.brick.moves(OutputPort.A)
    room.simulation.advance(2000)
    room.brick.close()
    assert room.simulation.now_ms < 2500
