"""Files with mistakes of any kind: exit code 2 and sentences, never a traceback, within bounded time and memory."""

import json
import os
from pathlib import Path

import pytest

from nxtdrive.cli.main import DONE, NOT_ACHIEVED, main
from sim_backend.faults_file import load_faults

MISSION = '[mission]\ntargets = ["spot"]\n[target.spot]\ndetector = "color"\ncolor = "red"\n'
WORLD = "[floor]\nsize_mm = [3000, 3000]\n[robot]\nstart_mm = [1000, 1500]\n"
FAULTS = "drop_replies = [3]\n"

READERS = {
    "mission": (MISSION, lambda path: ["mission", "check", path]),
    "world": (WORLD, lambda path: ["info", "--nxt", f"sim://{path}"]),
    "faults": (FAULTS, lambda path: ["sim", "serve", "--tcp", "0", "--faults", path]),
}
"""Kind of TOML file -> a good one, and a command that reads it."""

BAD_TOML = {
    "arrays": b"x = " + b"[" * 5000 + b"]" * 5000,
    "tables": b"x = " + b"{a=" * 5000 + b"1" + b"}" * 5000,
    "dots": b".".join([b"a"] * 20_000) + b" = 1\n",
    "quoted dots": b" . ".join([b'"a"'] * 2000) + b" = 1\n",
    "header": b"[" + b".".join([b"a"] * 2000) + b"]\n",
    "not UTF-8": b"title = '\xff'\n",
    "UTF-16": MISSION.encode("utf-16"),
    "NUL": b"x = 1\n\x00\n",
    "nothing but NUL": bytes(1000),
    "too large": b"# comment\n" * 200_000,
    "digits": b"x = " + b"9" * 5000,
    "hex digits": b"x = 0x" + b"f" * 5000,
    "many keys": b"".join(b"k%d = 1\n" % i for i in range(3000)),
    "long text": b"mission = '" + b"x" * 200_000 + b"'\nrobot = 1\nsilent_ms = 1\n",
}


@pytest.mark.parametrize("kind", READERS)
@pytest.mark.parametrize("fault", BAD_TOML)
def test_bad_toml_is_refused_with_a_sentence(tmp_path, refused, kind, fault):
    path = tmp_path / "bad.toml"
    path.write_bytes(BAD_TOML[fault])
    assert "bad.toml" in refused(*READERS[kind][1](path))


@pytest.mark.parametrize("kind", READERS)
def test_a_byte_order_mark_does_no_harm(tmp_path, capsys, kind):
    good, words = READERS[kind]
    path = tmp_path / "good.toml"
    path.write_bytes(b"\xef\xbb\xbf" + good.replace("\n", "\r\n").encode())
    if kind == "faults":  # the command would serve until Ctrl-C
        assert load_faults(path).drop_replies.numbers == (3,)
    else:
        assert main([str(word) for word in words(path)]) == DONE


@pytest.mark.parametrize("number", ["nan", "inf", "-inf", "1e999"])
@pytest.mark.parametrize(
    ("kind", "key"),
    [
        ("mission", "[adaptive]\napproach_limit_s = {}\n"),
        ("mission", "[camera]\nhfov_deg = {}\n"),
        ("world", "heading_deg = {}\n"),
        (
            "world",
            'slip = {{ veer_deg_per_m = {} }}\n[[pictures]]\nname = "lena"\nat_mm = [100, 100]\nfacing_deg = 0\n',
        ),
        ("world", '[[pictures]]\nname = "lena"\nat_mm = [100, 100]\nfacing_deg = {}\n'),
        ("world", '[[boxes]]\nname = "box"\nat_mm = [{}, 100]\nsize_mm = [10, 10]\nheight_mm = 10\n'),
        ("faults", "delay_replies_ms = {{ 3 = {} }}\n"),
    ],
)
def test_a_number_that_is_not_finite_is_refused_by_its_key(tmp_path, refused, kind, key, number):
    good, words = READERS[kind]
    path = tmp_path / "bad.toml"
    path.write_text(good + key.format(number), encoding="utf-8")
    assert key.split(" = {")[0].split("\n")[-1].split(" ")[-1] in refused(*words(path))


@pytest.mark.parametrize(
    ("key", "number"),
    [("from_mm", "[1e300, 1]"), ("to_mm", "[1, -2e6]"), ("height_mm", "1e300"), ("thickness_mm", "1e7")],
)
def test_a_world_larger_than_a_kilometre_is_refused_by_its_key(tmp_path, refused, key, number):
    wall = {"from_mm": "[100, 100]", "to_mm": "[900, 100]", "height_mm": "500", "thickness_mm": "20"} | {key: number}
    path = tmp_path / "bad.toml"
    path.write_text("\n".join([WORLD, "[[walls]]", *(f"{name} = {value}" for name, value in wall.items())]))
    assert f"walls[0].{key}" in refused("info", "--nxt", f"sim://{path}")


def _fifo(folder):
    os.mkfifo(folder / "file")


def _huge(folder):
    with open(folder / "file", "wb") as file:
        file.truncate(10**11)


NOT_A_FILE = {
    "huge": _huge,
    "folder": lambda folder: (folder / "file").mkdir(),
    "pipe": _fifo,
    "device": lambda folder: (folder / "file").symlink_to("/dev/zero"),
    "missing": lambda folder: None,
    "loop": lambda folder: (folder / "file").symlink_to(folder / "file"),
}
NAMED = {
    "mission": lambda path: ["mission", "check", path],
    "show": lambda path: ["mission", "show", path],
    "run": lambda path: ["run", path, "--nxt", "sim://open"],
    "world": lambda path: ["info", "--nxt", f"sim://{path}"],
    "faults": lambda path: ["sim", "serve", "--tcp", "0", "--faults", path],
    "trace": lambda path: ["trace", "show", path],
    "replay": lambda path: ["info", "--nxt", f"replay://{path}"],
    "journal": lambda path: ["explain-run", path],
    "exported": lambda path: ["export", path, "--csv"],
    "counted": lambda path: ["chances", path],
    "repeated": lambda path: ["what-if", path],
    "robot": lambda path: ["run", "--robot", path],
    "page": lambda path: ["web", "--mission", path, "--port", "0"],
    "model": lambda path: ["detect", "try", "x.png", "--onnx", path, "--label", "cat"],
    "recording": lambda path: ["sim", "check", path],
    "upload": lambda path: ["files", "put", path, "--nxt", "sim://open"],
    "sweep": lambda path: ["sweep", "--classes", "open", "--profiles", "oracle", "--resume", "--out", path],
    "picture": lambda path: ["detect", "try", path, "--color", "red"],
    "target": lambda path: ["detect", "try", "x.png", "--picture", path],
    "cascade": lambda path: ["detect", "try", "x.png", "--haar", path],
}
"""Commands that are given a file's name."""


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes in the file system")
@pytest.mark.parametrize("kind", sorted(NAMED.keys() - {"sweep"}))
@pytest.mark.parametrize("what", NOT_A_FILE)
def test_anything_that_is_not_a_file_is_refused(tmp_path, refused, kind, what):
    NOT_A_FILE[what](tmp_path)
    refused(*NAMED[kind](tmp_path / "file"))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes in the file system")
@pytest.mark.parametrize("what", sorted(NOT_A_FILE.keys() - {"missing"}))
def test_a_sweep_does_not_continue_with_anything_but_a_file(tmp_path, refused, what):
    NOT_A_FILE[what](tmp_path)
    refused(*NAMED["sweep"](tmp_path / "file"))


COPIED = {
    "picture": ("file.png", NAMED["picture"]),
    "video": ("file.avi", NAMED["picture"]),
    "target": ("file.png", NAMED["target"]),
    "cascade": ("file.xml", NAMED["cascade"]),
    "network": ("file.onnx", lambda path: ["detect", "try", "x.png", "--onnx", path, "--label", "cup"]),
    "labels of a network": ("file.onnx", lambda path: ["detect", "try", "x.png", "--onnx", path]),
}
"""Kinds of files that people copy or download -> a name, and a command that reads it."""


@pytest.mark.parametrize("kind", COPIED)
def test_an_empty_file_that_was_copied_is_reported_as_empty(tmp_path, refused, kind):
    name, words = COPIED[kind]
    (tmp_path / name).touch()
    assert f"{tmp_path / name} is empty. Copy it again." in refused(*words(tmp_path / name))


@pytest.mark.parametrize("kind", NAMED)
@pytest.mark.parametrize("name", ["x" * 300, "y/" * 3000], ids=["long name", "long path"])
def test_a_name_no_file_can_have_is_refused(refused, kind, name):
    refused(*NAMED[kind](Path(name)))


def test_a_mission_that_names_pictures_and_cascades_no_file_can_be_called(tmp_path, refused):
    path = tmp_path / "bad.toml"
    for name in ("x" * 300 + ".png", "a\\u0000b.png"):
        path.write_text(f'[mission]\ntargets=["a"]\n[target.a]\ndetector="picture"\npictures=["{name}"]\n')
        assert "there is no picture" in refused("mission", "check", path)
        path.write_text(f'[mission]\ntargets=["a"]\n[target.a]\ndetector="haar"\ncascade="{name}"\n')
        assert "there is no cascade" in refused("mission", "check", path).lower()


def test_a_long_mission_name_makes_a_shorter_folder_name(tmp_path):
    from nxtdrive.recording.run_folder import new_run_folder

    folder = new_run_folder(tmp_path, "find the cat " * 100)
    assert folder.path.name.startswith("find-the-cat-")
    folder.close()


HEADER = {"nxttrace": 1, "address": "usb://", "max_telegram": 64}
DEEP = '{"t": ' + '{"a":' * 5000 + "1" + "}" * 5001
TRACES = {
    "deep header": DEEP,
    "command is a number": json.dumps({**HEADER, "command": 5}),
    "command of numbers": json.dumps({**HEADER, "command": [1]}),
    "address is a list": json.dumps({**HEADER, "address": ["usb://"]}),
    "size is true": json.dumps({**HEADER, "max_telegram": True}),
    "size is infinite": '{"nxttrace": 1, "max_telegram": 1e999}',
    "size is huge": json.dumps({**HEADER, "max_telegram": 10**300}),
    "size is less than a brick has": json.dumps({**HEADER, "max_telegram": 63}),
    "header is a list": "[1]",
    "nothing": "",
}
ENTRIES = {
    "deep entry": DEEP,
    "NaN": '{"t": NaN, "to": "000d"}',
    "infinite": '{"t": 1e999, "to": "000d"}',
    "never": '{"t": 1e300, "to": "000d"}',
    "negative": '{"t": -1, "to": "000d"}',
    "time in words": '{"t": "nan", "to": "000d"}',
    "digits": '{"t": ' + "9" * 5000 + ', "to": "000d"}',
    "telegram is a number": '{"t": 0, "to": 13}',
    "error is a list": '{"t": 0, "error": ["LinkLost"]}',
    "surrogates": '{"t": 0, "to": "\\ud800"}',
}
JOURNALS = {
    "nothing": "",
    "deep": DEEP,
    "time is infinite": '{"t": 1e999, "kind": "start", "state": "idle", "target": ""}',
    "time is a text": '{"t": "nan", "kind": "start", "state": "idle", "target": ""}',
    "kind is a list": '{"t": 0, "kind": ["start"], "state": "idle", "target": ""}',
    "state is a number": '{"t": 0, "kind": "start", "state": 3, "target": ""}',
    "digits": '{"t": 0, "kind": "start", "state": "", "target": "", "format": ' + "9" * 5000 + "}",
    "later format": '{"t": 0, "kind": "start", "state": "", "target": "", "format": 1000000}',
}
RECORDINGS = {
    "deep": DEEP,
    "not finite": '{"request": "000b", "reply": "020b00", "step": NaN}',
    "digits": '{"request": "000b", "reply": "020b00", "step": ' + "9" * 5000 + "}",
    "nothing": "",
}
GOOD_START = '{"t": 0.5, "kind": "start", "state": "idle", "target": "", "mission": "m", "targets": []}\n'


@pytest.mark.parametrize("text", TRACES.values(), ids=TRACES.keys())
@pytest.mark.parametrize("kind", ["trace", "replay"])
def test_a_trace_with_a_bad_header_is_refused(tmp_path, refused, kind, text):
    path = tmp_path / "bad.nxttrace"
    path.write_text(text + "\n", encoding="utf-8")
    refused(*NAMED[kind](path))


@pytest.mark.parametrize("text", ENTRIES.values(), ids=ENTRIES.keys())
def test_a_trace_with_a_bad_entry_is_refused_by_its_line(tmp_path, refused, text):
    path = tmp_path / "bad.nxttrace"
    path.write_text("\n".join((json.dumps(HEADER), text, '{"t": 0.1, "to": "000d"}', "")), encoding="utf-8")
    assert "line 2" in refused("trace", "show", path)


@pytest.mark.parametrize("text", JOURNALS.values(), ids=JOURNALS.keys())
def test_a_journal_without_a_record_is_refused(tmp_path, refused, text):
    path = tmp_path / "journal.jsonl"
    path.write_text(text + "\n", encoding="utf-8")
    refused("explain-run", path)


@pytest.mark.parametrize("text", sorted(ENTRIES.values()))
def test_a_journals_bad_lines_are_left_out_and_named(tmp_path, answered, text):
    (tmp_path / "journal.jsonl").write_text(GOOD_START + text + "\n", encoding="utf-8")
    (tmp_path / "mission.json").write_text(DEEP, encoding="utf-8")
    assert answered("explain-run", tmp_path)["damaged_lines"] == [2]


def test_a_byte_order_mark_before_json_lines_does_no_harm(tmp_path, answered):
    (tmp_path / "journal.jsonl").write_text("\ufeff" + GOOD_START.replace("\n", "\r\n"), encoding="utf-8")
    assert answered("explain-run", tmp_path)["damaged_lines"] == []
    (tmp_path / "x.nxttrace").write_text("\ufeff" + json.dumps(HEADER), encoding="utf-8")
    assert main(["trace", "show", str(tmp_path / "x.nxttrace")]) == DONE


@pytest.mark.parametrize("content", [b"", b"no picture", bytes(1000)])
def test_a_world_whose_picture_is_none_is_refused(here, refused, content):
    (here / "poster.png").write_bytes(content)
    table = '[[pictures]]\nname = "poster"\nfile = "poster.png"\nat_mm = [2000, 1500]\nfacing_deg = 180\n'
    (here / "world.toml").write_text(WORLD + table)
    (here / "mission.toml").write_text(MISSION)
    assert "poster.png" in refused("run", "mission.toml", "--nxt", "sim://world.toml")


HOURS = 999_999_999


@pytest.mark.parametrize(
    "control", [f"!tick {HOURS}", f"!trace {HOURS} 100", "!trace 20 0", f"!mkfiles {HOURS}", f"!fill 00 {HOURS}"]
)
def test_a_control_line_that_makes_no_sense_or_takes_hours_is_not_carried_out(tmp_path, capsys, control):
    path = tmp_path / "long.jsonl"
    path.write_text(json.dumps({"control": control, "reply": "ok"}) + "\n", encoding="utf-8")
    assert main(["sim", "check", str(path)]) == NOT_ACHIEVED
    assert "cannot be carried out" in capsys.readouterr().out


@pytest.mark.parametrize("text", RECORDINGS.values(), ids=RECORDINGS.keys())
def test_a_bad_recording_of_a_conversation_is_refused(tmp_path, refused, text):
    path = tmp_path / "bad.jsonl"
    path.write_text(text + "\n", encoding="utf-8")
    refused("sim", "check", path)
