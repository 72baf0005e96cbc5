import json
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from firmware_protocol.enums import RunState
from firmware_protocol.errors import LocalProtocolError, RemoteProtocolError
from firmware_protocol.iomap import (
    COMM,
    COMMAND,
    DISPLAY,
    INPUT,
    IO_MAPS,
    OUTPUT,
    SOUND,
    UI,
    UiFlag,
)
from firmware_protocol.system import FindNextModule, IOMapRead

every_map = pytest.mark.parametrize("io_map", IO_MAPS.values(), ids=lambda io_map: io_map.name)


@every_map
def test_variables_lie_inside_and_do_not_overlap(io_map):
    taken = set()
    for name, field in io_map.fields.items():
        for index in range(field.copies):
            spot = io_map.field(name, index)
            mine = set(range(spot.offset, spot.offset + spot.size))
            assert not mine & taken, f"{name} overlaps"
            taken |= mine
    assert max(taken) < io_map.size


@every_map
def test_names_identifiers_and_sizes_are_what_the_firmware_lists(io_map):
    golden = Path(__file__).parents[1] / "golden" / "firmware.jsonl"
    listed = {"reply": {}, "reply_lego105": {}}
    for record in map(json.loads, golden.read_text().splitlines()):
        for firmware, modules in listed.items():
            reply = bytes.fromhex(record.get(firmware, record["reply"])) if record["scenario"] == "modules" else b""
            if reply[1:3] in (b"\x90\0", b"\x91\0"):
                found = FindNextModule.decode_reply(reply)
                modules[found.name] = (found.module_id, found.io_map_size)

    assert listed["reply"][io_map.name] == (io_map.module_id, io_map.size)
    assert listed["reply_lego105"][io_map.name] == (io_map.module_id, io_map.size_1_05)


FACT_SHEET = (Path(__file__).parents[2] / "docs" / "firmware.md").read_text(encoding="utf-8")
SECTION = FACT_SHEET.split("\n### 5.2 ")[1].split("\n## ")[0]


@pytest.mark.parametrize(
    ("io_map", "named"), [(OUTPUT, 13), (INPUT, 9), (DISPLAY, 4), (SOUND, 6), (UI, 16), (COMM, 4), (COMMAND, 6)]
)
def test_variables_lie_where_the_fact_sheet_says(io_map, named):
    """It is written from what was measured; names that it shortens are left out."""
    text = SECTION.split(f"\n* **{io_map.name.removesuffix('.mod')}**")[1].split("\n* **")[0]
    places = [(int(offset), name) for offset, name in re.findall(r"(\d+) ([A-Z]\w+)", text) if name in io_map.fields]
    assert len({name for _, name in places}) >= named
    for name in {name for _, name in places}:
        assert (io_map.fields[name].offset, name) in places


def test_a_variable_is_read_and_written_where_it_lies():
    spot = OUTPUT.field("RunState", 1)

    assert spot.read() == IOMapRead(0x00020001, 32 + 25, 1)
    assert spot.decode(b"\x20") is RunState.RUNNING
    assert spot.write(RunState.HOLD).encode() == bytes.fromhex("01 95 01000200 3900 0100 60")
    assert INPUT.field("ColorADRaw", 3).read() == IOMapRead(0x00030001, 80 + 3 * 84 + 52, 8)
    assert INPUT.field("ColorSensorValue", 0).decode(bytes.fromhex("0100ffff02000300")) == [1, -1, 2, 3]
    assert INPUT.field("ColorADRaw").encode([1, 2, 3, 4]) == bytes.fromhex("0100020003000400")


def test_a_stretch_is_one_access():
    stretch = OUTPUT.between("Flags", "RunState", 2)

    assert (stretch.offset, stretch.size) == (64 + 18, 8)
    assert stretch.write(bytes(8)).size == 8


def test_a_stretch_begins_with_its_first_field():
    with pytest.raises(LocalProtocolError, match="Flags comes before RunState in Output"):
        OUTPUT.between("RunState", "Flags")


def test_a_whole_map_is_decoded():
    """Source: tests/golden/firmware.jsonl, scenario iomap_read."""
    ui = UI.decode(bytes.fromhex("c0ec06084a1e0000000000000000000000000000000000000000800700010401020a000004000000"))

    assert ui["BatteryVoltage"] == 7754
    assert UiFlag(ui["Flags"]) == UiFlag.ENABLE_STATUS
    assert (ui["SleepTimeout"], ui["Volume"]) == (10, 4)


def test_sounds_name_is_text():
    """Source: tests/golden/firmware.jsonl, scenario iomap_read."""
    sound = SOUND.decode(bytes.fromhex("b801f40100002120537461727475702e72736f0000000000000002030204"))

    assert (sound["Freq"], sound["Duration"], sound["SoundFilename"]) == (440, 500, "! Startup.rso")


def test_what_a_shorter_map_lacks_is_left_out():
    values = INPUT.decode(bytes(INPUT.size_1_05))

    assert len(values["ADRaw"]) == 4
    assert "ColorADRaw" not in values
    assert "SyncTime" not in COMMAND.decode(bytes(COMMAND.size_1_05))


@settings(deadline=None)
@given(st.sampled_from([*IO_MAPS.values()]), st.binary(max_size=400))
def test_any_bytes_decode_to_the_variables_that_they_hold(io_map, noise):
    values = io_map.decode(noise)

    assert all(io_map.fields[name].end <= len(noise) for name in values)
    assert len(noise) < io_map.size or [*values] == [*io_map.fields]


@pytest.mark.parametrize(
    ("attempt", "message"),
    [
        (lambda: OUTPUT.field("RunStat"), "it has TachoCount, .*RunState"),
        (lambda: OUTPUT.field("RunState", 3), "has 3 of RunState"),
        (lambda: OUTPUT.field("Speed").encode(200), "must be a whole number from -128 to 127"),
        (lambda: COMM.field("DeviceName").encode("x" * 16), "at most 15 characters"),
        (lambda: INPUT.field("ColorADRaw").encode([1, 2]), "offset 132"),
    ],
)
def test_mistakes_are_named(attempt, message):
    with pytest.raises(LocalProtocolError, match=message):
        attempt()


def test_a_reply_of_another_size_is_refused():
    with pytest.raises(RemoteProtocolError):
        UI.field("BatteryVoltage").decode(b"\0")
