"""The line protocol over real sockets: answers, interruptions, and one client at a time."""

from __future__ import annotations

import contextlib
import errno
import itertools
import select
import socket
import threading
import time

import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from behaviors.journal import RecordKind
from behaviors.line_protocol import ErrorReply, Status, Why
from behaviors.ports import Glimpse
from firmware_protocol import status
from firmware_protocol.errors import BrickBusy, BrickError
from nxtdrive.brick import Brick
from nxtdrive.link.interrupting import interruptible
from nxtdrive.mission.line_server import CHECK_INTERVAL_S, LineServer
from nxtdrive.mission.vision import geometric_vision
from nxtdrive.transports import open_transport
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.sim import SimTransport
from sim_backend.doors.server import RealTimeServer
from sim_backend.doors.sockets import SocketDoor, StreamClient
from sim_backend.doors.switchboard import Switchboard
from sim_backend.link import LinkFaults, SimLink
from sim_backend.simulation import Simulation
from tests.open_files import files_left

LONG_MM = 1500.0
"""An advance of some eight seconds, and there is room for it in world open."""

EVERY_ANSWER = {*ErrorReply, 0, 1, 2, *Why}


def test_connect_makes_connectable(serve):
    assert serve().client().ask("connect") == 1


def test_status_describes_what_is_in_progress(serve):
    client = serve().client()
    assert client.ask("status") == Status.IDLE
    client.ask("arrive lena")
    client.ask("arrive lena")
    assert client.ask("status") == Status.UNDER_WAY
    client.ask("stop")
    assert client.ask("status") == Status.IDLE


def test_move_to_is_one_turn_ten_advances_and_a_one(serve):
    served = serve(advance_mm=50.0)
    client = served.client()
    assert [client.ask("move_to 90") for _ in range(11)] == [0] * 10 + [1]
    assert served.simulation.truth.pose.heading_deg == pytest.approx(90, abs=3)
    assert client.ask("why") == Why.MOVED


@pytest.mark.slow
@pytest.mark.parametrize("between", ["connect", "select", "stop", "target lena", "arrive lena"])
def test_another_command_starts_move_to_afresh(serve, between):
    served = serve(advance_mm=50.0)
    client = served.client()
    client.ask("move_to 30")
    client.ask(between)
    before = served.simulation.truth.pose.heading_deg
    client.ask("move_to 30")
    assert served.simulation.truth.pose.heading_deg - before == pytest.approx(30, abs=3)


@pytest.mark.parametrize("question", ["status", "why", "evidence", "dance", "move_to north"])
def test_a_question_and_a_mistake_leave_move_to_where_it_is(serve, question):
    served = serve(advance_mm=50.0)
    client = served.client()
    client.ask("move_to 30")
    client.send(question + "\n")
    client.receive()
    before = served.simulation.truth.pose.heading_deg
    client.ask("move_to 30")
    assert served.simulation.truth.pose.heading_deg - before == pytest.approx(0, abs=3)


def test_exist_is_reset_by_every_search_and_by_a_new_target(serve):
    client = serve().client()
    assert client.ask("select") == 0
    client.ask("arrive lena")
    assert client.ask("select") == 1
    assert client.ask("target rilakkuma") == 1
    assert client.ask("select") == 0
    assert client.ask("arrive") == 2
    assert client.ask("why") == Why.FULL_TURN_WITHOUT_SIGHTING
    assert client.ask("select") == 0


@pytest.mark.slow
def test_a_bare_arrive_means_the_present_target(serve):
    served = serve("open", "rilakkuma", "lena")
    client = served.client()
    assert client.ask("arrive") == 2, "the first one of the mission, which is not there"
    replies = [client.ask("arrive lena")]
    while replies[-1] == 0:
        replies.append(client.ask("arrive"))
    assert replies[-1] == 1
    assert served.simulation.truth.distance_mm("lena") < 500
    assert client.ask("why") == Why.WITHIN_REACH


def test_an_undescribed_target_is_a_bad_argument(serve):
    client = serve().client()
    assert client.ask("arrive santa") == 2
    assert client.ask("why") == Why.BAD_ARGUMENT
    assert client.ask("target santa") == ErrorReply.BAD_ARGUMENT
    assert client.ask("arrive") == 0, "the present target is still lena"


def test_a_reason_is_journaled_with_the_request_that_it_is_about(serve):
    served = serve()
    client = served.client()
    for line in ("target santa", "status", "select", "target lena", "why"):
        client.ask(line)
    told = [record.data["why"] for record in served.records if record.kind is RecordKind.REPLY]
    assert told == ["bad_argument", "", "", "", "bad_argument"]


@pytest.mark.slow
def test_a_long_conversation_with_camera_and_detector_reaches_the_target(serve):
    served = serve("open", camera=True)
    client = served.client()
    replies = []
    while not replies or replies[-1] == 0:
        replies.append(client.ask("arrive(lena)"))
    assert replies[-1] == 1
    assert served.at_rest


def test_the_safety_stop_is_reported_and_cuts_the_advance(serve):
    served = serve("open", advance_mm=800.0)
    client = served.client()
    reasons = []
    for _ in range(10):
        assert client.ask("move_to 0") == 0
        reasons.append(client.ask("why"))
    assert reasons == sorted(reasons), "first it advances, then it does not"
    assert set(reasons) == {Why.MOVED, Why.OBSTACLE_AHEAD}
    assert client.ask("status") == Status.HELD
    assert served.at_rest
    assert client.ask("move_to 0") == 1, "ten advances are ten advances"
    assert client.ask("status") == Status.IDLE


@pytest.mark.parametrize("verb", ["select", "target rilakkuma", "arrive"])
def test_what_held_a_move_to_does_not_outlast_it(serve, verb):
    client = serve("open", "rilakkuma", advance_mm=800.0, look_every_deg=180.0).client()
    why = Why.NOTHING_YET
    while why != Why.OBSTACLE_AHEAD:
        assert client.ask("move_to 0") == 0
        why = client.ask("why")
    client.ask(verb)
    assert client.ask("status") == Status.IDLE
    if verb == "arrive":
        assert client.ask("why") == Why.FULL_TURN_WITHOUT_SIGHTING


# --- interruptions ---


@pytest.mark.parametrize(("command", "failed"), [("move_to 0", 1), ("move_to 180", 1), ("arrive rilakkuma", 2)])
def test_stop_ends_the_motion_in_progress(serve, command, failed):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    served.after(1.0, lambda: client.send("stop\n"))
    start_ms = served.simulation.now_ms
    assert client.ask(command) == failed
    assert int(client.receive()) == 1
    assert served.simulation.now_ms - start_ms < 1500
    assert served.at_rest
    assert client.ask("why") == Why.OPERATOR_STOP
    assert client.ask("status") == Status.IDLE


def test_what_was_asked_before_a_stop_does_not_begin_any_more(serve):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    served.after(1.0, lambda: client.send("move_to 90\nselect\nstop\nstatus\n"))
    assert client.ask("move_to 0") == 1
    assert [int(client.receive()) for _ in range(4)] == [1, 0, 1, Status.IDLE]
    assert served.simulation.truth.pose.heading_deg == pytest.approx(0, abs=3)


def test_after_a_stop_the_next_command_runs(serve):
    served = serve(advance_mm=200.0)
    client = served.client()
    served.after(0.5, lambda: client.send("stop\n"))
    client.ask("move_to 0")
    client.receive()
    assert client.ask("move_to 0") == 0


@pytest.mark.parametrize("command", ["move_to 0", "arrive rilakkuma"])
def test_a_client_that_hangs_up_stops_the_motors(serve, command):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    left = threading.Event()
    served.after(1.0, lambda: (client.leave(), left.set()))
    start = served.simulation.truth.pose
    client.send(command + "\n")
    assert left.wait(60)
    assert served.client().ask("status") == Status.IDLE, "the next one is served"
    assert served.at_rest
    end = served.simulation.truth.pose
    assert end.x_mm - start.x_mm < 400
    assert any("motors off" in line for line in served.said)


def test_a_client_that_leaves_an_approach_stops_the_motors(serve):
    served = serve()
    client = served.client()
    assert [client.ask("arrive lena") for _ in range(2)] == [0, 0]
    assert served.simulation.truth.speed_mm_s > 50, "driving on between two calls"
    client.leave()
    assert served.client().ask("status") == Status.IDLE
    assert served.at_rest


@pytest.mark.parametrize("line", ["target rilakkuma", "connect", "stop", "bye"])
def test_what_ends_an_approach_brakes_at_once(serve, line):
    served = serve()
    client = served.client()
    assert [client.ask("arrive lena") for _ in range(2)] == [0, 0]
    assert client.ask(line) == 1
    served.simulation.advance(200)
    assert served.simulation.truth.speed_mm_s < 10, "its lease would let it drive on for longer"


def test_bye_is_answered_and_ends_the_conversation(serve):
    served = serve()
    client = served.client()
    client.ask("arrive lena")
    client.ask("arrive lena")
    assert client.ask("bye") == 1
    assert client.receive() == b""
    assert served.at_rest


def test_the_end_of_the_server_stops_the_motors(serve):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    served.after(1.0, served.end.set)
    assert client.ask("move_to 0") == 1
    served.thread.join()
    assert served.at_rest


def test_a_server_that_has_ended_leaves_the_link_as_it_was(serving, mission_for):
    simulation, mission, calls = Simulation("open", seed=1), mission_for("lena"), []
    with Brick(SimTransport(simulation)) as brick, interruptible(brick.link, lambda: calls.append(brick)):
        with serving(brick, simulation, mission, geometric_vision(brick, mission)) as served:
            assert served.client().ask("connect") == 1
        calls.clear()
        assert brick.battery_v
        assert calls


class SeesNothing:
    """Vision that sees nothing."""

    def look(self, target):
        return None

    def glance(self, targets):
        return Glimpse(0.0, {})

    def free_floor(self, free_at_s):
        return ()


@pytest.mark.slow
def test_stop_breaks_off_a_motion_over_a_real_link(serving, mission_for):
    simulation = Simulation("open", seed=1)
    clock_end = threading.Event()
    now = WallClock().now
    door = SocketDoor(StreamClient, 0, now=now)
    switchboard = Switchboard([door], lambda bluetooth: SimLink(simulation, 2.0, bluetooth=bluetooth), lambda _: None)
    world = RealTimeServer(
        simulation, switchboard, now=now, wait=lambda files, wait_s: select.select(files, [], [], wait_s)
    )
    thread = threading.Thread(target=world.run, args=(clock_end.is_set, lambda _: None))
    thread.start()
    try:
        with Brick(open_transport(door.address)) as brick:
            mission = mission_for("lena", advance_mm=LONG_MM)
            with serving(brick, simulation, mission, SeesNothing()) as served:
                client = served.client()
                served.after(1.0, lambda: client.send("stop\n"))
                assert client.ask("move_to 0") == 1
                assert int(client.receive()) == 1
                assert client.ask("status") == Status.IDLE
    finally:
        clock_end.set()
        thread.join()
        switchboard.close()
        door.close()
    simulation.advance(500)
    assert simulation.truth.speed_mm_s < 1.0
    assert simulation.truth.pose.x_mm < 400 + LONG_MM / 2


# --- clients ---


def test_a_second_client_is_answered_as_busy_until_the_first_leaves(serve):
    served = serve()
    first, second = served.client(), served.client()
    assert first.ask("connect") == 1
    answers = {verb: second.ask(verb) for verb in ("connect", "arrive lena", "select", "move_to 90", "why", "stop")}
    assert list(answers.values()) == [0, 2, 0, 1, ErrorReply.BUSY, ErrorReply.BUSY]
    assert first.ask("status") == Status.IDLE
    assert first.ask("bye") == 1
    assert second.ask("connect") == 1
    assert sum("refused client" in line for line in served.said) == 1


def test_a_second_client_does_not_wait_for_a_command_to_end(serve):
    served = serve(advance_mm=400.0)
    first, second = served.client(), served.client()
    received = []
    served.after(0.5, lambda: second.send("status\n"))
    served.after(1.0, lambda: received.append(second.receive()))
    assert first.ask("move_to 0") == 0
    assert received == [b"%d" % ErrorReply.BUSY]


def test_clients_that_send_no_request_keep_no_other_from_being_served(serve):
    served = serve()
    idle = [served.client() for _ in range(20)]
    idle[-1].send("GET / HTTP/1.1\r\n")
    assert served.client().ask("connect") == 1
    assert idle[0].receive() == b"", "the oldest ones were closed"
    assert sum("dropped client" in line for line in served.said) == 1


def test_a_client_that_does_not_read_is_disconnected_and_holds_up_no_other(serve):
    served = serve()
    greedy = served.client()
    greedy.socket.settimeout(0.05)
    with pytest.raises(OSError, match=r"timed out|reset|pipe"):  # noqa: PT012
        while True:
            greedy.send("why\n" * 100)
    greedy.leave()
    assert served.client().ask("connect") == 1


class Broken:
    """A camera that raises."""

    def __init__(self, error):
        self.error = error

    def look(self, target):
        raise self.error

    def glance(self, targets):
        raise self.error

    def free_floor(self, free_at_s):
        raise self.error


REFUSALS = [BrickError(status.Status.NO_MORE_HANDLES, "OpenRead"), BrickBusy("it is busy"), OSError("gone")]


@pytest.mark.parametrize("error", REFUSALS, ids=repr)
def test_a_search_that_the_brick_or_the_camera_refuses_has_failed(serving, mission_for, error):
    simulation, vision = Simulation("open", seed=1), Broken(error)
    with Brick(SimTransport(simulation)) as brick, serving(brick, simulation, mission_for("lena"), vision) as served:
        client = served.client()
        assert client.ask("arrive lena") == 2
        assert client.ask("why") == Why.FAULT


def test_an_internal_error_is_answered_and_logged(serving, mission_for, caplog):
    simulation, vision = Simulation("open", seed=1), Broken(ZeroDivisionError())
    with Brick(SimTransport(simulation)) as brick, serving(brick, simulation, mission_for("lena"), vision) as served:
        client = served.client()
        assert client.ask("arrive lena") == 2
        assert client.ask("why") == Why.FAULT
        assert client.ask("connect") == 1, "the server goes on"
    assert "internal error in arrive" in caplog.text
    assert "ZeroDivisionError" in caplog.text


@pytest.mark.parametrize("failure", ["link", "camera", "stopped", "argument", "busy"])
def test_the_verbs_of_the_thesis_answer_nothing_else_whatever_happens(serve, failure):
    faults = LinkFaults(unplugged_ms=((100, 10**9),)) if failure == "link" else None
    served = serve(faults=faults, advance_mm=50.0, look_every_deg=180.0)
    if failure == "camera":
        served.simulation.webcam.unplugged_ms = ((0, 10**9),)
    client = served.client()
    if failure == "busy":
        assert client.ask("why") == Why.NOTHING_YET
        client = served.client()
    argument = {"argument": " north", "stopped": "\nstop"}.get(failure, "")
    lines = [f"{verb}{argument}\n" for verb in ("connect", "arrive", "select", "move_to 9", "bye")]
    if failure == "stopped":
        lines = [line for line in lines if line.startswith(("arrive", "move_to"))]
    client.send("".join(lines))
    answers = [client.receive() for line in lines for _ in range(line.count("\n"))]
    assert set(answers) <= {b"0", b"1", b"2"}


def test_a_client_that_asks_and_leaves_moves_nothing(serve):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    client.send("status\nmove_to 0\n")
    client.socket.shutdown(1)
    assert int(client.receive()) == Status.IDLE
    served.client().ask("connect")
    assert served.simulation.truth.pose.x_mm == pytest.approx(400, abs=100)
    assert served.at_rest


def test_a_client_that_floods_is_sent_away(serve):
    served = serve(advance_mm=LONG_MM)
    client = served.client()
    flooded = threading.Event()
    served.after(0.5, lambda: (client.send("why\n" * 2000), flooded.set()))
    client.send("move_to 0\n")
    assert flooded.wait(60)
    assert served.client().ask("connect") == 1
    assert served.at_rest


def test_a_client_that_is_gone_before_it_is_accepted_does_not_end_the_server(serve, monkeypatch):
    """On macOS a connection that its client has reset takes no options."""
    served, refusals = serve(), iter([True])

    def setsockopt(connection, *option):
        if next(refusals, False):
            raise OSError(errno.EINVAL, "Invalid argument")

    monkeypatch.setattr(socket.socket, "setsockopt", setsockopt, raising=False)
    assert served.client().receive() == b""
    assert served.client().ask("connect") == 1


def test_a_brick_that_answers_nonsense_is_a_link_that_breaks(serve):
    served = serve(advance_mm=LONG_MM, faults=LinkFaults(corrupt_replies=range(60, 70)))
    client = served.client()
    assert client.ask("move_to 0") == 1
    assert client.ask("why") == Why.LINK_LOST
    assert client.ask("connect") == 1


def test_a_sonar_that_is_pulled_out_slows_the_robot_and_no_more(serve):
    served = serve(advance_mm=300.0)
    client = served.client()
    client.ask("move_to 0")
    quick_s = served.simulation.time_s
    served.simulation.brick.attach_sensor(4, None)
    assert client.ask("move_to 0") == 0  # the sensor fails during this one
    begun_s = served.simulation.time_s
    assert client.ask("move_to 0") == 0
    assert served.simulation.time_s - begun_s > 1.3 * quick_s


def test_a_camera_that_is_away_is_reported_as_a_fault(serve):
    served = serve()
    served.simulation.webcam.unplugged_ms = ((0, 10**9),)
    client = served.client()
    assert client.ask("arrive lena") == 2
    assert client.ask("why") == Why.FAULT


def test_a_link_that_breaks_is_reported_and_connect_mends_it(serve):
    served = serve(advance_mm=LONG_MM, faults=LinkFaults(unplugged_ms=((1000, 5000),)))
    client = served.client()
    assert client.ask("move_to 0") == 1
    assert client.ask("why") == Why.LINK_LOST
    assert client.ask("status") == ErrorReply.LINK_DOWN
    assert client.ask("connect") == 0
    (connecting,) = (record.data for record in served.records if record.data.get("value") == 0)
    assert (connecting["verb"], connecting["why"]) == ("connect", "link_lost")
    served.simulation.advance(6000)
    assert served.simulation.truth.speed_mm_s < 1.0, "the lease has stopped the motors"
    assert client.ask("connect") == 1
    assert client.ask("status") == Status.IDLE


@pytest.mark.slow
@settings(
    max_examples=12,
    deadline=None,
    # a conversation that stalls does so for the client's whole patience; shrinking it would take hours
    phases=[Phase.explicit, Phase.reuse, Phase.generate],
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(
    lines=st.lists(
        st.one_of(
            st.binary(max_size=40),
            st.sampled_from(
                [b"connect", b"select", b"move_to(20)", b"stop", b"target lena", b"status", b"why", b"arrive lena"]
            ),
        ),
        max_size=8,
    )
)
def test_any_conversation_has_one_known_answer_a_line(serve, lines):
    served = serve(advance_mm=20.0, look_every_deg=180.0)
    client = served.client()
    stream = b"".join(line.replace(b"bye", b"") + b"\n" for line in lines)
    client.socket.sendall(stream + b"why\n")
    answers = [int(client.receive()) for _ in range(stream.count(b"\n") + 1)]
    assert set(answers) <= EVERY_ANSWER
    served.end.set()
    served.thread.join()
    served.server.close()
    client.leave()
    assert served.at_rest


def test_while_too_many_files_are_open_the_server_pauses_and_accepts_the_client_later():
    rounds = itertools.count(1)
    with contextlib.ExitStack() as stack:
        brick = stack.enter_context(Brick(SimTransport(Simulation("open"))))
        server = LineServer(brick, pytest.fail, port=0, stopped=lambda: next(rounds) % 11 == 0)
        stack.callback(server.close)
        client = stack.enter_context(socket.create_connection(server.address))
        client.sendall(b"dance\n")
        with files_left(0):
            begun_s = time.monotonic()
            server.run()
            assert time.monotonic() - begun_s > 4 * CHECK_INTERVAL_S
        server.run()
        assert client.recv(64) == b"%d\n" % ErrorReply.UNKNOWN_VERB


# --- time ---


def test_time_stands_still_between_commands(serve):
    served = serve()
    client = served.client()
    client.ask("select")
    before_ms = served.simulation.now_ms
    for _ in range(5):
        client.ask("select")
    assert served.simulation.now_ms == before_ms


@pytest.mark.slow
def test_in_real_time_the_world_continues_and_the_brick_stays_awake(serving, mission_for):
    simulation = Simulation("open", seed=1)
    passed = threading.Event()
    simulation.at(30 * 60 * 1000, passed.set)
    with Brick(SimTransport(simulation)) as brick:
        brick.link.keep_alive()
        mission = mission_for("lena")
        with serving(brick, simulation, mission, SeesNothing(), passing=lambda _: brick.sleep(60.0)) as served:
            client = served.client()
            assert client.ask("connect") == 1
            assert passed.wait(60)
            assert client.ask("status") == Status.IDLE, "the brick has not gone to sleep after its ten minutes"
