import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.build import build, usage
from firmware_protocol.catalog import ALL_COMMANDS
from firmware_protocol.direct import GetOutputState, LSWrite, MessageWrite, PlaySoundFile, SetInputMode, SetOutputState
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, RegulationMode, RunState, SensorMode, SensorType
from firmware_protocol.errors import LocalProtocolError
from firmware_protocol.system import GetVersions, IOMapWrite, OpenRead


@pytest.mark.parametrize(
    ("line", "command"),
    [
        ("GetVersions", GetVersions()),
        ("getoutputstate port=b", GetOutputState(OutputPort.B)),
        ("GetOutputState port=0x2", GetOutputState(OutputPort.C)),
        ("SetInputMode port=IN_3 type=touch|1 mode=boolean", None),
        (
            "SetInputMode port=IN_3 type=SWITCH mode=BOOLEAN",
            SetInputMode(InputPort.IN_3, SensorType.SWITCH, SensorMode.BOOLEAN),
        ),
        ("LSWrite port=IN_1 rx_length=1 data=0242", LSWrite(InputPort.IN_1, 2, 1, b"\x02\x42")),
        ("MessageWrite box=0 data=text:hi", MessageWrite(0, 2, b"hi")),
        ("MessageWrite box=0 size=9 data=6800", MessageWrite(0, 9, b"h\0")),
        ("IOMapWrite module_id=0x000C0001 offset=28 data=02", IOMapWrite(0x000C0001, 28, 1, b"\x02")),
        ("OpenRead name=demo.rxe", OpenRead("demo.rxe")),
        ("PlaySoundFile loop=yes name=a.rso", PlaySoundFile(True, "a.rso")),
        ("PlaySoundFile loop=no name=a.rso", PlaySoundFile(False, "a.rso")),
        (
            "SetOutputState port=ALL power=-50 mode=motor_on|brake regulation=idle turn_ratio=0"
            " run_state=0x20 tacho_limit=0",
            SetOutputState(
                OutputPort.ALL, -50, OutputMode.MOTOR_ON | OutputMode.BRAKE, RegulationMode.IDLE, 0, RunState.RUNNING, 0
            ),
        ),
    ],
)
def test_words_become_commands(line, command):
    name, *words = line.split()
    if command is None:
        with pytest.raises(LocalProtocolError, match="'touch' is neither a number nor one of NONE, SWITCH"):
            build(name, words)
    else:
        assert build(name, words) == command


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("Nope", r"no command 'Nope'\. There are "),
        ("GetOutputStat", r"no command 'GetOutputStat'\. Did you mean GetOutputState"),
        ("xyzzy", r"There are StartProgram, StopProgram, .*Poll"),
        ("GetOutputState prt=1", r"no field 'prt'\. Did you mean 'port'\? Usage: GetOutputState port=<A\|B\|C\|ALL>"),
        ("GetOutputState zzz=1", r"no field 'zzz'\. Usage"),
        ("GetOutputState 1", "not of the form field=value"),
        ("GetOutputState", "still needs port"),
        ("GetVersions x=1", "GetVersions takes no fields"),
        ("PlayTone frequency_hz=fast duration_ms=1", "PlayTone.frequency_hz: 'fast' is not a whole number"),
        ("PlayTone frequency_hz=70000 duration_ms=1", "from 0 to 65535, not 70000"),
        ("GetOutputState port=A port=B", r"GetOutputState\.port is given twice"),
        (
            "SetOutputState port=A power=0 mode=-1 regulation=0 turn_ratio=0 run_state=0 tacho_limit=0",
            "SetOutputState.mode: must be a whole number from 0 to 255, not -1",
        ),
        ("OpenRead name=abcdefghijklmnopqrst", "text of at most 19 characters"),
        ("OpenRead name=猫.rxe", r"OpenRead\.name must be text in Latin-1 characters, not '猫\.rxe'"),
        ("LSWrite port=IN_1 rx_length=1 data=xyz", "LSWrite.data: .*hexadecimal"),
    ],
)
def test_mistakes_are_answered_with_what_there_is(line, message):
    name, *words = line.split()
    with pytest.raises(LocalProtocolError, match=message):
        build(name, words)


@pytest.mark.parametrize("command", ALL_COMMANDS, ids=lambda command: command.__name__)
def test_every_command_says_how_it_is_typed(command):
    assert all(f"{field}=<" in usage(command) for field in command.layout.wires)


@settings(deadline=None)
@given(st.sampled_from([command.__name__ for command in ALL_COMMANDS]), st.lists(st.text(max_size=12), max_size=4))
def test_any_words_give_a_command_or_a_protocol_error(name, words):
    try:
        command = build(name, words)
    except LocalProtocolError:
        return
    assert command.encode()
