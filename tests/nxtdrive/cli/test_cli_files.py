"""``nxtdrive files`` and ``nxtdrive program``."""

import json

import pytest

from nxtdrive.cli.main import DONE, REFUSED, USAGE, main
from nxtdrive.transports.trace_file import read_trace

FLASH = 120_868


@pytest.fixture
def brick(tmp_path, monkeypatch):
    """A folder to work in."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_ls_lists_names_and_sizes(capsys):
    assert main(["files", "ls", "--nxt", "sim://open"]) == DONE
    assert capsys.readouterr().out.split() == ["6", "NVConfig.sys"]
    assert main(["files", "ls", "*.sys", "--json", "--nxt", "sim://open"]) == DONE
    assert json.loads(capsys.readouterr().out) == [{"name": "NVConfig.sys", "size": 6}]


def test_df_tells_the_room(capsys):
    assert main(["files", "df", "--json", "--nxt", "sim://open"]) == DONE
    assert json.loads(capsys.readouterr().out) == {"free_bytes": FLASH, "files": 1, "used_bytes": 6}


def test_get_writes_the_file_where_it_is_wanted(brick, capsys):
    assert main(["files", "get", "NVConfig.sys", "--nxt", "sim://open"]) == DONE
    assert main(["files", "get", "NVConfig.sys", "--to", "copy.sys", "--nxt", "sim://open"]) == DONE
    (brick / "folder").mkdir()
    assert main(["files", "get", "NVConfig.sys", "--to", "folder", "--nxt", "sim://open"]) == DONE
    contents = [
        path.read_bytes() for path in (brick / "NVConfig.sys", brick / "copy.sys", brick / "folder/NVConfig.sys")
    ]
    assert [len(content) for content in contents] == [6, 6, 6]


def test_put_sends_what_get_would_fetch(brick, capsys):
    (brick / "melody.rso").write_bytes(bytes(range(200)))
    put = ["files", "put", "melody.rso", "--as", "alarm.rso", "--nxt", "sim://open", "--trace", "put.nxttrace"]
    assert main(put) == DONE
    assert "alarm.rso: 200 bytes" in capsys.readouterr().out
    written = [each.request[3:] for each in read_trace(brick / "put.nxttrace").exchanges() if each.request[1] == 0x83]
    assert b"".join(written) == bytes(range(200))


def test_rm_deletes_by_pattern(capsys):
    assert main(["files", "rm", "*.sys", "--nxt", "sim://open"]) == DONE
    assert capsys.readouterr().out == "deleted NVConfig.sys\n"
    assert main(["files", "rm", "*.txt", "--nxt", "sim://open"]) == DONE
    assert main(["files", "rm", "none.txt", "--nxt", "sim://open"]) == REFUSED


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (["files", "put", "nowhere.rxe"], USAGE, "cannot be read"),
        (["files", "put", "a", "b", "--as", "c"], USAGE, "single file"),
        (["files", "get", "none.rxe"], REFUSED, "file not found"),
        (["files", "get", "much-too-long-a-name.rxe"], USAGE, "19"),
        (["program", "start", "notes.txt"], USAGE, "hang"),
        (["program", "start", "none.rxe"], REFUSED, "file not found"),
    ],
)
def test_mistakes_are_one_sentence(brick, capsys, words, code, hint):
    assert main([*words, "--nxt", "sim://open"]) == code
    assert hint in capsys.readouterr().err


def test_status_tells_which_program_runs(capsys):
    assert main(["program", "status", "--nxt", "sim://open"]) == DONE
    assert capsys.readouterr().out == "no program is running\n"
    assert main(["program", "stop", "--json", "--nxt", "sim://open"]) == DONE
    assert json.loads(capsys.readouterr().out) == {"running": None}
