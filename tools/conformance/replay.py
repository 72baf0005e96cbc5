"""Compare the simulated brick with recorded conversations with LEGO's firmware.

A recording lists what was sent to the firmware or done to its hardware, and the replies (docs/firmware.md sections 0.1
and 0.2). `replay` repeats it on a fresh simulated brick and describes the first difference. From the command line:
``nxtdrive sim check FILE.jsonl``.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass

from firmware_protocol.telegram import COMMANDS, NO_REPLY, REPLY_HEADER, Kind
from sim_backend.firmware.brick import SimBrick

from .bench import Bench, NotSupportedOnBench
from .handles import Handles
from .recording import Step

_INTERRUPTS = re.compile(r" irqs=\d+")
"""How often the timer fired during the recording: a property of its stub hardware, not of the firmware or the bus."""


@dataclass(frozen=True)
class Report:
    """Result of replaying one scenario.

    Attributes:
        scenario: Name.
        steps: Number of steps.
        matched: Number of steps with the same result.
        step: Number of the first step that differs, or None.
        difference: Description of that difference, or empty.
    """

    scenario: str
    steps: int
    matched: int
    step: int | None
    difference: str


def replay(scenario: str, steps: Iterable[Step], firmware: str) -> Report:
    """Repeat the steps of a scenario on a fresh simulated brick."""
    steps = list(steps)
    bench, handles = Bench(SimBrick(firmware=firmware)), Handles()
    different = []
    for step in steps:
        try:
            difference = _compare(step, _perform(step, bench, handles))
        except NotSupportedOnBench as reason:
            difference = str(reason)
        if difference:
            different.append((step.number, difference))
    first = different[0] if different else (None, "")
    return Report(scenario, len(steps), len(steps) - len(different), *first)


def _perform(step: Step, bench: Bench, handles: Handles) -> str:
    """Carry out a step and return the reply."""
    if not step.request:
        return bench.control(handles.translate_line(step.control))
    request = bytes.fromhex(step.request)
    got = bench.telegram(handles.translate(request).hex())
    handles.learn(request, bytes.fromhex(step.reference), bytes.fromhex(got))
    return got


def _compare(step: Step, got: str) -> str:
    """Describe the difference, or return an empty string."""
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
    """Name of the field of the reply at `offset`."""
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
