"""The link: order of requests, round-trip times, and reconnection."""

import math
import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetInputValues, GetOutputState, KeepAlive, SetInputMode
from firmware_protocol.enums import InputPort, OutputPort, SensorMode, SensorType
from firmware_protocol.errors import LinkLost, LinkTimeout
from nxtdrive import open_brick
from nxtdrive.brick import Brick
from nxtdrive.link.link import Link
from nxtdrive.link.priority_lock import PriorityLock
from nxtdrive.link.threads import Threads
from nxtdrive.link.timers import Timers
from nxtdrive.motion.outputs import braked, coasting
from nxtdrive.transports.sim import SimTransport
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

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
            self.lock.exclusive(self.served.append, name, preempting=preempting, timeout_s=10 * PATIENCE_S)

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

    def work():
        crowd.join("poll 1", preempting=False)
        crowd.join("poll 2", preempting=False)
        crowd.join("motor", preempting=True)
        crowd.join("poll 3", preempting=False)

    lock.exclusive(work)
    crowd.disperse()
    assert crowd.served == ["motor", "poll 1", "poll 2", "poll 3"]
    assert lock.queue == []


def test_a_waiting_thread_that_was_woken_is_not_overtaken():
    lock = PriorityLock()
    crowd = Crowd(lock)
    lock.exclusive(crowd.join, "poll", False)
    lock.exclusive(crowd.served.append, "motor", timeout_s=PATIENCE_S)
    crowd.disperse()
    assert crowd.served == ["poll", "motor"]


def in_another_thread(function):
    """The result of a function that is called in a thread of its own."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(function).result(PATIENCE_S)


def is_free(lock):
    """Whether another thread can use the lock at once."""
    return in_another_thread(lambda: lock.exclusive(lambda: True, timeout_s=0)) and lock.queue == []


def test_a_lock_that_does_not_become_free_is_a_timeout_and_leaves_no_thread_in_the_queue():
    lock = PriorityLock()

    def wait():
        with pytest.raises(LinkTimeout, match="other threads"):
            lock.exclusive(lambda: None, preempting=False, timeout_s=0.01)
        return lock.queue

    assert lock.exclusive(in_another_thread, wait) == []
    assert is_free(lock)


class CtrlC(Threads):
    """Threads whose lock is interrupted as by Ctrl-C; Python raises when `acquire`, `release` or `wait` returns."""

    def __init__(self):
        self.interrupted = None

    def strike(self, where):
        if self.interrupted == where:
            self.interrupted = None
            raise KeyboardInterrupt

    def new_lock(self, *, reentrant=False):
        return InterruptedLock(self, super().new_lock(reentrant=reentrant))

    def wait(self, event, timeout_s=None):
        self.strike("wait")
        return super().wait(event, timeout_s)

    def join(self, thread, timeout_s):
        self.strike("join")
        super().join(thread, timeout_s)


class InterruptedLock:
    """A lock at which `ctrl_c` strikes."""

    def __init__(self, ctrl_c, lock):
        self.ctrl_c, self.lock = ctrl_c, lock

    def acquire(self, blocking=True):
        taken = self.lock.acquire(blocking)
        self.ctrl_c.strike("acquire")
        return taken

    def release(self):
        self.lock.release()
        self.ctrl_c.strike("release")

    def __enter__(self):
        self.acquire()

    def __exit__(self, *_):
        self.release()


@pytest.mark.parametrize("where", ["acquire", "release"])
def test_ctrl_c_while_the_lock_is_taken_or_released_leaves_it_free(where):
    threads = CtrlC()
    lock = PriorityLock(threads)
    threads.interrupted = where
    with pytest.raises(KeyboardInterrupt):
        lock.exclusive(lambda: None)
    assert is_free(lock)


def test_ctrl_c_in_the_queue_leaves_it():
    threads = CtrlC()
    lock = PriorityLock(threads)

    def wait():
        threads.interrupted = "wait"
        with pytest.raises(KeyboardInterrupt):
            lock.exclusive(lambda: None)

    lock.exclusive(in_another_thread, wait)
    assert is_free(lock)


def test_a_waiting_thread_that_was_not_woken_because_of_ctrl_c_continues():
    threads = CtrlC()
    lock = PriorityLock(threads)
    crowd = Crowd(lock)

    def work():
        crowd.join("poll", preempting=False)
        threads.interrupted = "release"

    with pytest.raises(KeyboardInterrupt):
        lock.exclusive(work)
    crowd.disperse()
    assert crowd.served == ["poll"]


@pytest.mark.parametrize("where", ["acquire", "release"])
def test_after_ctrl_c_in_a_request_other_threads_use_the_link(direct, where):
    threads = CtrlC()
    with Brick(direct, threads=threads) as brick:
        threads.interrupted = where
        with pytest.raises(KeyboardInterrupt):
            brick.request(GetBatteryLevel())
        assert in_another_thread(lambda: brick.request(GetBatteryLevel(), timeout_s=0.001)).voltage_mv


@pytest.mark.parametrize("where", ["join", "acquire", "release"])
def test_ctrl_c_while_the_link_closes_releases_the_device(direct, where):
    threads = CtrlC()
    link = Link(direct, threads=threads)
    link.wake()
    threads.interrupted = where
    with pytest.raises(KeyboardInterrupt):
        link.close()
    assert direct.closed
    link.close()


def test_a_request_without_an_end_does_not_keep_the_link_open(direct, monkeypatch):
    monkeypatch.setattr("nxtdrive.link.link.CLOSING_S", 0.01)
    link = Link(direct)
    sent, closed = threading.Event(), threading.Event()

    def hang(telegram):
        sent.set()
        closed.wait(PATIENCE_S)

    direct.on_send = hang
    request = threading.Thread(target=link.request, args=(GetBatteryLevel(),))
    request.start()
    assert sent.wait(PATIENCE_S)
    link.close()
    assert direct.closed
    closed.set()
    request.join(PATIENCE_S)


def test_ctrl_c_while_the_link_is_reopened_releases_the_device(direct):
    threads = CtrlC()
    reopened = type(direct)()

    def reopen(timeout_s):
        threads.interrupted = "acquire"
        return reopened

    direct.reopen = reopen
    link = Link(direct, threads=threads)
    with pytest.raises(KeyboardInterrupt):
        link.reconnect()
    link.close()
    assert reopened.closed


class Flapping(SimTransport):
    """A link that is lost with each request for the battery level, and can always be opened again."""

    def send(self, telegram):
        if telegram == GetBatteryLevel().encode():
            self.close()
        super().send(telegram)


def test_a_request_with_which_the_link_is_lost_each_time_ends():
    with Brick(Flapping(Simulation("open")), reconnecting=True) as brick:
        brick.link.reconnect_timeout_s = 200.0
        with pytest.raises(LinkLost, match="did not come back within 200 s"):
            brick.request(GetBatteryLevel())
        assert 200.0 <= brick.now() < 201.0


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


def test_an_input_port_that_the_brick_has_forgotten_is_set_again_when_its_sensor_is_read(returning):
    sensor = returning.brick.touch(1)
    assert not sensor.pressed
    returning.simulation.deliver(SetInputMode(InputPort.IN_1, SensorType.NONE, SensorMode.RAW).encode())
    returning.simulation.advance(1500)
    assert returning.brick.battery_v > 1
    assert not sensor.pressed
    values = returning.brick.request(GetInputValues(InputPort.IN_1))
    assert (values.type, values.mode) == (SensorType.SWITCH, SensorMode.BOOLEAN)


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


def test_a_link_that_failed_once_is_still_used_to_stop_the_motors(direct):
    def fail(telegram):
        direct.on_send = lambda _: None
        raise LinkLost("no answer.")

    with Brick(direct) as brick:
        brick.motor("A").hold()
        direct.on_send = fail
        with pytest.raises(LinkLost):
            brick.request(KeepAlive())
    assert coasting(OutputPort.A).encode(want_reply=False) in direct.sent[-2:]


def test_coming_back_is_chosen_when_the_brick_is_opened():
    with open_brick("sim://open", reconnect=True) as brick:
        assert brick.link.reconnecting


# --- timers ---


def test_a_timed_telegram_does_not_wait_for_the_reply_to_a_request(lab, mocker):
    brick = lab(faults=LinkFaults(silent_ms=((0, FOR_EVER_MS),))).brick
    link, times = brick.link, []
    brake = coasting(OutputPort.A)
    send = type(link.transport).send

    def note(transport, telegram):
        if telegram == brake.encode(want_reply=False):
            times.append(transport.now())
        send(transport, telegram)

    mocker.patch.object(type(link.transport), "send", note)
    link.use(link.transport)
    begin = brick.now()
    link.send_at("A", brake, begin + 0.3)
    with pytest.raises(LinkTimeout):
        brick.request(KeepAlive(), timeout_s=1.0)
    assert times == [pytest.approx(begin + 0.3, abs=0.005)]


@pytest.mark.parametrize("way", ["stepped"])  # the link's own thread sends it at its time
def test_a_brake_that_is_due_goes_before_the_next_request(lab, mocker):
    room = lab()
    link, brake = room.brick.link, braked(OutputPort.A)
    link.send_at("A", brake, room.brick.now() + 0.1)
    room.idle(0.2)
    send = mocker.patch.object(link, "_send", wraps=link._send)
    room.brick.request(KeepAlive())
    assert [call.args[0] for call in send.call_args_list] == [brake.encode(want_reply=False), KeepAlive().encode()]


def test_a_timer_is_due_once_in_each_interval_until_its_end():
    timers = Timers()
    timers.repeat("renew", b"r", 1.0, 0.0, until=3.0)
    assert [timers.take(now) for now in (0.9, 1.0, 1.9, 2.5, 3.0, 9.0)] == [[], [b"r"], [], [b"r"], [], []]
    assert timers.due == math.inf


def test_a_timer_that_is_noticed_after_its_end_sends_nothing():
    """A computer that slept does not renew a lease."""
    timers = Timers()
    timers.repeat("renew", b"r", 1.0, 0.0, until=3.0)
    assert not timers.punctual
    assert timers.take(3.1) == []
    assert timers.due == math.inf


def test_a_telegram_that_is_not_due_is_not_sent_with_one_that_is():
    timers = Timers()
    timers.repeat("renew", b"r", 1.0, 0.0)
    timers.once("brake", b"b", 1.5)
    assert [timers.take(now) for now in (1.0, 1.5, 2.0)] == [[b"r"], [b"b"], [b"r"]]


def test_a_telegram_at_a_set_time_is_sent_once():
    timers = Timers()
    timers.once("brake", b"b", 2.0)
    assert (timers.due, timers.punctual) == (2.0, True)
    assert [timers.take(now) for now in (1.9, 2.0, 2.1)] == [[], [b"b"], []]
    assert (timers.due, timers.punctual) == (math.inf, False)


def test_a_timer_replaces_the_one_of_its_name_and_others_stay():
    timers = Timers()
    timers.once("A", b"a", 1.0)
    timers.repeat("B", b"b", 2.0, 0.0)
    timers.once("A", b"A", 3.0)
    assert (timers.due, timers.take(3.0)) == (2.0, [b"A", b"b"])
    timers.cancel("B")
    assert timers.due == math.inf
    timers.once("A", b"a", 4.0)
    timers.clear()
    assert (timers.due, timers.punctual, timers.take(4.0)) == (math.inf, False, [])
