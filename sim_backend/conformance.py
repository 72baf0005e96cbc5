"""Hold the simulated brick against recorded conversations with LEGO's firmware.

A recording says what was sent to the firmware or done to its hardware, and what came back (docs/firmware.md sections
0.1 and 0.2). `replay` does the same to a fresh simulated brick and says, in words, where the first difference is. From
the command line: ``nxtdrive sim check``, or without the driver::

    python -m sim_backend.conformance tests/golden/firmware.jsonl
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from firmware_protocol.errors import ConfigError
from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Kind
from sim_backend.conformance_bench import Bench, NotOnThisBench
from sim_backend.conformance_handles import Handles
from sim_backend.conformance_recording import Step, load
from sim_backend.firmware.brick import FIRMWARES, SimBrick

_INTERRUPTS = re.compile(r" irqs=\d+")
"""How often the recording's timer fired: a property of its stub hardware, not of the firmware or the bus."""


@dataclass(frozen=True)
class Report:
    """How a scenario went.

    Attributes:
        scenario: Its name.
        steps: How many there are.
        matched: How many were the same.
        step: Number of the first that was not, or None.
        difference: What was different there, in words, or empty.
    """

    scenario: str
    steps: int
    matched: int
    step: int | None
    difference: str

    def __str__(self) -> str:
        verdict = "same" if self.step is None else f"step {self.step}: {self.difference}"
        return f"{self.scenario}: {self.matched}/{self.steps} {verdict}"


def replay(scenario: str, steps: Iterable[Step], firmware: str) -> Report:
    """Do to a fresh simulated brick what was done to the firmware."""
    steps = list(steps)
    bench, handles = Bench(SimBrick(firmware=firmware)), Handles()
    different = []
    for step in steps:
        try:
            difference = _compare(step, _perform(step, bench, handles))
        except NotOnThisBench as reason:
            difference = str(reason)
        if difference:
            different.append((step.number, difference))
    first = different[0] if different else (None, "")
    return Report(scenario, len(steps), len(steps) - len(different), *first)


def _perform(step: Step, bench: Bench, handles: Handles) -> str:
    """Do what a step says; returns what comes back."""
    if not step.request:
        return bench.control(handles.translate_line(step.control))
    request = bytes.fromhex(step.request)
    got = bench.telegram(handles.translate(request).hex())
    handles.learn(request, bytes.fromhex(step.reference), bytes.fromhex(got))
    return got


def _compare(step: Step, got: str) -> str:
    """What differs, in words, or nothing."""
    if step.request or step.mask:
        return _compare_telegrams(step, got)
    expected, got = _INTERRUPTS.sub("", step.reply), _INTERRUPTS.sub("", got)
    if expected == got:
        return ""
    for number, (theirs, ours) in enumerate(zip(expected.split(";"), got.split(";"), strict=False)):
        if theirs != ours:
            return f"{step.control}: entry {number} is {ours!r}, the firmware's is {theirs!r}"
    return f"{step.control}: {got!r}, the firmware's is {expected!r}"


def _compare_telegrams(step: Step, got: str) -> str:
    sent = step.request or step.control
    theirs, ours = bytes.fromhex(step.reply), bytes.fromhex(got)
    if len(theirs) != len(ours):
        return f"{sent}: reply {got or 'none'}, the firmware's is {step.reply or 'none'}"
    mask = bytes.fromhex(step.mask)[: len(theirs)].ljust(len(theirs), b"\xff")
    for offset, (their, our, compare) in enumerate(zip(theirs, ours, mask, strict=True)):
        if (their ^ our) & compare:
            field = _field(bytes.fromhex(step.request), offset)
            return f"{sent}: {field} is 0x{our:02x}, the firmware's is 0x{their:02x} ({got}, not {step.reply})"
    return ""


def _field(request: bytes, offset: int) -> str:
    """Name of the reply's field at `offset`."""
    if request and offset < REPLY_HEADER:
        return ("kind", "opcode", "status")[offset]
    command = COMMANDS.get((Kind(request[0] & ~NO_REPLY), request[1])) if len(request) > 1 else None
    if command is not None:
        layout = command.reply_type.layout
        for name, (start, end) in layout.spans.items():
            if start <= offset - REPLY_HEADER < end:
                return f"{name}, byte {offset - REPLY_HEADER - start}"
        if layout.tail:
            return f"{layout.tail}, byte {offset - REPLY_HEADER - layout.size}"
    return f"byte {offset}"


def reports(path: Path, firmware: str) -> Iterator[Report]:
    """A report for each scenario of a recording.

    Raises:
        ConfigError: It is no recording.
    """
    for name, steps in load(path, firmware).items():
        yield replay(name, steps, firmware)


def main(arguments: list[str]) -> int:
    """Print what differs for both firmwares; 0 if nothing does, 1 if something does, 2 without a readable recording."""
    if len(arguments) != 1:
        print("Give one recording, such as tests/golden/firmware.jsonl.", file=sys.stderr)
        return 2
    different = 0
    for firmware in FIRMWARES:
        try:
            found = list(reports(Path(arguments[0]), firmware))
        except ConfigError as error:
            print(error, file=sys.stderr)
            return 2
        wrong = [report for report in found if report.difference]
        different += len(wrong)
        for report in wrong:
            print(f"{firmware} {report}")
        print(f"{firmware}: {len(found) - len(wrong)} of {len(found)} scenarios are the same")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
