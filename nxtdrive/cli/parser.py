"""The parser of the command line: its help texts, and its error messages."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Any, NoReturn

ROOM = "sim://WORLD.toml"
ELSEWHERE = {
    ROOM: ("--world", "--room", "--sim", "--simulated"),
    "usb://": ("--usb", "--brick", "--address", "--device", "--port"),
}
"""Addresses for ``--nxt``, and options of other programs with that purpose."""

OTHER_WORDS = {
    "--help": ("help",),
    "--version": ("version",),
    "run": ("start", "go", "simulate"),
    "teleop": ("drive", "remote"),
    "motor stop": ("stop", "halt", "brake"),
    "detect try": ("camera", "photo", "picture"),
    "export RUN --html": ("replay", "video", "play"),
    "web": ("watch", "show", "gui"),
}
"""Commands, and other words for what they do."""


class Help(argparse.HelpFormatter):
    """Fills paragraphs to the terminal's width; those with indented lines, such as examples, stay as they are."""

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        import textwrap

        paragraphs = text.split("\n\n")
        return "\n\n".join(
            paragraph
            if "\n " in f"\n{paragraph}"
            else textwrap.fill(
                paragraph, width, initial_indent=indent, subsequent_indent=indent, break_on_hyphens=False
            )
            for paragraph in paragraphs
        )

    def _split_lines(self, text: str, width: int) -> list[str]:
        import textwrap

        return textwrap.wrap(" ".join(text.split()), width, break_on_hyphens=False)  # nxt-server://, built-in


class Parser(argparse.ArgumentParser):
    """A parser whose error messages suggest what was meant and point to the help."""

    def __init__(self, *args: Any, **options: Any) -> None:  # noqa: ANN401 - argparse's
        super().__init__(*args, **options)
        # argparse takes other negative numbers, such as -1e3, for options
        self._negative_number_matcher = re.compile(r"-(\d|\.\d|inf|nan)", re.IGNORECASE)
        self._given: list[str] = []
        self.color = False  # from Python 3.14 on its texts would have colours, which `guarded_output` escapes

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # noqa: ANN401 - argparse's
        """Parse, and keep the arguments for error messages."""
        self._given = list(sys.argv[1:] if args is None else args)
        found, left = super().parse_known_args(args, namespace)
        lists = [action for action in self._get_positional_actions() if action.nargs in ("+", "*")]
        if lists and left and not any(word.startswith("-") for word in left):
            # argparse fills a list from one place: in `A --json B` it leaves B over
            try:
                getattr(found, lists[0].dest).extend(self._get_values(lists[0], left))
            except argparse.ArgumentError as error:
                self.error(str(error))
            left = []
        return found, left

    def reject(self, unknown: Sequence[str]) -> NoReturn:
        """Refuse the arguments that are left over, suggesting options."""
        options = [option for option in self._option_string_actions if option.startswith("--")]
        wrong = next((word.partition("=")[0] for word in unknown if word.startswith("--")), "")
        # without the dashes, which make short words similar
        meant = [option for option in options if _suggestion(wrong.lstrip("-"), [option.lstrip("-")])]
        hint = f". Give {wrong} after `{self.prog}`" if wrong in options else self._elsewhere(wrong, unknown)
        self.error(f"unrecognized arguments: {' '.join(unknown)}{hint or _suggestion(wrong, meant)}")

    def _elsewhere(self, wrong: str, unknown: Sequence[str]) -> str:
        """Suggest how else to give what was given by an option that is not there, or without one."""
        for name in (str(action.metavar) for action in self._get_positional_actions()):
            if wrong == f"--{name.partition('.')[0].lower()}":
                return f". {name} is given without an option: `{self.prog} {name}`"
        values = (word.partition("=")[2] if word.startswith("--") else word for word in unknown)
        file = next((value for value in values if value.endswith(".toml")), "")
        if file and not wrong and "--mission" in set(self._option_string_actions) - set(self._given):
            return f". Did you mean `--mission {file}`?"
        address = next((address for address, others in ELSEWHERE.items() if wrong in others), "")
        if file and not wrong:
            address = ROOM
        if address and "--nxt" in self._option_string_actions:
            return f". Did you mean `--nxt {address.replace('WORLD.toml', file or 'WORLD.toml')}`?"
        return ""

    def _check_value(self, action: argparse.Action, value: Any) -> None:  # noqa: ANN401 - argparse's
        if action.choices is not None and value not in action.choices:
            known = [str(choice) for choice in action.choices]
            hint = _suggestion(str(value), known) or f" (choose from {', '.join(known)})"
            option = self._option_before(value)
            if isinstance(action, argparse._SubParsersAction) and _any_has_option(action.choices.values(), option):
                hint = f" (choose from {', '.join(known)}). Give {option} after the {action.metavar}"
            command = next((command for command, words in OTHER_WORDS.items() if value in words), "")
            if "teleop" in known and command:
                hint = f". Did you mean `{self.prog} {command}`?"
            if "run" in known and str(value).endswith(".toml"):
                hint = f". Did you mean `{self.prog} run {value}`?"
            raise argparse.ArgumentError(action, f"invalid choice: {value!r}{hint}")

    def _option_before(self, value: object) -> str:
        """Return the option that a word follows on the command line; argparse takes its value for an action."""
        pairs = pairwise(self._given)
        return next((option for option, word in pairs if word == value and option.startswith("--")), "")

    def error(self, message: str) -> NoReturn:
        """Print the mistake and exit."""
        super().error(f"{message}\nSee `{self.prog} --help`.")


def _any_has_option(parsers: Iterable[argparse.ArgumentParser], option: str) -> bool:
    return any(option in parser._option_string_actions for parser in parsers)


def _suggestion(word: str, known: Sequence[str]) -> str:
    from firmware_protocol.wording import did_you_mean

    hint = did_you_mean(word, known, most=2)
    return f". {hint}" if hint else ""
