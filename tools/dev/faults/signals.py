"""Signals at random moments of real processes, over the simulated brick and over a pseudo-terminal, in real time."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any

from firmware_protocol.direct import GetOutputState
from firmware_protocol.enums import OutputPort
from nxtdrive.brick import open_brick
from nxtdrive.cli.main import DONE, NOT_ACHIEVED
from nxtdrive.recording.run_folder import JOURNAL, MAP, MISSION, SUMMARY

from .campaign import Campaign, Tally, Violation

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
LATEST_S = 5.0
"""The signal arrives at a random moment up to this time after the start; commands begin their work after 1 to 2 s."""
SECOND_SIGNAL_S = 0.1
"""Every other signal is sent twice, as when a terminal is closed; the second arrives while the program is ending."""
LIMIT_S = 40.0
"""A process that has not ended by then counts as hanging."""
COAST_S = 1.2
STILL_S = 0.3
SERVED, CAMERA = "{nxt}", "{camera}"


@dataclass(frozen=True, slots=True)
class Case:
    """A command.

    Attributes:
        words: Its arguments; those of the served brick are filled in.
        code: Its documented exit code after a signal, once it has begun its work; None: 128 + the signal's number.
        terminal: Whether it needs a terminal.
    """

    words: tuple[str, ...]
    code: int | None
    terminal: bool = False

    @property
    def served(self) -> bool:
        """Whether it uses the served brick."""
        return SERVED in self.words


TURN = ("motor", "turn", "A", "6000", "--speed", "400")
RUN = ("run", "--no-video")
CASES = {
    "run, sim://": Case((*RUN, "--nxt", "sim://?pace=realtime"), NOT_ACHIEVED),
    "run, pty": Case((*RUN, "--nxt", SERVED, "--camera", CAMERA), NOT_ACHIEVED),
    "run with video, sim://": Case(("run", "--nxt", "sim://?pace=realtime"), NOT_ACHIEVED),
    "motor turn, sim://": Case((*TURN, "--nxt", "sim://?pace=realtime"), None),
    "motor turn, pty": Case((*TURN, "--nxt", SERVED), None),
    "monitor, sim://": Case(("monitor", "--sensor", "4=ultrasonic", "--nxt", "sim://"), None),
    "monitor, pty": Case(("monitor", "--json", "--sensor", "4=ultrasonic", "--nxt", SERVED), None),
    "serve, sim://": Case(("serve", "--port", "0", "--nxt", "sim://open"), DONE),
    "serve, pty": Case(("serve", "--port", "0", "--nxt", SERVED, "--camera", CAMERA), DONE),
    "teleop, sim://": Case(("teleop", "--nxt", "sim://open"), DONE, terminal=True),
    "teleop, pty": Case(("teleop", "--nxt", SERVED), DONE, terminal=True),
}


@dataclass(frozen=True, slots=True)
class Ended:
    """A process that has ended.

    Attributes:
        code: Its exit code; None if it had to be killed.
        output: What it printed.
        errors: What it printed to standard error; with a terminal, empty.
    """

    code: int | None
    output: str
    errors: str


class ServedBrick:
    """A simulated brick behind a pseudo-terminal, and a second link to it for the ground truth.

    Args:
        folder: For the pseudo-terminal.
    """

    def __init__(self, folder: Path) -> None:
        words = ["sim", "serve", "--pty", str(folder / "nxt"), "--tcp", "0", "--camera-port", "0", "--json"]
        self._process = subprocess.Popen(_command(words), stdout=subprocess.PIPE, text=True)  # noqa: S603 - our own command
        lines: Any = self._process.stdout
        values: dict[str, Any] = json.loads(lines.readline())
        self.nxt, self._tcp = values["doors"]
        self.camera = values["camera"]
        self._reader = threading.Thread(target=lines.read, daemon=True)
        self._reader.start()

    def moving(self) -> list[str]:
        """Return the motors that have power or turn."""
        with open_brick(self._tcp, timeout_s=10) as brick:
            brick.sleep(COAST_S)
            before = [brick.request(GetOutputState(port)) for port in OutputPort if port.name in "ABC"]
            brick.sleep(STILL_S)
            after = [brick.request(GetOutputState(port)) for port in OutputPort if port.name in "ABC"]
        pairs = zip("ABC", before, after, strict=True)
        return [name for name, one, two in pairs if two.power or one.rotation_count != two.rotation_count]

    def close(self) -> None:
        """End the server."""
        self._process.terminate()
        self._process.wait(30)
        self._reader.join(30)
        if self._process.stdout:
            self._process.stdout.close()


def _command(words: list[str]) -> list[str]:
    return [sys.executable, "-m", "nxtdrive", *words]


def _let_signals_end_it() -> None:
    for number in SIGNALS:  # the parent process may ignore them
        signal.signal(number, signal.SIG_DFL if number != signal.SIGINT else signal.default_int_handler)


def end_by_signal(
    words: list[str], folder: Path, number: int, moments_s: Sequence[float], *, terminal: bool = False
) -> Ended:
    """Run a command, send it a signal after each of these times, and wait until it has ended."""
    main_end, its_end = pty.openpty() if terminal else (-1, -1)
    streams: Any = its_end if terminal else subprocess.PIPE
    process = subprocess.Popen(  # noqa: S603 - our own command
        _command(words),
        cwd=folder,
        stdin=its_end if terminal else subprocess.DEVNULL,
        stdout=streams,
        stderr=streams,
        preexec_fn=_let_signals_end_it,  # noqa: PLW1509 - it only sets handlers
    )
    if terminal:
        os.close(its_end)
        threading.Thread(target=_drain, args=(main_end,), daemon=True).start()
    timers = [threading.Timer(moment_s, process.send_signal, (number,)) for moment_s in moments_s]
    for timer in timers:
        timer.start()
    try:
        output, errors = process.communicate(timeout=max(moments_s) + LIMIT_S)
    except subprocess.TimeoutExpired:
        process.kill()
        output, errors = process.communicate()
        return Ended(None, _text(output), _text(errors))
    finally:
        for timer in timers:
            timer.cancel()
    return Ended(process.returncode, _text(output), _text(errors))


def _text(data: bytes | None) -> str:
    return (data or b"").decode(errors="replace")


def _drain(file: int) -> None:
    """Read what a program writes to its terminal, until it has ended."""
    try:
        while os.read(file, 4096):
            pass
    except OSError:
        os.close(file)


def evaluate(case: Case, number: int, ended: Ended, folder: Path) -> tuple[str, list[str]]:
    """Return the outcome and any violations."""
    if ended.code is None:
        return "hung", [f"it hangs after {LIMIT_S:g} s"]
    run = next((folder / "runs").glob("*"), None)
    if not run and (ended.code == -number or (number == signal.SIGINT and "in <module>" in ended.errors)):
        return "ended before it began", []
    wrong = [f"a traceback: {ended.errors[-600:]}"] if "Traceback" in ended.errors else []
    late, early = 128 + number if case.code is None else case.code, 128 + number
    if ended.code not in (late, early):
        wrong.append(f"exit code {ended.code}, not {late}: {ended.errors[-300:]}")
    if run:
        wrong += _record_wrong(run)
    return f"exit code {'of the signal' if ended.code == early else ended.code}", wrong


def _record_wrong(run: Path) -> list[str]:
    names = {path.name for path in run.iterdir()}
    if missing := {MISSION, JOURNAL, SUMMARY, MAP} - names:
        return [f"{', '.join(sorted(missing))} missing in the run folder"]
    summary = json.loads((run / SUMMARY).read_text(encoding="utf-8"))
    records = (run / JOURNAL).read_text(encoding="utf-8").splitlines()
    whole = summary["ending"] == "interrupted" and summary.get("targets") and '"end"' in records[-1]
    return [] if whole else [f"the record is not complete: {summary}, {records[-1:]}"]


@contextmanager
def _served(numbers: range, cases: dict[int, Case]) -> Iterator[ServedBrick | None]:
    """Serve a brick if a trial needs one."""
    if not any(cases[number].served for number in numbers):
        yield None
        return
    with tempfile.TemporaryDirectory() as folder:
        served = ServedBrick(Path(folder))
        try:
            yield served
        finally:
            served.close()


def trials(seed: int, numbers: range) -> Tally:
    """Run these trials."""
    tally, names = Tally(), list(CASES)
    cases = {number: CASES[names[number % len(names)]] for number in numbers}
    with _served(numbers, cases) as served:
        for number in numbers:
            name, case = names[number % len(names)], cases[number]
            random = Random(f"{seed}:{number}")  # noqa: S311 - repeatable
            kind, after_s = random.choice(SIGNALS), random.uniform(0.0, LATEST_S)
            moments_s = [after_s, after_s + SECOND_SIGNAL_S][: random.randint(1, 2)]
            with tempfile.TemporaryDirectory() as folder:
                nxt, camera = (served.nxt, served.camera) if served else ("", "")
                words = [word.format(nxt=nxt, camera=camera) for word in case.words]
                ended = end_by_signal(words, Path(folder), kind, moments_s, terminal=case.terminal)
                outcome, wrong = evaluate(case, kind, ended, Path(folder))
            if served and case.served and (moving := served.moving()):
                wrong.append(f"motors {', '.join(moving)} are not off")
            tally.outcomes[f"{name.split(',')[0]}: {outcome}"] += not wrong
            what = f"{name}, {kind.name} after {after_s:.3f} s, {len(moments_s)} times"
            tally.violations += [Violation(number, f"{what}: {each}") for each in wrong]
    return tally


CAMPAIGN = Campaign(
    "Whenever SIGINT, SIGTERM or SIGHUP arrives, motors are off, the exit code is the documented one, a run folder "
    "is complete, and no command that has begun ends in a traceback or by another signal.",
    "signals",
    count=200,
    batch=11,
    run=trials,
)
