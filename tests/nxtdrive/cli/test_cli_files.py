"""``nxtdrive files`` and ``nxtdrive program``."""

import io
import json

import pytest

from nxtdrive.cli.main import DONE, NOT_ACHIEVED, REFUSED, USAGE, main
from nxtdrive.transports.sim import SimTransport, shared
from nxtdrive.transports.trace_file import read_trace
from sim_backend.simulation import Simulation

FLASH = 120_868


def test_ls_lists_names_and_sizes(capsys, printed):
    assert printed("files", "ls", "--nxt", "sim://open").split() == ["6", "NVConfig.sys"]
    assert main(["files", "ls", "*.sys", "--json", "--nxt", "sim://open"]) == DONE
    assert json.loads(capsys.readouterr().out) == [{"name": "NVConfig.sys", "size": 6}]


def test_df_gives_free_and_used_bytes(capsys):
    assert main(["files", "df", "--json", "--nxt", "sim://open"]) == DONE
    assert json.loads(capsys.readouterr().out) == {"free_bytes": FLASH, "files": 1, "used_bytes": 6}


def test_get_writes_the_file_where_it_is_wanted(here, capsys):
    assert main(["files", "get", "NVConfig.sys", "--nxt", "sim://open"]) == DONE
    assert main(["files", "get", "NVConfig.sys", "--to", "copy.sys", "--nxt", "sim://open"]) == DONE
    (here / "folder").mkdir()
    assert main(["files", "get", "NVConfig.sys", "--to", "folder", "--nxt", "sim://open"]) == DONE
    contents = [path.read_bytes() for path in (here / "NVConfig.sys", here / "copy.sys", here / "folder/NVConfig.sys")]
    assert [len(content) for content in contents] == [6, 6, 6]


def test_put_sends_what_get_would_fetch(here, capsys):
    (here / "melody.rso").write_bytes(bytes(range(200)))
    put = ["files", "put", "melody.rso", "--as", "alarm.rso", "--nxt", "sim://open", "--trace", "put.nxttrace"]
    assert main(put) == DONE
    said = capsys.readouterr()
    assert "alarm.rso: 200 bytes" in said.out
    assert said.err.startswith("note: this was the simulated brick")
    assert "`nxtdrive sim serve` offers a simulated one that stays" in said.err
    written = [each.request[3:] for each in read_trace(here / "put.nxttrace").exchanges() if each.request[1] == 0x83]
    assert b"".join(written) == bytes(range(200))


def test_put_names_the_option_that_replaces_a_file(here, capsys):
    (here / "melody.rso").write_bytes(b"new")
    put = ["files", "put", "melody.rso", "--as", "NVConfig.sys", "--nxt", "sim://open"]
    assert main(put) == REFUSED
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err == "nxtdrive: NVConfig.sys is already on the brick; --replace replaces it.\n"
    assert main([*put, "--replace"]) == DONE


def test_rm_deletes_by_pattern(capsys, printed):
    assert printed("files", "rm", "--force", "*.sys", "--nxt", "sim://open") == "deleted NVConfig.sys\n"
    assert main(["files", "rm", "*.txt", "--nxt", "sim://open"]) == NOT_ACHIEVED
    assert "no file on the brick matches *.txt" in capsys.readouterr().err
    assert main(["files", "rm", "none.txt", "--nxt", "sim://open"]) == REFUSED
    assert capsys.readouterr().err == (
        "nxtdrive: there is no file none.txt on the brick; `nxtdrive files ls` lists what is there.\n"
    )


def test_rm_continues_after_files_it_cannot_delete(capsys):
    simulation = Simulation("open")
    loader = simulation.brick.loader
    for name in ("b.txt", "tagebuch\u00e9.txt", "what?.txt", "a.txt"):
        loader.create(name, 4, appendable=True)
        loader.close(0)
    with shared("odd", lambda: SimTransport(simulation)) as address:
        assert main(["files", "rm", "*.txt", "none.txt", "*.sys", "--nxt", address]) == USAGE
    said = capsys.readouterr()
    assert said.out.split() == ["deleted", "a.txt", "deleted", "b.txt"]
    assert said.err.count("is kept") == 3
    assert "there is no file none.txt" in said.err
    assert [file.name for file in loader.flash.files] == ["what?.txt", "tagebuch\u00e9.txt", "NVConfig.sys"]


@pytest.mark.parametrize("name", ["NVConfig.sys", "*", "nvconfig.SYS"])
def test_a_system_file_is_kept_without_a_terminal_to_ask_in(refused, name):
    assert "--force" in refused("files", "rm", name, "--nxt", "sim://open")


@pytest.mark.parametrize(("answer", "code"), [("y\n", DONE), ("\n", USAGE), ("", USAGE)])
def test_a_system_file_is_deleted_after_a_yes(capsys, monkeypatch, answer, code):
    terminal = io.StringIO(answer)
    terminal.isatty = lambda: True
    monkeypatch.setattr("sys.stdin", terminal)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert main(["files", "rm", "NVConfig.sys", "--nxt", "sim://open"]) == code
    said = capsys.readouterr()
    assert "Delete it? [y/N]" in said.err
    assert ("deleted NVConfig.sys" in said.out) is (code == DONE)
    assert ("Answer y to delete it, or add --force." in said.err) is (code == USAGE)


@pytest.mark.parametrize(
    ("words", "code", "hint"),
    [
        (["files", "put", "nowhere.rxe"], USAGE, "cannot be read"),
        (["files", "put", "a", "b", "--as", "c"], USAGE, "single file"),
        (["files", "get", "none.rxe"], REFUSED, "file not found"),
        (["files", "get", "much-too-long-a-name.rxe"], USAGE, "19"),
        (["program", "start", "notes.txt"], USAGE, "hang. Programs end in .rxe, .rtm, .rpg; sounds are played, not"),
        (["program", "start", "none.rxe"], REFUSED, "file not found"),
    ],
)
def test_mistakes_are_one_sentence(here, capsys, words, code, hint):
    assert main([*words, "--nxt", "sim://open"]) == code
    assert hint in capsys.readouterr().err


def test_without_a_program_status_and_stop_say_so(printed, answered):
    assert printed("program", "status", "--nxt", "sim://open") == "no program is running\n"
    assert answered("program", "stop", "--nxt", "sim://open") == {"running": None}
