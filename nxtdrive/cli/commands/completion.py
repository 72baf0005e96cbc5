"""``nxtdrive completion``: scripts for shells."""

from __future__ import annotations

import argparse
from pathlib import Path

from nxtdrive.cli.main import COMMANDS, DONE, make_parser
from nxtdrive.cli.output import write_text
from nxtdrive.host.environment import require

DESCRIPTION = """\
Print a script with which a shell completes commands, actions, options, and the names
of files. Printing it needs the extra nxtdrive[completion]; using it does not."""
EXAMPLES = """\
  nxtdrive completion bash > ~/.local/share/bash-completion/completions/nxtdrive
  nxtdrive completion zsh > ~/.zfunc/_nxtdrive       # a folder of $fpath
  nxtdrive completion fish > ~/.config/fish/completions/nxtdrive.fish"""

SHELLS = ("bash", "zsh", "fish")
_FOLDERS, _FILES = ("FOLDER",), ("FILE", "RUN", "PICTURE", "IMAGE", "VIDEO")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments."""
    parser.add_argument("shell", choices=SHELLS, help="the shell in which to complete")


def run(args: argparse.Namespace) -> int:
    """Print the script; returns the exit code."""
    require("completion", "shtab", what="making the script")
    import shtab

    parser = make_parser(COMMANDS)
    _prepare(parser)
    write_text(shtab.complete(parser, shell=args.shell).rstrip("\n"))
    return DONE


def _prepare(parser: argparse.ArgumentParser) -> None:
    """Complete the arguments that name files and folders, and of the others only what can be written as it is."""
    import shtab

    for action in parser._actions:  # argparse has no public list of a parser's arguments
        if isinstance(action, argparse._SubParsersAction):
            for each in set(action.choices.values()):
                _prepare(each)
        elif action.metavar in _FOLDERS:
            action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]  # as shtab expects
        elif action.type is Path or action.metavar in _FILES:
            action.complete = shtab.FILE  # type: ignore[attr-defined]
        elif action.choices is not None:  # `package.module:Class` stands for a name; zsh takes its colon for syntax
            action.choices = [each for each in action.choices if ":" not in str(each)]
