"""The link: order of requests, round-trip times, and reconnection."""

import threading

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetInputValues, GetOutputState, KeepAlive, SetInputMode
from firmware_protocol.enums import InputPort, OutputPort, SensorMode, SensorType
from firmware_protocol.errors import LinkLost, LinkTimeout
from nxtdrive import open_brick
from nxtdrive.brick import Brick
from nxtdrive.link.priority_lock import PriorityLock
from nxtdrive.motion.outputs import coasting
from sim_backend.simulation import LinkFaults

PATIENCE_S = 10
FOR_EVER_MS = 10**9


@pytest.fixture(params=["stepped", "threaded"])
def way(request):
    """Both ways of driving the link."""
    return request.param


class Crowd:
    """Threads that queue up for a lock while the test holds it."""

    def __init__(self, lock):
        self.lock = lock
        self.served = []
        self.threads = []

    def join(self, name, preempting):
        def use():
            self.lock.acquire(preempting=preempting, timeout_s=PATIENCE_S)
            self.served.append(name)
            self.lock.release()

        waiting = len(self.lock.queue)
        self.threads.append(threading.Thread(target=use))
        self.threads[-1].start()
        while len(self.lock.queue) == waiting:
            threading.Event().wait(0.001)

    def disperse(self):
        for thread in self.threads:
            thread.join(PATIENCE_S)


def test_threads_are_served_in_order_and_preempting_ones_first():
    lock = PriorityLock()
    crowd = Crowd(lock)
    with lock.exclusive():
        crowd.join("poll 1", preempting=False)
        crowd.join("poll 2", preempting=False)
        crowd.join("motor", preempting=True)
        crowd.join("poll 3", preempting=False)
    crowd.disperse()
    assert crowd.served == ["motor", "poll 1", "poll 2", "poll 3"]
    with lock.exclusive():
        assert lock.queue == []


def test_a_lock_that_does_not_become_free_is_a_timeout_and_leaves_no_thread_in_the_queue():
    lock = PriorityLock()
    with lock.exclusive():
        with pytest.raises(LinkTimeout, match="other threads"):
            lock.acquire(preempting=False, timeout_s=0.01)
        assert lock.queue == []
    with lock.exclusive():
        assert lock.queue == []


def test_a_motor_command_overtakes_polls_that_wait(direct):
    """It goes out as soon as the question that is being answered has been."""
    answered, asked = threading.Event(), threading.Event()

    def hold_first(telegram):
        if len(direct.sent) == 1:
            asked.set()
            answered.wait(PATIENCE_S)

    direct.on_send = hold_first
    with Brick(direct) as brick:
        polls = [threading.Thread(target=brick.request, args=(GetOutputState(OutputPort.A),)) for _ in range(4)]
        polls[0].start()
        assert asked.wait(PATIENCE_S)
        for poll in polls[1:]:
            poll.start()
        motor = threading.Thread(target=brick.request, args=(coasting(OutputPort.B),))
        motor.start()
        while len(brick.link._lock.queue) < 4:
            threading.Event().wait(0.001)
        answered.set()
        for thread in (*polls, motor):
            thread.join(PATIENCE_S)
        assert [telegram[1] for telegram in direct.sent] == [0x06, 0x04, 0x06, 0x06, 0x06]


def test_a_thread_that_polls_without_a_pause_starves_no_other(direct):
    done = threading.Event()
    with Brick(direct) as brick:

        def poll():
            while not done.is_set():
                brick.request(GetOutputState(OutputPort.A))

        greedy = threading.Thread(target=poll)
        greedy.start()
        for _ in range(200):
            assert brick.request(GetBatteryLevel(), timeout_s=PATIENCE_S).voltage_mv
        done.set()
        greedy.join(PATIENCE_S)


@pytest.mark.parametrize("latency_ms", [2, 45])
def test_the_latency_is_that_of_the_link(lab, latency_ms):
    brick = lab(latency_ms=latency_ms).brick
    for _ in range(20):
        brick.request(KeepAlive())
        brick.sleep(0.1)
    assert brick.link.latency_s == pytest.approx(latency_ms / 1000, abs=0.0011)


def test_one_slow_answer_is_not_the_latency(lab):
    brick = lab(latency_ms=2, faults=LinkFaults(delay_replies_ms={3: 500})).brick
    for _ in range(6):
        brick.request(KeepAlive())
        brick.sleep(0.1)
    assert brick.link.latency_s < 0.004


@pytest.fixture
def returning(lab):
    """A brick whose cable is out from 1 s to 3 s, and that comes back by itself."""
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 3000),)))
    room.brick.link.reconnecting = True
    return room


def test_a_question_outlives_the_loss_of_the_link(returning):
    returning.simulation.advance(1500)
    assert returning.brick.battery_v > 1
    assert 3.0 <= returning.simulation.time_s < 5.5, "pauses between attempts grow, to two seconds at most"


def test_input_ports_are_set_again_if_the_brick_has_forgotten(returning):
    sensor = returning.brick.touch(1)
    assert not sensor.pressed
    returning.simulation.deliver(SetInputMode(InputPort.IN_1, SensorType.NONE, SensorMode.RAW).encode())
    returning.simulation.advance(1500)
    assert returning.brick.battery_v > 1
    values = returning.brick.request(GetInputValues(InputPort.IN_1))
    assert (values.type, values.mode) == (SensorType.SWITCH, SensorMode.BOOLEAN)


def test_motion_is_not_resumed_and_the_program_is_told(returning):
    motor = returning.brick.motor("A")
    motor.run(300)
    with pytest.raises(LinkLost, match="is back"):
        returning.brick.sleep(5)
    returning.simulation.advance(2000)
    assert not returning.output("A").actual_speed
    assert returning.brick.battery_v > 1, "the link is there"
    motor.run(300)
    returning.brick.sleep(1)
    assert returning.output("A").actual_speed


def test_a_question_after_driving_is_not_answered_as_if_nothing_had_happened(returning):
    returning.brick.link.mark_driven(OutputPort.A)
    returning.simulation.advance(1500)
    with pytest.raises(LinkLost, match="was not repeated"):
        returning.brick.request(GetOutputState(OutputPort.A))
    assert returning.brick.request(GetOutputState(OutputPort.A)).power == 0


def test_a_command_is_not_given_twice(returning):
    returning.simulation.advance(1500)
    with pytest.raises(LinkLost, match="PlayTone was not repeated"):
        returning.brick.tone(440, 100)
    returning.brick.tone(440, 100)


def test_a_brick_that_stays_away_is_given_up(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, FOR_EVER_MS),)))
    room.brick.link.reconnecting = True
    room.simulation.advance(1500)
    with pytest.raises(LinkLost, match="did not come back"):
        room.brick.request(KeepAlive())
    assert 30 <= room.simulation.time_s <= 36


def test_by_default_a_loss_is_an_error(lab):
    room = lab(faults=LinkFaults(unplugged_ms=((1000, 1100),)))
    room.simulation.advance(1500)
    with pytest.raises(LinkLost):
        room.brick.request(KeepAlive())


def test_coming_back_is_chosen_when_the_brick_is_opened():
    with open_brick("sim://open", reconnect=True) as brick:
        assert brick.link.reconnecting
