"""Links to the simulated brick: latency, order and faults."""

import pytest

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from firmware_protocol.status import Status
from firmware_protocol.system import IOMapRead, OpenWrite
from sim_backend.link import LinkFaults, SimLink
from sim_backend.simulation import Simulation

BATTERY = GetBatteryLevel().encode()
OPEN = OpenWrite("notes.txt", 10).encode()
RUN_B = SetOutputState(OutputPort.B, 80, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0).encode()


@pytest.fixture
def simulation():
    return Simulation("open")


def port_of(reply):
    return reply[3]


def ask_state(link, *ports):
    for port in ports:
        link.send(GetOutputState(OutputPort[port]).encode())


def replies_within(link, timeout_ms):
    replies = []
    while (reply := link.receive(timeout_ms)) is not None:
        replies.append(reply)
    return replies


@pytest.mark.parametrize(("latency_ms", "round_trip_ms"), [(0, 1), (0.6, 1), (1, 1), (2, 2), (7, 7), (30.4, 30)])
def test_a_round_trip_takes_the_latency_and_at_least_one_pass(simulation, latency_ms, round_trip_ms):
    link = SimLink(simulation, latency_ms)
    link.send(BATTERY)
    assert link.receive(1000).startswith(b"\x02\x0b\x00")
    assert simulation.now_ms == round_trip_ms


def test_a_reply_is_not_there_before_its_time(simulation):
    link = SimLink(simulation, 10)
    link.send(BATTERY)
    simulation.advance(9)
    assert link.poll() is None
    simulation.advance(1)
    assert link.poll() is not None
    assert link.poll() is None


def test_telegrams_are_taken_in_order_one_in_each_pass(simulation):
    link = SimLink(simulation)
    ask_state(link, "A", "B", "C")
    arrivals = []
    while (reply := link.receive(50)) is not None:
        arrivals.append((port_of(reply), simulation.now_ms))
    assert arrivals == [(0, 1), (1, 2), (2, 3)]


def test_waiting_for_nothing_ends_at_the_deadline(simulation):
    assert SimLink(simulation).receive(250) is None
    assert simulation.now_ms == 250


def test_lost_requests_and_replies_stay_lost(simulation):
    link = SimLink(simulation, faults=LinkFaults(drop_requests=[0], drop_replies=[2]))
    ask_state(link, "A", "B", "C", "A")
    assert [port_of(reply) for reply in replies_within(link, 100)] == [1, 0]


def test_a_reply_can_come_twice(simulation):
    link = SimLink(simulation, faults=LinkFaults(duplicate_replies=range(1)))
    ask_state(link, "B", "C")
    assert [port_of(reply) for reply in replies_within(link, 100)] == [1, 1, 2]


def test_a_reply_can_arrive_damaged(simulation):
    link = SimLink(simulation, faults=LinkFaults(corrupt_replies=[0]))
    link.send(BATTERY)
    assert link.receive(100).startswith(b"\xfd\xf4\xff")


def test_a_late_reply_comes_late_and_holds_up_the_next(simulation):
    link = SimLink(simulation, faults=LinkFaults(delay_replies_ms={0: 500}))
    ask_state(link, "B", "C")
    assert link.receive(400) is None
    assert [port_of(reply) for reply in replies_within(link, 200)] == [1, 2]


def test_nothing_gets_through_a_silent_span(simulation):
    link = SimLink(simulation, 4, LinkFaults(silent_ms=((100, 200),)))
    simulation.advance(98)
    link.send(BATTERY)  # the reply would arrive at 102
    simulation.advance(50)
    link.send(BATTERY)
    assert link.receive(500) is None
    link.send(BATTERY)
    assert link.receive(500) is not None


def test_a_pulled_cable_is_noticed_at_its_time_and_for_good(simulation):
    link = SimLink(simulation, faults=LinkFaults(unplugged_ms=((300, 400),)))
    simulation.advance(100)
    with pytest.raises(ConnectionError, match="unplugged"):
        link.receive(1000)
    assert simulation.now_ms == 300
    simulation.advance(500)
    with pytest.raises(ConnectionError):
        link.send(BATTERY)


def test_a_pulled_cable_closes_files_and_does_not_stop_motors(simulation):
    faults = LinkFaults(unplugged_ms=((300, 400),))
    link = SimLink(simulation, faults=faults)
    for request in (RUN_B, OPEN):
        link.send(request)
        assert link.receive(100)[2] == Status.OK
    with pytest.raises(ConnectionError):
        link.receive(1000)
    before = simulation.truth.pose
    simulation.advance(200)
    assert simulation.truth.pose != before
    link = SimLink(simulation, faults=faults)
    link.send(OPEN)
    assert link.receive(100)[2] == Status.OK


def test_a_new_link_needs_the_cable(simulation):
    faults = LinkFaults(unplugged_ms=((300, 400),))
    simulation.advance(350)
    with pytest.raises(ConnectionError):
        SimLink(simulation, faults=faults)
    simulation.advance(50)
    link = SimLink(simulation, faults=faults)
    link.send(BATTERY)
    assert link.receive(100) is not None


def test_what_was_sent_before_closing_still_arrives(simulation):
    link = SimLink(simulation, 20)
    link.send(RUN_B)
    link.close()
    simulation.advance(500)
    assert simulation.truth.pose.heading_deg > 10


def test_a_telegram_under_way_is_lost_with_the_cable(simulation):
    link = SimLink(simulation, 20, LinkFaults(unplugged_ms=((5, 6),)))
    start = simulation.truth.pose
    link.send(RUN_B)
    simulation.advance(500)
    assert simulation.truth.pose == start


def test_a_closed_link_says_so(simulation):
    link = SimLink(simulation)
    link.close()
    with pytest.raises(ConnectionError, match="closed"):
        link.send(BATTERY)


def test_what_is_under_way_is_counted(simulation):
    link = SimLink(simulation, 10)
    for under_way in (1, 2):
        link.send(BATTERY)
        assert link.under_way == under_way
    simulation.advance(50)
    assert link.under_way == 2
    link.poll()
    link.poll()
    assert link.under_way == 0


def test_a_radio_link_puts_lengths_in_front_and_has_more_room(simulation):
    link = SimLink(simulation, bluetooth=True)
    link.send(IOMapRead(0x000A0001, 119, 119).encode())
    reply = link.receive(100)
    assert int.from_bytes(reply[:2], "little") == len(reply) - 2 == 128


def test_the_end_of_a_radio_link_closes_no_files(simulation):
    link = SimLink(simulation, faults=LinkFaults(unplugged_ms=((300, 400),)), bluetooth=True)
    link.send(OPEN)
    assert link.receive(100)[4] == Status.OK
    with pytest.raises(ConnectionError):
        link.receive(1000)
    simulation.advance(500)
    link = SimLink(simulation)
    link.send(OPEN)
    assert link.receive(100)[2] == Status.FILE_EXISTS


def test_a_damaged_reply_of_a_radio_link_keeps_its_length(simulation):
    link = SimLink(simulation, faults=LinkFaults(corrupt_replies=[0]), bluetooth=True)
    link.send(BATTERY)
    assert link.receive(100).startswith(b"\x05\x00\xfd\xf4\xff")


def test_at_the_edge_of_its_range_a_radio_is_slow_and_loses_telegrams_but_keeps_their_order(simulation):
    faults = LinkFaults(weak_ms=((1000, 400_000),), weak_loss=0.2)
    link = SimLink(simulation, 2, faults)
    link.send(BATTERY)
    assert link.receive(100) is not None
    simulation.advance(1000)
    took_ms = []
    for _ in range(100):
        sent_ms = simulation.now_ms
        link.send(BATTERY)
        if link.receive(2000) is not None:
            took_ms.append(simulation.now_ms - sent_ms)
    assert 65 < len(took_ms) < 95
    assert min(took_ms) >= 300
    assert max(took_ms) <= 1500
    assert max(took_ms) - min(took_ms) > 600
    ask_state(link, *"ABC" * 5)
    ports = [port_of(reply) for reply in replies_within(link, 2000)]
    assert 8 <= len(ports) <= 15
    simulation.advance(400_000)
    sent_ms = simulation.now_ms
    link.send(BATTERY)
    assert link.receive(100) is not None
    assert simulation.now_ms - sent_ms == 2
