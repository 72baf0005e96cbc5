"""Record what programs do on a firmware: ``python -m tools.dev.record_programs OUT.jsonl.gz VERSION=COMMAND ...``.

COMMAND starts a firmware that answers telegrams in hex and the control lines of docs/firmware.md section 0.1 on its
standard input and output. The programs are those of tests/golden/programs; for firmware 1.32 NAME.1.32.rxe is taken if
there is one. A program without a file for a firmware is left out.
"""

from __future__ import annotations

import gzip
import json
import shlex
import subprocess
from argparse import ArgumentTypeError
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from ..conformance.program_run import Exchange, events_of, given_files, run_program
from .faults.program_mutation import COMPILED
from .program import parser


@contextmanager
def firmware(command: str) -> Iterator[Exchange]:
    """Start a firmware that has just been switched on."""
    words = shlex.split(command)
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:  # noqa: S603
        assert process.stdin is not None and process.stdout is not None  # noqa: S101, PT018 - they are pipes
        to, answers = process.stdin, process.stdout

        def exchange(line: str) -> str:
            to.write(line + "\n")
            to.flush()
            return answers.readline().rstrip("\n")

        yield exchange
        to.close()


def compiled(source: Path, version: str) -> Path:
    """Return the file of a program for a firmware; it may not exist."""
    own = source.with_suffix(f".{version}.rxe")
    return own if own.exists() else source.with_suffix(".rxe")


def record(source: Path, version: str, command: str) -> dict[str, object]:
    """Run one program on a firmware."""
    program, text = compiled(source, version), source.read_text()
    with firmware(command) as exchange:
        run = run_program(exchange, program.read_bytes(), events_of(text), given_files(text))
    return {
        "program": source.stem,
        "firmware": version,
        "file": program.name,
        "samples": run.samples,
        "files": run.files,
    }


def _version_and_command(text: str) -> tuple[str, str]:
    version, equals, command = text.partition("=")
    if not (version and equals and command):
        raise ArgumentTypeError(f"{text!r} is not VERSION=COMMAND")
    return version, command


def main() -> None:
    """Record all programs on all firmwares."""
    arguments = parser(__doc__)
    arguments.add_argument("out", metavar="OUT.jsonl.gz", type=Path)
    arguments.add_argument("firmwares", metavar="VERSION=COMMAND", nargs="+", type=_version_and_command)
    args = arguments.parse_args()
    sources = sorted(path for path in COMPILED.iterdir() if path.suffix in (".nxc", ".nbc"))
    lines = [
        json.dumps(record(source, version, command), separators=(",", ":"), sort_keys=True)
        for version, command in args.firmwares
        for source in sources
        if compiled(source, version).exists()
    ]
    args.out.write_bytes(gzip.compress("\n".join(lines).encode() + b"\n", mtime=0))


if __name__ == "__main__":
    main()
