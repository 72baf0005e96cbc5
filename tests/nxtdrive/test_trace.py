"""Recording dialogues, and using a recording as a brick."""

import json
from contextlib import suppress
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from firmware_protocol.direct import GetBatteryLevel, GetOutputState, KeepAlive
from firmware_protocol.enums import OutputPort
from firmware_protocol.errors import AddressError, ConfigError, LinkError, LinkLost, LinkTimeout, NXTError
from nxtdrive import open_brick
from nxtdrive.brick import Brick
from nxtdrive.cli.main import DONE, LINK_LOST, NOT_ACHIEVED, main
from nxtdrive.mission.camera import default_camera
from nxtdrive.motion.rover import SafetyLimits
from nxtdrive.transports.address import Address
from nxtdrive.transports.record import RecordTransport, brick_address, in_room, recorded
from nxtdrive.transports.replay import ReplayTransport
from nxtdrive.transports.sim import SimTransport
from nxtdrive.transports.trace_file import Entry, EntryKind, Trace, TraceWriter, incomplete, read_trace
from sim_backend.link import LinkFaults
from sim_backend.simulation import Simulation

BATTERY = GetBatteryLevel().encode()
ANSWER = GetBatteryLevel.encode_reply() + b"\x40\x1f"

entries = st.builds(
    Entry,
    st.floats(0, 1e6).map(lambda value: round(value, 6)),
    st.sampled_from([EntryKind.TO_BRICK, EntryKind.FROM_BRICK]),
    st.binary(min_size=1, max_size=64),
    st.sampled_from(["", "LinkLost"]),
) | st.builds(Entry, st.just(1.5), st.just(EntryKind.ERROR), st.just(b""), st.just("LinkTimeout"), st.text())


@given(st.lists(entries), st.lists(st.text(min_size=1), max_size=3))
def test_what_is_written_is_read_back(tmp_path_factory, entries, command):
    path = tmp_path_factory.mktemp("traces") / "talk.nxttrace"
    header = Trace("sim://", 64, tuple(command))
    with TraceWriter(path, header) as writer:
        for entry in entries:
            writer.write(entry)
    trace = read_trace(path)
    assert (trace.address, trace.max_telegram, trace.command) == ("sim://", 64, tuple(command))
    assert list(trace.entries) == entries


@pytest.mark.parametrize("text", ["", "{}", '{"nxttrace": 2}', "[1]", "not json", '{"nxttrace": 1}'])
def test_anything_that_is_not_a_trace_is_refused(tmp_path, text):
    path = tmp_path / "talk.nxttrace"
    path.write_text(text)
    with pytest.raises(ConfigError):
        read_trace(path)


def test_a_bad_line_is_named_and_a_cut_last_line_left_out_with_a_warning(tmp_path, caplog):
    path = tmp_path / "talk.nxttrace"
    good = Trace("sim://", 64).header() + '\n{"t": 0, "to": "000b"}\n'
    path.write_text(good + '{"t": 0.1, "fr')
    assert len(read_trace(path).entries) == 1
    assert f"the trace {path} was cut off in its last line" in caplog.text
    for bad in (
        '{"t": 0.1, "fr',
        '{"t": 0.1, "to": ""}',
        '{"t": 0.1, "to": " "}',
        '{"t": true, "to": "000b"}',
        '{"t": NaN, "to": "000b"}',
    ):
        path.write_text(good + bad + '\n{"t": 0.2, "to": "000b"}\n')
        with pytest.raises(ConfigError, match="line 3"):
            read_trace(path)


json_values = st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.lists(st.text(), max_size=2)
HEX = st.sampled_from(["000b", "020b00c027", "020b", "8006", "02", "", "0", "zz"])
ERRORS = st.sampled_from(["LinkLost", "LinkTimeout", "RemoteProtocolError", "ConfigError", "__class__", "nonsense", ""])
odd_header = st.fixed_dictionaries(
    {"nxttrace": st.just(1), "max_telegram": st.integers(60, 130) | json_values},
    optional={"address": json_values, "command": json_values},
)
odd_entry = st.fixed_dictionaries(
    {"t": st.floats(0, 5) | json_values},
    optional={"to": HEX | json_values, "from": HEX, "error": ERRORS | json_values, "text": json_values}
    | {"reopened": json_values},
)


@given(st.lists(odd_header | odd_entry, min_size=1, max_size=6).map(lambda lines: "\n".join(map(json.dumps, lines))))
def test_any_json_lines_are_a_trace_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("traces") / "odd.nxttrace"
    path.write_text(text)
    with suppress(ConfigError):
        read_trace(path)


@given(st.lists(st.builds(Entry, st.floats(0, 5), st.sampled_from(EntryKind), st.binary(max_size=8), ERRORS)))
def test_a_program_meets_only_errors_of_the_driver_in_any_trace(entries):
    with Brick(ReplayTransport(Trace("sim://", 64, (), tuple(entries)), "replay://")) as brick:
        for _ in range(3):
            with suppress(NXTError):
                brick.request(GetBatteryLevel())
        with suppress(NXTError):
            brick.link.reconnect()


@pytest.fixture
def record(tmp_path):
    """Records what `talk` does with a brick; returns the trace's path and what `talk` returned."""

    def make(talk, faults=None, latency_ms=2, **options):
        path = tmp_path / "talk.nxttrace"
        inner = SimTransport(Simulation("open"), faults=faults, latency_ms=latency_ms)
        header = Trace(inner.address, inner.max_telegram)
        with Brick(RecordTransport(inner, TraceWriter(path, header), inner.now()), **options) as brick:
            return path, talk(brick)

    return make


def test_a_recording_stands_in_for_the_brick(record):
    def talk(brick):
        brick.sleep(0.5)
        return brick.battery_v, brick.request(GetOutputState(OutputPort.B)).fields(), brick.now()

    path, answers = record(talk)
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick:
        assert talk(brick) == answers


def test_the_time_of_a_recording_starts_with_it_and_goes_on_when_the_link_is_reopened(tmp_path):
    inner = SimTransport(Simulation("open"))
    inner.sleep(5.0)
    path = tmp_path / "late.nxttrace"
    transport = RecordTransport(inner, TraceWriter(path, Trace("sim://", 64)), inner.now())
    transport.send(BATTERY)
    transport.sleep(1.0)
    transport.close()
    transport.reopen().close()
    assert [entry.kind for entry in read_trace(path).entries] == [EntryKind.TO_BRICK, EntryKind.REOPENED]
    assert [entry.time_s for entry in read_trace(path).entries] == pytest.approx([0.0, 1.0], abs=0.1)


def test_a_trace_whose_file_cannot_be_opened_again_is_incomplete(tmp_path, caplog):
    path = tmp_path / "talk.nxttrace"
    writer = TraceWriter(path, Trace("sim://", 64))
    writer.close()
    path.unlink()
    path.mkdir()
    writer.reopen()
    writer.write(Entry(0.0, EntryKind.REOPENED))
    assert f"the trace {path} is incomplete" in caplog.text
    assert path in incomplete


def test_a_recording_that_ends_before_a_reply_does_not_ask_for_the_brick(record):
    path, _ = record(lambda brick: brick.battery_v)
    trace = read_trace(path)
    cut = replace(trace, entries=trace.entries[:-1])
    with (
        Brick(ReplayTransport(cut, "replay://")) as brick,
        pytest.raises(LinkTimeout, match=r"^the recording ends here, without a reply to the last request\.$"),
    ):
        _ = brick.battery_v


@pytest.mark.parametrize("latency_ms", [2, 45])
def test_recorded_motions_replay_exactly(record, latency_ms):
    def talk(brick):
        motor, rover = brick.motor("A"), brick.rover(safety=SafetyLimits(enabled=False))
        arm = motor.run_angle(500, 200, wait=False)
        asked = [brick.battery_v for _ in range(5)]
        motions = [arm.join(), rover.straight(120), rover.turn(-50), motor.run_target(700, -30)]
        return [*asked, *motions, motor.angle, rover.pose(), brick.now()]

    path, outcomes = record(talk, latency_ms=latency_ms)
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick:
        assert talk(brick) == outcomes


def test_what_went_wrong_goes_wrong_again(record):
    def talk(brick):
        brick.link.reconnecting = True
        outcomes = []
        for _ in range(12):
            try:
                outcomes.append(brick.battery_v)
            except (LinkTimeout, LinkLost) as error:
                outcomes.append(type(error).__name__)
            brick.link.transport.sleep(0.2)
        return outcomes

    faults = LinkFaults(drop_replies=[2], delay_replies_ms={4: 150}, unplugged_ms=((1000, 1500),))
    path, outcomes = record(talk, faults, timeout_s=0.1)
    assert "LinkTimeout" in outcomes
    assert any(entry.kind is EntryKind.REOPENED for entry in read_trace(path).entries)
    with Brick(ReplayTransport(read_trace(path), "replay://"), timeout_s=0.1) as brick:
        assert talk(brick) == outcomes


def test_a_telegram_that_cannot_be_sent_is_recorded_with_the_error(record):
    def talk(brick):
        brick.sleep(0.1)
        with pytest.raises(LinkLost):
            brick.link.transport.send(BATTERY)

    path, _ = record(talk, LinkFaults(unplugged_ms=((50, 1000),)))
    sent = read_trace(path).entries[0]
    assert (sent.kind, sent.telegram, sent.error) == (EntryKind.TO_BRICK, BATTERY, "LinkLost")


def test_a_loss_that_is_noticed_before_a_request_is_recorded(record):
    def talk(brick):
        recorded(brick.link.transport).close()
        with pytest.raises(LinkLost, match="closed"):
            brick.request(GetBatteryLevel())

    path, _ = record(talk)
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick, pytest.raises(LinkLost, match="closed"):
        brick.request(GetBatteryLevel())


@pytest.mark.parametrize("rest", [(), (Entry(0.1, EntryKind.FROM_BRICK, ANSWER),)], ids=["end", "reply"])
def test_a_link_is_reopened_only_where_it_was(rest):
    replay = ReplayTransport(Trace("sim://", 64, (), rest), "replay://")
    with pytest.raises(LinkLost, match="not opened again at this point"):
        replay.reopen()


def test_a_closed_replay_says_so(record):
    path, _ = record(lambda brick: brick.battery_v)
    replay = ReplayTransport(read_trace(path), "replay://")
    replay.close()
    with pytest.raises(LinkLost, match="closed"):
        replay.waiting()


def test_another_request_than_recorded_names_both(record):
    path, _ = record(lambda brick: (brick.battery_v, brick.request(GetOutputState(OutputPort.A))))
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick:
        assert brick.battery_v
        with pytest.raises(LinkError, match=r"request 2 .* GetOutputState port=B .* recorded is GetOutputState port=A"):
            brick.request(GetOutputState(OutputPort.B))


def test_behind_its_end_a_recording_answers_nothing(record):
    path, _ = record(lambda brick: brick.battery_v)
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick:
        assert brick.battery_v
        with pytest.raises(LinkError, match="ends here"):
            brick.request(GetBatteryLevel())


def test_keep_alives_without_an_answer_may_come_and_go(record):
    path, _ = record(lambda brick: (brick.link.send(KeepAlive()), brick.battery_v))
    with Brick(ReplayTransport(read_trace(path), "replay://")) as brick:
        assert brick.battery_v
        brick.link.send(KeepAlive())
    assert [exchange.request for exchange in read_trace(path).exchanges()] == [BATTERY]


def test_a_recorded_transport_is_found_again(record):
    path, inner = record(lambda brick: recorded(brick.link.transport))
    assert isinstance(inner, SimTransport)
    assert recorded(inner) is inner
    assert read_trace(path).address == "sim://"


@pytest.mark.parametrize("address", ["record://", "record://x.nxttrace", "record://?nxt=sim%3A%2F%2F", "replay://"])
def test_incomplete_addresses(address):
    with pytest.raises(AddressError):
        open_brick(address)


def test_a_trace_that_cannot_be_written_is_reported_before_anything_moves(tmp_path):
    with pytest.raises(ConfigError, match="cannot be written"):
        open_brick(f"record://{tmp_path}/nowhere/talk.nxttrace?nxt=sim%3A%2F%2Fopen")


@pytest.mark.parametrize("recordings", range(3))
@pytest.mark.parametrize(
    ("brick", "with_room"),
    [
        ("sim://?seed=3", "sim://room.toml?seed=3"),
        ("sim://open", "sim://open"),
        ("usb://", "usb://"),
        ("record://incomplete.nxttrace", "record://incomplete.nxttrace"),
    ],
)
def test_a_simulated_brick_without_a_room_gets_one_also_behind_recordings(brick, with_room, recordings):
    address = Address.parse(brick)
    for _ in range(recordings):
        address = Address("record", "a.nxttrace", {"nxt": str(address)})
    changed = in_room(address, "room.toml")
    assert changed.scheme == address.scheme
    assert brick_address(changed) == Address.parse(with_room)


@pytest.fixture
def talk(tmp_path, capsys):
    """A trace of ``nxtdrive info``."""
    path = tmp_path / "talk.nxttrace"
    assert main(["info", "--nxt", "sim://open", "--trace", str(path)]) == DONE
    capsys.readouterr()
    return path


def test_every_command_that_opens_a_brick_records_it(talk, printed):
    trace = read_trace(talk)
    assert (trace.address, trace.command) == ("sim://open", ("info",))
    assert "NXT" in printed("info", "--nxt", f"replay://{talk}")


def test_a_recorded_robot_keeps_its_simulated_camera(tmp_path):
    with open_brick(f"record://{tmp_path}/run.nxttrace?nxt=sim%3A%2F%2Fopen") as brick:
        assert default_camera(brick) == "sim"


def test_show_says_it_in_words(talk, printed):
    text = printed("trace", "show", talk)
    assert "-> GetDeviceInfo" in text
    assert "free_flash=" in text
    assert len(printed("trace", "show", talk, "--full").splitlines()) > len(text.splitlines())
    lines = [json.loads(line) for line in printed("trace", "show", talk, "--json").splitlines()]
    assert lines[0]["explained"]["name"] == "KeepAlive"


def test_diff_names_the_fields_that_differ(talk, tmp_path, capsys, printed):
    other = tmp_path / "other.nxttrace"
    assert main(["info", "--nxt", "sim://open?firmware=1.05&latency_ms=9", "--trace", str(other)]) == DONE
    capsys.readouterr()
    assert "the same" in printed("trace", "diff", talk, talk)
    assert main(["trace", "diff", str(talk), str(other)]) == NOT_ACHIEVED
    assert "firmware_minor: 29, then 5" in capsys.readouterr().out


def test_diff_aligns_conversations(talk, tmp_path, capsys):
    shorter = tmp_path / "shorter.nxttrace"
    lines = talk.read_text().splitlines(keepends=True)
    shorter.write_text("".join(lines[:3] + lines[5:]))
    assert main(["trace", "diff", str(talk), str(shorter)]) == NOT_ACHIEVED
    assert capsys.readouterr().out.startswith("- 2: GetDeviceInfo")


def test_replay_compares_a_brick_with_the_recorded_one(talk, capsys, printed):
    assert "as recorded" in printed("trace", "replay", talk, "--nxt", "sim://open")
    assert main(["trace", "replay", str(talk), "--nxt", "sim://open?firmware=1.05"]) == NOT_ACHIEVED
    assert "firmware_minor" in capsys.readouterr().out


def test_replay_stops_the_motors_it_has_started(tmp_path, capsys):
    path, again = tmp_path / "motor.nxttrace", tmp_path / "again.nxttrace"
    with open_brick(f"record://{path}?nxt=sim%3A%2F%2Fopen") as brick:
        brick.motor("A").dc(50)
        brick.sleep(0.2)
    trace = read_trace(path)
    path.write_text("\n".join([trace.header(), *(entry.to_json() for entry in trace.entries[:4])]))
    assert main(["trace", "replay", str(path), "--nxt", "sim://open", "--trace", str(again)]) == DONE
    last = read_trace(again).exchanges()[-1].request
    assert last[1] == 0x04, "SetOutputState"
    assert last[3] == 0, "no power"


@pytest.mark.parametrize("words", [["show", "nowhere.nxttrace"], ["diff", "a", "b"], ["replay", "c"]])
def test_a_missing_file_is_one_sentence(words, refused):
    assert "cannot be read" in refused("trace", *words)


def test_where_a_program_differs_is_reported(talk, capsys):
    assert main(["send", "StopProgram", "--nxt", f"replay://{talk}"]) == LINK_LOST
    said = capsys.readouterr().err
    assert "recorded is GetDeviceInfo" in said
    assert said.endswith("Recorded was: nxtdrive info.\n")
