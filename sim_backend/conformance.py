"""Hold the simulated brick against recorded conversations with LEGO's firmware.

A recording is a file of JSON lines, described in docs/firmware.md sections 0.1 and 0.2: what was sent to the firmware
or done to its hardware, and what came back. `replay` does the same to a fresh simulated brick and says, in words, where
the first difference is. From the command line::

    python -m sim_backend.conformance tests/golden/firmware.jsonl
"""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Kind
from sim_backend.conformance_bench import Bench, NotOnThisBench
from sim_backend.conformance_handles import Handles
from sim_backend.firmware.brick import FIRMWARES, SimBrick

_INTERRUPTS = re.compile(r" irqs=\d+")
"""How often the recording's timer fired: a property of its stub hardware, not of the firmware or the bus."""


@dataclass(frozen=True)
class Step:
    """One exchange.

    Attributes:
        number: Its number in the scenario.
        request: A telegram to the firmware in hex, or empty.
        control: Something done to the hardware, or empty.
        reply: What came back; several replies in hex are separated by spaces.
        reference: What the firmware the recording was made with replied: firmware 1.29.
        mask: Hex; bytes 00 are not compared.
    """

    number: int
    request: str
    control: str
    reply: str
    reference: str
    mask: str


@dataclass(frozen=True)
class Report:
    """How a scenario went.

    Attributes:
        scenario: Its name.
        steps: How many there are.
        matched: How many matched before the first difference.
        difference: The first difference in words, or empty.
    """

    scenario: str
    steps: int
    matched: int
    difference: str

    def __str__(self) -> str:
        verdict = "same" if not self.difference else f"step {self.matched}: {self.difference}"
        return f"{self.scenario}: {self.matched}/{self.steps} {verdict}"


def load(path: Path, firmware: str) -> dict[str, list[Step]]:
    """The scenarios of a recording by name, with the replies of one firmware, "1.29" or "1.05"."""
    other = {"1.05": "reply_lego105"}.get(firmware, "reply")
    scenarios: dict[str, list[Step]] = {}
    for line in path.read_text(encoding="utf-8").splitlines():
        record = json.loads(line)
        reply = record.get(other, record["reply"])
        step = Step(
            number=record["step"],
            request=record.get("request", ""),
            control=record.get("control", ""),
            reply=reply,
            reference=record["reply"],
            mask=record.get("mask", ""),
        )
        scenarios.setdefault(record["scenario"], []).append(step)
    return scenarios


def replay(scenario: str, steps: Iterable[Step], firmware: str) -> Report:
    """Do to a fresh simulated brick what was done to the firmware, up to the first difference."""
    steps = list(steps)
    bench, handles = Bench(SimBrick(firmware=firmware)), Handles()
    for matched, step in enumerate(steps):
        try:
            got = _perform(step, bench, handles)
        except NotOnThisBench as reason:
            return Report(scenario, len(steps), matched, str(reason))
        if difference := _compare(step, got):
            return Report(scenario, len(steps), matched, difference)
    return Report(scenario, len(steps), len(steps), "")


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
    """A report for each scenario of a recording."""
    for name, steps in load(path, firmware).items():
        yield replay(name, steps, firmware)


def main(arguments: list[str]) -> int:
    """Print what differs for both firmwares; 0 if nothing does, 1 if something does, 2 without a readable recording."""
    if len(arguments) != 1 or not Path(arguments[0]).is_file():
        print("Give one recording, such as tests/golden/firmware.jsonl.", file=sys.stderr)
        return 2
    different = 0
    for firmware in FIRMWARES:
        found = list(reports(Path(arguments[0]), firmware))
        wrong = [report for report in found if report.difference]
        different += len(wrong)
        for report in wrong:
            print(f"{firmware} {report}")
        print(f"{firmware}: {len(found) - len(wrong)} of {len(found)} scenarios are the same")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
