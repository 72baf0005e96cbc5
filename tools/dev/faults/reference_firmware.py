"""Campaign: what damaged programs do on the simulated brick and on LEGO's firmware, which is given as a command.

The command starts a firmware that answers telegrams in hex and the control lines of docs/firmware.md section 0.1 on its
standard input and output. Both get the same program and the same telegrams.
"""

from __future__ import annotations

import shlex
import signal
import subprocess
import time
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from random import Random
from typing import NamedTuple

from firmware_protocol.direct import GetCurrentProgramName, StartProgram, StopProgram
from firmware_protocol.iomap import COMMAND
from firmware_protocol.system import Close, IOMapRead, OpenWrite, Write
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.versions import VERSIONS
from sim_backend.firmware.vm.memory import aligned

from ...conformance.bench import Bench
from .campaign import Campaign, GuaranteeViolated, Tally, Violation
from .hostile import mutated
from .program_mutation import COMPILED, damaged
from .programs import TIME_LIMIT_S, random_program

HANG_S = 0.03
"""Processor time after which the firmware counts as hanging; most programs take a fifth of that."""

STEPS_MS = (8, 1, 2, 3, 10, 20, 60)
"""How long a program runs before each query of its status."""

NAME = "a.rxe"
_PIECE, _LONGEST = 58, 6000
"""Bytes of a file in a telegram, and largest size of a program that is damaged."""
_RANDOM_SHARE = 0.25
_CLUMPS_AT = 34
"""Where the number of clumps is in a program file."""
_READ, _READS = 54, 10
_AFTER_POOL = (b"1\0", b"\xff", b"\x01\0\0", Random(1).randbytes(997))  # noqa: S311 - repeatable
"""Bytes that may be in the memory after the pool."""
_OTHER_SEED = 1
_STATUS = COMMAND.field("ProgStatus").read().encode().hex()
_OFFSETS = COMMAND.between("OffsetDS", "OffsetDVA").read().encode().hex()


class ReferenceFirmware(NamedTuple):
    """A firmware version as a program.

    Attributes:
        version: The version.
        command: Starts it.
        poisoned: Starts a variant whose memory begins with other bytes, if any; what differs on it is undefined.
    """

    version: str
    command: tuple[str, ...]
    poisoned: tuple[str, ...] = ()


def parse(commands: Sequence[str], poisoned: Sequence[str]) -> tuple[ReferenceFirmware, ...]:
    """Return the firmwares of options of the form ``VERSION=COMMAND``."""
    others = dict(text.split("=", 1) for text in poisoned)
    found = (text.split("=", 1) for text in commands)
    return tuple(ReferenceFirmware(v, tuple(shlex.split(c)), tuple(shlex.split(others.get(v, "")))) for v, c in found)


def campaign(references: tuple[ReferenceFirmware, ...], folder: Path = COMPILED) -> Campaign:
    """Return the campaign with these firmwares; the compiled programs of the folder are damaged."""
    return Campaign(
        guarantee="Damaged programs end on the simulated brick with the status that LEGO's firmware gives them.",
        unit="programs",
        count=20_000,
        batch=20,
        run=partial(run, references, folder),
    )


def run(references: tuple[ReferenceFirmware, ...], folder: Path, seed: int, numbers: range) -> Tally:
    """Compare these programs."""
    tally = Tally()
    for number in numbers:
        rng = Random(f"{seed} {number}")  # noqa: S311 - repeatable
        reference = rng.choice(references)
        content = _content(rng, _compiled(folder, reference.version))
        try:
            outcome, seconds = compare(reference, content)
            tally.longest_s = max(tally.longest_s, seconds)
            if seconds > TIME_LIMIT_S:
                raise GuaranteeViolated(f"it took {seconds:.0f} s")
            tally.outcomes[f"{reference.version}: {outcome}"] += 1
        except GuaranteeViolated as violated:
            tally.violations.append(Violation(number, f"{reference.version}: {violated} {content.hex()}"))
    return tally


@cache
def _compiled(folder: Path, version: str) -> list[bytes]:
    """Return the compiled programs; those with a version in their name are for that one only."""
    every = [path for path in sorted(folder.glob("*.rxe")) if path.stat().st_size <= _LONGEST]
    return [path.read_bytes() for path in every if path.stem.partition(".")[2] in ("", version)]


def _content(rng: Random, compiled: list[bytes]) -> bytes:
    if rng.random() < _RANDOM_SHARE:
        return mutated(rng, random_program(rng))
    original = rng.choice(compiled)
    content = original
    while content == original:
        content = damaged(rng, original)
    return content


def compare(reference: ReferenceFirmware, content: bytes) -> tuple[str, float]:
    """Return a program's outcome, and the simulated brick's processor time in seconds.

    Raises:
        GuaranteeViolated: The simulated brick fails, or shows another status.
    """
    lines = conversation(reference.version, content)
    expected = answers(reference.command, lines)
    begun = time.process_time()
    try:
        found = simulated(reference.version, lines)
    except Exception as error:
        raise GuaranteeViolated(repr(error)) from error
    seconds = time.process_time() - begun
    if expected is None:
        return "LEGO's firmware hangs or crashes", seconds
    if found == expected:
        return f"same in all, {'runs' if '02' in _statuses(lines, found) else 'refused'}", seconds
    if reference.poisoned and answers(reference.poisoned, lines) != expected:
        return "memory that LEGO's firmware did not initialise", seconds
    if simulated(reference.version, lines, seed=_OTHER_SEED) != found:
        return "random numbers", seconds
    if any(simulated(reference.version, lines, after_pool) != found for after_pool in _AFTER_POOL):
        return "memory outside of the pool", seconds
    theirs, ours = _statuses(lines, expected), _statuses(lines, found)
    if theirs != ours:
        raise GuaranteeViolated(f"status {','.join(ours)} instead of {','.join(theirs)}")
    return f"same status, another reply to {_first_difference(lines, expected, found)}", seconds


def conversation(version: str, content: bytes) -> list[str]:
    """Return the telegrams and control lines: store the program, start it, query its status, stop it, read the results.

    The records of the clumps, with which the pool begins, have addresses of LEGO's firmware and are left out.
    """
    pieces = [content[at : at + _PIECE] for at in range(0, len(content), _PIECE)]
    requests = [OpenWrite(NAME, len(content)).encode(), *(Write(0, piece).encode() for piece in pieces)]
    requests += [Close(0).encode(), StartProgram(NAME).encode()]
    lines = ["!sensor 1 600", "!sensor 2 400", *(request.hex() for request in requests)]
    name = GetCurrentProgramName().encode().hex()
    for milliseconds in STEPS_MS:
        lines += [f"!tick {milliseconds}", _STATUS, name]
    records = content[_CLUMPS_AT] * VERSIONS[version].pool.clump if len(content) > _CLUMPS_AT else 0
    begin = COMMAND.field("MemoryPool").offset + aligned(records)
    reads = [IOMapRead(COMMAND.module_id, begin + at, _READ) for at in range(0, _READ * _READS, _READ)]
    lines += [StopProgram().encode().hex(), "!tick 1", _STATUS, _OFFSETS, "!motors"]
    return lines + [read.encode().hex() for read in reads]


def answers(command: Sequence[str], lines: Sequence[str]) -> list[str] | None:
    """Return the answers of a firmware; None if it hangs or crashes."""
    ended = subprocess.run(  # noqa: S603 - the firmware that was asked for
        command,
        input="\n".join(lines) + "\n",
        capture_output=True,
        text=True,
        check=False,
        preexec_fn=partial(signal.setitimer, signal.ITIMER_PROF, HANG_S),
    )
    found = ended.stdout.splitlines()
    return None if len(found) != len(lines) or any(line.startswith("!") for line in found) else found


def simulated(version: str, lines: Sequence[str], after_pool: bytes = b"\0", seed: int = 0) -> list[str]:
    """Return the answers of a simulated brick.

    Args:
        version: Its firmware.
        lines: The telegrams and control lines.
        after_pool: What is repeated in the memory after its pool.
        seed: Seed of the random numbers that programs draw.
    """
    brick = SimBrick(firmware=version, seed=seed)
    brick.command.after_pool = after_pool
    bench = Bench(brick)
    return [bench.answer(line) for line in lines]


def _statuses(lines: Sequence[str], found: Sequence[str]) -> list[str]:
    return [answer[-2:] for line, answer in zip(lines, found, strict=True) if line == _STATUS]


def _first_difference(lines: Sequence[str], expected: Sequence[str], found: Sequence[str]) -> str:
    names: Mapping[str, str] = {"!motors": "motors", _OFFSETS: "OffsetDS and OffsetDVA"}
    at = next(i for i, pair in enumerate(zip(expected, found, strict=True)) if pair[0] != pair[1])
    return names.get(lines[at], "variables" if at >= len(lines) - _READS else "telegrams")
