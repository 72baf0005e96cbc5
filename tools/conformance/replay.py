"""Compare the simulated brick with recorded conversations with LEGO's firmware.

A recording lists what was sent to the firmware or done to its hardware, and the replies (docs/firmware.md sections 0.1
and 0.2). `replay` repeats it on a fresh simulated brick and describes the differences. From the command line:
``nxtdrive sim check FILE.jsonl``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sim_backend.firmware.brick import SimBrick

from .bench import Bench, NotSupportedOnBench
from .differences import Difference, compare, sent_name
from .handles import Handles
from .recording import Step


@dataclass(frozen=True)
class Report:
    """Result of replaying one scenario.

    Attributes:
        scenario: Name.
        firmware: Version the simulated brick behaved as.
        steps: Number of steps.
        differences: Steps whose result is not the recorded one.
    """

    scenario: str
    firmware: str
    steps: int
    differences: list[Difference]

    @property
    def matched(self) -> int:
        """Number of steps with the same result."""
        return self.steps - len(self.differences)


def replay(scenario: str, steps: Iterable[Step], firmware: str) -> Report:
    """Repeat the steps of a scenario on a fresh simulated brick."""
    steps = list(steps)
    bench, handles = Bench(SimBrick(firmware=firmware)), Handles()
    differences = [difference for step in steps if (difference := _repeat(step, bench, handles))]
    return Report(scenario, firmware, len(steps), differences)


def _repeat(step: Step, bench: Bench, handles: Handles) -> Difference | None:
    """Execute a step and compare its result; a step that fails differs too."""
    try:
        return compare(step, _perform(step, bench, handles))
    except NotSupportedOnBench as reason:
        return Difference(step.number, f"{sent_name(step)}: not possible on this bench", str(reason))
    except Exception as error:  # noqa: BLE001 - a fault of the simulated brick is a result
        raised = f"{type(error).__name__}: {error}"
        cause = f"{sent_name(step)}: the simulated brick raised {type(error).__name__}"
        text = f"{step.request or step.control}: the simulated brick raised {raised}"
        return Difference(step.number, cause, text, exception=True)


def _perform(step: Step, bench: Bench, handles: Handles) -> str:
    """Execute a step and return the reply."""
    if not step.request:
        return bench.control(handles.translate_line(step.control)).strip()  # as recordings are read
    request = bytes.fromhex(step.request)
    got = bench.telegram(handles.translate(request).hex())
    handles.learn(request, bytes.fromhex(step.reference), bytes.fromhex(got))
    return got
