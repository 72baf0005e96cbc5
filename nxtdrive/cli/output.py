"""What the command line writes: escaped text, JSON, and tables and live lines drawn with rich.

Text from outside never reaches the terminal unescaped. Commands write with the functions of this module, which escape
what a terminal would interpret (`firmware_protocol.printable`); `guarded_output` is the last resort.
"""

from __future__ import annotations

import codecs
import contextlib
import json
import os
import sys
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, TextIO, cast

from firmware_protocol.errors import ConfigError
from firmware_protocol.printable import printable, printable_lines
from input_files.mistakes import counted
from nxtdrive.host.unbuffered import write_all

if TYPE_CHECKING:
    from rich.table import Table

    from nxtdrive.cli.safe_console import SafeConsole
    from nxtdrive.mission.checking import Findings

CONTINUED = "\n  "
"""Begins a further line of an error message, such as the next mistake in a file."""

DEFAULT_WIDTH = 80
"""Columns of a terminal whose width is not known."""

_SPELLED = {
    "°": " deg",
    "±": "+/-",
    "²": "^2",
    "×": "x",
    "·": "|",
    "µ": "u",
    "–": "-",
    "—": "-",
    "…": "...",
    "→": "->",
}
"""Replacements in our own texts for characters that the output's encoding lacks, as under ``LC_ALL=C``."""

_ERRORS = "nxtdrive.spelled"


def write_line(text: object, *, flush: bool = False) -> None:
    """Print one line, escaped."""
    print(printable(text), flush=flush)


def write_text(text: object, *, flush: bool = False) -> None:
    """Print several lines, each of them escaped."""
    print(printable_lines(text), flush=flush)


def write_json(value: object, *, indent: int | None = None, flush: bool = False) -> None:
    """Print a value as JSON, in ASCII, valid in every encoding and without terminal control characters."""
    print(json.dumps(value, indent=indent), flush=flush)


def write_content(content: bytes) -> None:
    """Write the content of a file to standard output: as it is, or, where that is a terminal, as escaped text.

    Raises:
        OSError: It cannot be written.
    """
    if sys.stdout is None:  # closed when the program began
        return
    if sys.stdout.isatty():
        print(printable_lines(content.decode(errors="replace")), end="")
        return
    sys.stdout.flush()
    write_all(sys.stdout.buffer, content)  # it has no buffer under ``python -u``


def write_error(message: object, *, sender: str = "nxtdrive: ") -> None:
    """Print a message to standard error; of its line feeds only those that begin an indented line are kept."""
    if sys.stderr is not None:  # closed when the program began; `print` would use standard output
        print(sender + CONTINUED.join(map(printable, str(message).split(CONTINUED))), file=sys.stderr)


def report_findings(findings: Mapping[str, Findings], *, as_json: bool) -> None:
    """Print for each file that it is valid, or its mistakes, which go to standard error, and its warnings."""
    if as_json:
        plain = {file: {"mistakes": each.mistakes, "warnings": each.warnings} for file, each in findings.items()}
        write_json([{"file": file, **values} for file, values in plain.items()], indent=2)
        return
    for file, found in findings.items():
        if found.mistakes:
            write_error(CONTINUED.join([f"{file}: {counted(found.mistakes)}", *found.mistakes]), sender="")
        else:
            write_line(f"{file}: good")
        for warning in found.warnings:
            write_line(f"  warning: {warning}")


def print_line(text: str) -> None:
    """Print a line at once, escaped; once the reader has left, print nothing.

    Raises:
        OSError: The line cannot be written for another reason, such as a full disk; further lines are dropped.
    """
    try:
        write_line(text, flush=True)
    except BrokenPipeError:
        drop_output()
    except OSError:
        drop_output()
        raise


def finish_output() -> None:
    """Write what is still buffered.

    Raises:
        BrokenPipeError: The reader has left.
        ConfigError: It cannot be written, as on a full disk; it is dropped.
    """
    try:
        if sys.stdout is not None:  # closed when the program began
            sys.stdout.flush()
    except BrokenPipeError:
        drop_output()
        raise
    except OSError as error:
        drop_output()
        raise ConfigError(
            f"standard output cannot be written ({error.strerror}).", remedy="Send it somewhere else."
        ) from None


def drop_output() -> None:
    """Discard what is still buffered for standard output, and what follows; else Python reports an error at its end."""
    with contextlib.suppress(OSError):  # a stream without a file has nothing buffered
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)


def make_console(*, stderr: bool = False, **options: Any) -> SafeConsole:  # noqa: ANN401 - rich's options
    """Return a rich console that escapes text and treats none of it as markup, on standard output or error."""
    from nxtdrive.cli.safe_console import SafeConsole

    file = sys.stderr if stderr else sys.stdout
    console = SafeConsole(file=getattr(file, "stream", file), markup=False, emoji=False, highlight=False, **options)
    if not console.width:  # with COLUMNS=0 in the environment rich would print nothing
        console.width = DEFAULT_WIDTH
    return console


def make_table(*headers: str, **options: Any) -> Table:  # noqa: ANN401 - rich's options
    """Return a rich table whose columns lose no text in a narrow terminal."""
    from rich.table import Column, Table

    return Table(*(Column(header, overflow="fold") for header in headers), **options)


@contextlib.contextmanager
def guarded_output() -> Iterator[None]:
    """Escape text written to standard output and error in the block, and replace characters that their encoding lacks.

    This is a net for text that was not escaped where it was printed: it keeps line feeds and tabs. What `make_console`
    makes writes past it and escapes by itself. When an error leaves the block the net stays, for the traceback.
    """
    codecs.register_error(_ERRORS, _spelled)
    with contextlib.ExitStack() as restoring:
        for name in ("stdout", "stderr"):
            stream = getattr(sys, name)
            if stream is None or isinstance(stream, _Guard):
                continue
            setattr(sys, name, _Guard(stream))
            restoring.callback(setattr, sys, name, stream)
            if hasattr(stream, "reconfigure"):
                errors = stream.errors
                stream.reconfigure(errors=_ERRORS)
                restoring.callback(stream.reconfigure, errors=errors)
        try:
            yield
        except Exception:
            restoring.pop_all()
            raise


class _Guard:
    """A text stream that escapes what is written to `stream`."""

    def __init__(self, stream: TextIO) -> None:
        self.stream = stream

    def write(self, text: str) -> int:
        """Write a text, escaped but for its line feeds and tabs; return its length before that."""
        escaped = "\t".join(map(printable_lines, text.split("\t")))
        self.stream.write(escaped)
        return len(text)

    def writelines(self, lines: list[str]) -> None:
        """Write texts one after the other, as `write` does."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - whatever the stream has
        return getattr(self.stream, name)


def _spelled(error: UnicodeError) -> tuple[str, int]:
    """Replace characters that cannot be encoded: by `_SPELLED`, else by escapes."""
    lost = cast("UnicodeEncodeError", error)
    characters = lost.object[lost.start : lost.end]
    words = (_SPELLED.get(each) or each.encode("unicode_escape").decode("ascii") for each in characters)
    return "".join(words), lost.end
