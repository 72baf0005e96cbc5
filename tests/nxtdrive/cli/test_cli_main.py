"""The command line: help, one sentence for each error, and no heavy imports before they are needed."""

import argparse
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from nxtdrive.cli.main import BLAS_THREADS, COMMANDS, DONE, NO_BRICK, USAGE, _parse, main, make_parser
from nxtdrive.transports import SCHEMES
from nxtdrive.transports.trace_file import Trace

ROOT = Path(__file__).parents[3]
ACTIONS = (
    ("sensor", "read"),
    ("sensor", "watch"),
    ("sensor", "identify"),
    ("sensor", "registers"),
    ("message", "write"),
    ("message", "read"),
    ("mission", "check"),
    ("mission", "show"),
    ("mission", "new"),
    ("detect", "try"),
    ("sim", "serve"),
    ("sim", "exec"),
    ("sim", "check"),
    ("files", "ls"),
    ("files", "get"),
    ("files", "put"),
    ("files", "rm"),
    ("files", "df"),
    ("motor", "run"),
    ("motor", "turn"),
    ("motor", "stop"),
    ("program", "start"),
    ("program", "stop"),
    ("program", "status"),
    ("trace", "show"),
    ("trace", "diff"),
    ("trace", "replay"),
)
HEAVY = ("cv2", "numpy", "usb", "serial", "pydantic", "statemachine", "rich", "pymunk")


def _examples(text):
    return [line.strip() for line in text.splitlines() if line.strip().startswith("nxtdrive ")]


PRODUCT = """
import os
from nxtdrive.cli.main import main
main(["explain", "00 0B"])
import numpy as np
np.ones((500, 500)) @ np.ones((500, 500))
print(len(os.listdir("/proc/self/task")))
"""


@pytest.mark.skipif(not Path("/proc/self/task").exists(), reason="needs /proc")
@pytest.mark.parametrize(("chosen", "threads"), [(None, 1), ("2", min(2, os.cpu_count() or 1))])
def test_matrix_products_take_one_thread_unless_the_user_sets_more(chosen, threads):
    environment = {name: value for name, value in os.environ.items() if name != BLAS_THREADS}
    environment |= {BLAS_THREADS: chosen} if chosen else {}
    command = [sys.executable, "-c", PRODUCT]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines()[-1] == str(threads)


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself_with_examples_that_parse(command, printed):
    text = printed(command, "--help")
    assert text.split("\n\n")[1][0].isalpha()
    examples = _examples(text.split("examples:")[1])
    assert examples
    for example in examples:
        words = shlex.split(re.split(r" [<>] ", example)[0], comments=True)
        args = _parse(words[1:])
        assert args.command == command
        assert callable(args.run)


@pytest.mark.parametrize("words", ACTIONS, ids=" ".join)
def test_every_action_says_in_its_help_what_it_does(words, printed):
    listed = " ".join(printed(words[0], "--help").split()).lower()
    said = printed(*words, "--help").split("\n\n")[1]
    assert " ".join(said.split()).rstrip(".").lower() in listed


@pytest.mark.parametrize("words", ACTIONS, ids=" ".join)
def test_every_action_has_its_examples_in_its_help(words, printed):
    examples = _examples(printed(*words, "--help").split("examples:")[1])
    assert examples
    assert all(f"{example} ".startswith(f"nxtdrive {' '.join(words)} ") for example in examples)


def test_the_help_names_every_command(printed):
    text = printed("--help")
    assert all(command in text for command in COMMANDS)
    assert _examples(text)


def test_help_loads_no_heavy_library():
    code = (
        "import sys\n"
        "from nxtdrive.cli.main import main\n"
        "try:\n    main(['--help'])\n"
        f"except SystemExit:\n    print([name for name in {HEAVY!r} if name in sys.modules])\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_version_is_printed(printed):
    assert printed("--version").startswith("nxtdrive ")


@pytest.mark.parametrize(
    ("words", "helper"),
    [
        ([], "nxtdrive"),
        (["dance"], "nxtdrive"),
        (["info", "--colour"], "nxtdrive info"),
        (["mission"], "nxtdrive mission"),
    ],
)
def test_wrong_usage_is_exit_code_2_and_says_where_help_is(words, helper, refused):
    assert f"See `{helper} --help`." in refused(*words)


def test_no_brick_on_usb_leads_to_the_doctor(capsys, mocker):
    mocker.patch("usb.core.find", return_value=iter(()))
    assert main(["info", "--nxt", "usb://"]) == NO_BRICK
    assert "nxtdrive doctor" in capsys.readouterr().err


@pytest.mark.parametrize("scheme", sorted(SCHEMES.keys() - {"record"}))
def test_the_help_shows_every_kind_of_address(scheme, printed):
    assert f"{scheme}://" in printed("info", "--help")


def test_a_wrong_address_in_the_environment_is_called_that(monkeypatch, refused):
    monkeypatch.setenv("NXT", "warp")
    assert "The address comes from $NXT." in refused("info")
    said = refused("info", "--nxt", "warp://9")
    assert said.startswith("nxtdrive: ")
    assert "usb://" in said
    assert "$NXT" not in said
    monkeypatch.delenv("NXT")
    assert "$NXT" not in refused("info", "--nxt", "")


def _run_with(folder, *words):
    """The command line with `folder` in front of everything, as it is in an ordinary installation."""
    code = (
        "import sys\n"
        "sys.meta_path = [finder for finder in sys.meta_path if 'Editable' not in repr(finder)]\n"
        "from nxtdrive.cli.main import main\n"
        f"sys.exit(main({words!r}))\n"
    )
    return subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": os.pathsep.join((str(folder), str(ROOT)))},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=60,
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    ("options", "sender"), [((), "nxtdrive: warning"), (("-v",), "nxtdrive.transports.trace_file")]
)
def test_a_warning_is_the_programs_and_with_v_that_of_its_module(tmp_path, options, sender):
    (tmp_path / "cut.nxttrace").write_text(Trace("sim://", 64).header() + '\n{"t": 0, "to": "000b"}\n{"t": 0.1, "fr')
    done = _run_with(tmp_path, *options, "trace", "show", "cut.nxttrace")
    assert done.stderr == f"{sender}: the trace cut.nxttrace was cut off in its last line, which is left out.\n"


def test_another_package_called_behaviors_is_named_with_the_remedy(tmp_path):
    (tmp_path / "behaviors").mkdir()
    (tmp_path / "behaviors" / "__init__.py").write_text("__version__ = '0.5.1'\n")
    metadata = tmp_path / "django_behaviors-0.5.1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: django-behaviors\nVersion: 0.5.1\n")
    (metadata / "top_level.txt").write_text("behaviors\n")
    done = _run_with(tmp_path, "mission", "show")
    assert done.returncode == USAGE
    assert "django-behaviors" in done.stderr
    assert "uninstall django-behaviors" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_fault_of_ours_keeps_its_traceback(tmp_path):
    (tmp_path / "pydantic.py").write_text("raise RuntimeError('broken')\n")
    done = _run_with(tmp_path, "mission", "show")
    assert done.returncode == 1
    assert "Traceback" in done.stderr


def test_the_package_runs_as_a_module():
    ran = subprocess.run([sys.executable, "-m", "nxtdrive", "--version"], capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stderr) == (DONE, "")
    assert ran.stdout.startswith("nxtdrive ")


def _parsers(parser):
    yield parser
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from _parsers(below)


@pytest.mark.parametrize("command", COMMANDS)
def test_the_help_fits_into_80_columns_and_breaks_no_word(command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    for parser in _parsers(make_parser([command])):
        lines = parser.format_help().splitlines()
        assert not [line for line in lines if len(line) > 80 or line.endswith(("nxt-", "built-"))]


def test_verbose_shows_the_traceback_and_keeps_the_exit_code(capsys, mocker):
    mocker.patch("usb.core.find", return_value=iter(()))
    assert main(["-v", "info", "--nxt", "usb://"]) == NO_BRICK
    said = capsys.readouterr().err
    assert "Traceback" in said
    assert said.splitlines()[-1].startswith("nxtdrive: ")


@pytest.mark.parametrize(
    ("error", "hint"),
    [
        ("PermissionError(13, 'Permission denied', 'x.toml')", "x.toml cannot be used: Permission denied"),
        ("OSError(28, 'No space left on device')", "No space left on device"),
        ("MemoryError()", "not enough memory"),
        ("RecursionError('maximum recursion depth exceeded')", "nested too deeply"),
    ],
)
def test_what_the_system_refuses_gives_a_sentence(tmp_path, error, hint):
    (tmp_path / "pydantic.py").write_text(f"raise {error}\n")
    done = _run_with(tmp_path, "mission", "show")
    assert done.returncode == USAGE
    assert hint in done.stderr
    assert done.stderr.count("\n") == 1
    done = _run_with(tmp_path, "-v", "mission", "show")
    assert done.returncode == USAGE
    assert "Traceback" in done.stderr


def test_a_fault_of_ours_says_how_to_report_it(tmp_path):
    (tmp_path / "pydantic.py").write_text("raise KeyError('broken')\n")
    assert "Please report it" in _run_with(tmp_path, "mission", "show").stderr.splitlines()[-1]


def test_without_standard_error_messages_do_not_go_to_standard_output(monkeypatch, capsys):
    monkeypatch.setattr(sys, "stderr", None)
    assert main(["world", "show", "nowhere"]) == USAGE
    assert capsys.readouterr().out == ""
