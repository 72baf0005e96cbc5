"""Impossible arguments are refused in a sentence, with exit code 2, before anything is opened."""

import argparse
import contextlib
import json

import pytest

from nxtdrive.cli.commands import sweep
from nxtdrive.cli.main import COMMANDS, DONE, USAGE, main, make_parser
from nxtdrive.cli.parser import OTHER_WORDS
from sim_backend.simulation import DEFAULT_WORLD

NO_NUMBERS = ("nan", "inf", "-inf", "-nan", "1e400", "", " ", "text", "0x", "1,5")
EXTREMES = ("-1", "0", "1e9", "1000000000000000")


def _leaves(parser):
    """Yield the parser, or those of its actions."""
    below = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not below:
        yield parser
    for action in below:
        for sub in action.choices.values():
            yield from _leaves(sub)


def _numeric_arguments():
    """Every argument of every command that is converted to a number; a new one is here by itself."""
    for command in sorted(COMMANDS):
        top = make_parser([command])
        (commands,) = (action for action in top._actions if isinstance(action, argparse._SubParsersAction))
        for parser in _leaves(commands.choices[command]):
            for action in parser._actions:
                made_by_number = getattr(action.type, "__qualname__", "").startswith("number.")
                if made_by_number or action.type in (int, float, complex):
                    name = "/".join(action.option_strings) or action.metavar
                    yield pytest.param(parser, action, id=f"{parser.prog} {name}")


def test_a_profiles_file_is_no_profile(capsys):
    with pytest.raises(SystemExit):
        main(["run", "--profile", "./patient.py"])
    assert "is a file; name the class, in the file's folder: patient:CLASS" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("command", "meant"),
    [
        (["run", "--mission", "my.toml"], "MISSION.toml is given without an option: `nxtdrive run MISSION.toml`"),
        (["run", "my.toml", "--world", "room.toml"], "Did you mean `--nxt sim://room.toml`?"),
        (["run", "my.toml", "--world=room.toml"], "Did you mean `--nxt sim://room.toml`?"),
        (["run", "my.toml", "room.toml"], "Did you mean `--nxt sim://room.toml`?"),
        (["monitor", "--sim"], "Did you mean `--nxt sim://WORLD.toml`?"),
        (["info", "--port", "usb"], "Did you mean `--nxt usb://`?"),
        (["web", "my.toml"], "Did you mean `--mission my.toml`?"),
        (["web", "--mission", "my.toml", "room.toml"], "Did you mean `--nxt sim://room.toml`?"),
        (["run", "--camra", "0"], "Did you mean '--camera'?"),
    ],
)
def test_what_is_given_in_another_way_is_reported(command, meant, refused):
    assert meant in refused(*command)


def test_an_option_that_no_action_has_is_not_to_be_given_after_one(refused):
    said = refused("sensor", "--port", "1")
    assert "choose from" in said
    assert "--port after" not in said


def test_a_mission_in_the_place_of_a_command_is_to_be_run(refused):
    assert "Did you mean `nxtdrive run my-mission.toml`?" in refused("my-mission.toml")


@pytest.mark.parametrize(("word", "command"), [(word, each) for each, words in OTHER_WORDS.items() for word in words])
def test_another_word_for_what_a_command_does_leads_to_it(word, command, refused):
    assert f"Did you mean `nxtdrive {command}`?" in refused(word)
    with pytest.raises(SystemExit) as exit_:
        main([*command.partition(" RUN")[0].split(), "--help"])
    assert exit_.value.code == 0


def test_another_word_for_a_command_means_nothing_among_the_actions_of_one(refused):
    assert "teleop" not in refused("motor", "drive")


@pytest.mark.parametrize(
    "command",
    [
        ("chances", "runs", "--out"),
        ("sweep", "--out"),
        ("what-if", "run", "--out"),
        ("bench", "--out"),
        ("sim", "record", "script.jsonl", "--out"),
        ("monitor", "--csv"),
        ("sensor", "watch", "1", "--csv"),
        ("info", "--trace"),
        ("calibrate", "--robot"),
        ("files", "get", "a.rxe", "--to"),
    ],
    ids=lambda command: command[0],
)
def test_no_file_is_called_as_standard_output_is(command, here, refused):
    assert "standard output is not possible here; name a file, ./- for one called '-'" in refused(*command, "-")
    assert not list(here.iterdir())


NUMERIC = list(_numeric_arguments())


def test_a_decimal_comma_is_named_and_limits_have_none(refused):
    error = refused("mission", "new", "--picture", "cat.jpg", "--height-mm", "29,7")
    assert "a number from 10 to 3000, not '29,7'. Write a decimal point, not a comma" in error


def _refusal(parser, action, text, capsys):
    """What the parser says to the argument when it is `text`, or an empty string if it has no objection to it."""
    if action.option_strings:
        words = [f"{action.option_strings[0]}={text}"]
    else:
        positional = [each for each in parser._actions if not each.option_strings]
        before = positional[: positional.index(action)]
        words = [str(next(iter(each.choices or ("240",)))) for each in before] + [text]
    with contextlib.suppress(SystemExit):
        parser.parse_args(words)
    said = capsys.readouterr().err
    return said if f"argument {'/'.join(action.option_strings) or action.metavar}: " in said else ""


@pytest.mark.parametrize(("parser", "action"), NUMERIC)
def test_anything_that_is_not_a_finite_number_is_refused(parser, action, capsys):
    for text in NO_NUMBERS:
        said = _refusal(parser, action, text, capsys)
        assert repr(text) in said, f"{text!r} is accepted"


@pytest.mark.parametrize(("parser", "action"), NUMERIC)
def test_every_number_has_limits_and_the_refusal_names_them(parser, action, capsys):
    refusals = [_refusal(parser, action, text, capsys) for text in EXTREMES]
    assert any(refusals), "use nxtdrive.cli.options.number"
    assert all("must be" in said or "invalid choice" in said or "invalid int" in said for said in refusals if said)


def test_there_are_numbers_to_test():
    assert len(NUMERIC) >= 25


@pytest.mark.parametrize(
    ("words", "meant"),
    [
        (["rnu"], "'run'"),
        (["doctr"], "'doctor'"),
        (["motor", "trun", "A", "5"], "'turn'"),
        (["sensor", "wach", "4"], "'watch'"),
        (["info", "--jsn"], "'--json'"),
        (["motor", "turn", "A", "5", "--spede=4"], "'--speed'"),
        (["mission", "show", "--profil"], None),
        (["run", "--profile", "thessis"], "'thesis'"),
        (["info", "--colour"], None),
        (["explain-run", "x", "--decision", "3"], None),
        (["xyzzy"], None),
    ],
)
def test_a_mistyped_word_leads_to_the_one_that_was_meant(words, meant, refused):
    said = refused(*words)
    assert (f"Did you mean {meant}" in said or f"or {meant}?" in said) if meant else "Did you mean" not in said
    assert "`nxtdrive" in said


@pytest.mark.parametrize(
    ("words", "advice"),
    [
        (["files", "list"], "Did you mean 'ls'?"),
        (["files", "--nxt", "sim://", "list"], "(choose from ls, get, put, rm, df). Give --nxt after the ACTION"),
        (["files", "--json", "ls"], "unrecognized arguments: --json. Give --json after `nxtdrive files ls`"),
        (["--nxt", "sim://", "info"], "Give --nxt after the COMMAND"),
    ],
)
def test_an_option_before_the_action_is_refused_with_its_right_position(words, advice, refused):
    assert advice in refused(*words)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--classes", "opne"], "there is no class 'opne'. Did you mean 'open'?"),
        (["--profiles", "tesis"], "there is no agent 'tesis'. Did you mean 'thesis'?"),
        (["--classes", "zzz"], "there is no class 'zzz'. Known: open, "),
        (["--agents", "hasti"], "there is no agent 'hasti'. Did you mean 'hasty'?"),
    ],
)
def test_a_sweep_leads_from_a_mistyped_class_or_profile_to_the_nearest(words, said, refused, monkeypatch):
    monkeypatch.setattr("behaviors.profile_names.installed_profiles", lambda: {"hasty": None})
    assert said in refused("sweep", *words)


@pytest.mark.parametrize(
    "name", ["Foo", "Boo", "Bot", "Boots", "Delet", "DeleteUserFlsh", "BluetoothFactoryRest", "IOMapWrit"]
)
def test_a_mistyped_name_never_leads_to_a_command_that_destroys(name, refused):
    said = refused("send", name, "--nxt", "sim://")
    hint = said.split("Did you mean" if "Did you mean" in said else "There are")[1]
    for word in ("Boot", "Delete", "DeleteUserFlash", "BluetoothFactoryReset", "CropDataFile", "IOMapWrite"):
        assert word not in hint.replace(",", " ").replace("?", " ").replace(".", " ").split()


@pytest.mark.parametrize(
    "words",
    [
        ["motor", "turn", "A", "1e9"],
        ["motor", "turn", "A", "-inf"],
        ["motor", "run", "A", "--seconds", "-1"],
        ["sensor", "watch", "4", "--every", "0"],
        ["monitor", "--every", "0"],
        ["motor", "run", "A", "--power", "300"],
        ["motor", "turn", "A", "90", "--speed", "5000"],
        ["message", "read", "1", "--wait", "-1"],
        ["message", "write", "11", "hello"],
        ["tone", "44"],
        ["serve", "--port", "70000"],
        ["sweep", "--classes", ""],
        ["sweep", "--agents", " ,"],
        ["sim", "serve", "--tcp", "0", "--camera-port", "99999"],
        ["detect", "try", "sim", "--color", "red", "--hfov-deg", "200"],
        ["detect", "try", "sim", "--color", "red", "--frames", "0"],
    ],
)
def test_values_out_of_range_are_usage_errors(words, refused):
    refused(*words)


HUGE = "9" * 5000
"""More digits than Python reads."""


@pytest.mark.parametrize(
    "words",
    [
        ["info", "--nxt", f"tcp://localhost:{HUGE}"],
        ["detect", "try", HUGE, "--color", "red"],
        ["detect", "try", "3000000000", "--color", "red"],
        ["detect", "try", "~nosuchuser/x.png", "--color", "red"],
        ["run", "--camera", "~nosuchuser/x.png"],
        ["what-if", f"open:{HUGE}"],
        ["sweep", "--map", f"open:{HUGE}:oracle"],
        ["web", "--classroom", HUGE],
    ],
    ids=lambda words: " ".join(words)[:40],
)
def test_numbers_of_thousands_of_digits_and_unknown_users_are_refused(words, refused):
    assert refused(*words).startswith("nxtdrive: ")


@pytest.mark.parametrize("seeds", [HUGE, f"1-{HUGE}", "1-999999999999999", "5-1"])
def test_seeds_that_are_too_many_are_refused(seeds, refused):
    assert "100,000 seeds" in refused("sweep", "--classes", "open", "--seeds", seeds)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["doctor", "--nxt", "sim://", "--mission", "nosuch.toml"], "nosuch.toml"),
        (["monitor", "--once", "--sensor", "4=ultrasonic", "--sensor", "4=touch"], "port 4 twice"),
    ],
)
def test_mistakes_between_arguments_are_reported_at_once(words, says, capsys):
    assert main(words) == USAGE
    captured = capsys.readouterr()
    assert says in captured.err
    assert captured.out == ""


def test_a_brick_is_renamed_and_nothing_on_it_is_lost(capsys, tmp_path):
    from nxtdrive.brick import Brick
    from nxtdrive.cli.commands import name as command
    from nxtdrive.cli.main import _parse
    from nxtdrive.transports import open_transport

    args = _parse(["name", "Robot 7", "--json"])
    with Brick(open_transport("sim://")) as brick:
        brick.files.write("diary.txt", b"dear diary")
        before = brick.info()
        command.rename(args, brick)
        after = brick.info()
        assert brick.files.read("diary.txt") == b"dear diary"
    assert json.loads(capsys.readouterr().out) == {"name": "Robot 7", "before": before.name}
    assert (after.name, after.free_flash, after.bluetooth_address) == (
        "Robot 7",
        before.free_flash,
        before.bluetooth_address,
    )


def test_without_a_new_name_the_present_one_is_printed(capsys):
    assert main(["name", "--nxt", "sim://"]) == DONE
    assert capsys.readouterr() == ("NXT\n", "")


def test_renaming_the_simulated_brick_by_mistake_is_noticed(capsys):
    assert main(["name", "Robot 7"]) == DONE
    said = capsys.readouterr()
    assert said.out == "renamed 'NXT' to 'Robot 7'\n"
    assert said.err.startswith("note: this was the simulated brick")


@pytest.mark.parametrize("name", ["", " ", "1234567890123456", "Röbot", "a\nb", "\x1b[31m", " x", "a\0b"])
def test_a_name_that_the_brick_cannot_show_is_refused(name, refused):
    assert "1 to 15" in refused("name", name)


def test_a_detector_is_tried_on_the_simulated_camera(printed, tmp_path):
    seen = tmp_path / "seen.png"
    lines = printed("detect", "try", "sim", "--color", "orange", "--frames", "2", "--out", seen).splitlines()
    assert lines[0].startswith("height: 297 mm")
    assert lines[1].startswith("frame    0  orange at ")
    assert lines[-1].startswith("seen in 2 of 2 frames")
    assert seen.exists()


def test_values_given_to_a_sweep_twice_count_once():
    parser = argparse.ArgumentParser()
    sweep.add_arguments(parser)
    given = parser.parse_args(["--classes", "open,far,open", "--agents", "oracle, oracle"])
    assert (given.classes, given.profiles) == (["open", "far"], ["oracle"])


@pytest.mark.parametrize("action", ["serve", "exec"])
def test_the_default_world_is_named_by_the_option_that_replaces_it(action, printed):
    assert f"bundled world (default: {DEFAULT_WORLD})" in " ".join(printed("sim", action, "--help").split())
