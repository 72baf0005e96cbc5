"""Run a sweep: tasks on any executor, one line of JSON for each, in order, resumable.

The lines depend only on the tasks, not on the number of workers or on how often the sweep was interrupted.
"""

from __future__ import annotations

import os
import signal
import sys
import time
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from itertools import islice, product
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

from behaviors.robot_description import RobotFile

from .performance import UNCHANGED, Line, Task, evaluate, failed
from .result_file import ResultFile, key_of, read_lines

AHEAD = 4
"""Missions queued per worker: the next ones are there when one ends out of order."""
MOST_ON_WINDOWS = 61
"""Processes that Windows can wait for. Source: the documentation of `concurrent.futures.ProcessPoolExecutor`."""
CHECK_INTERVAL_S = 1.0
"""How often the wait for a mission checks that workers are left."""

T = TypeVar("T")


class WorkersDied(Exception):
    """The workers that ran these tasks died; the executor has others."""


class InProcess(Executor):
    """An executor that runs each call immediately in this process."""

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401 - as its base declares
        """Run the call now; the returned future is done."""
        future: Future[T] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:  # noqa: BLE001 - a future carries whatever was raised
            future.set_exception(error)
        return future


@dataclass(frozen=True, slots=True)
class Swept:
    """The result of a sweep.

    Attributes:
        lines: The lines of all its tasks, in order.
        eval_s: Wall time of this run, without earlier runs that it resumed.
    """

    lines: list[Line]
    eval_s: float


def plan(
    kinds: Sequence[str],
    seeds: Iterable[int],
    agents: Sequence[str],
    eyes: str,
    robot: RobotFile = UNCHANGED,
) -> list[Task]:
    """Return the tasks of a sweep: every agent in every scenario, with this description of the robot."""
    cases = product(kinds, seeds, agents)
    return [Task(index, kind, seed, agent, eyes, robot) for index, (kind, seed, agent) in enumerate(cases)]


@contextmanager
def workers(number: int) -> Iterator[Executor]:
    """Provide an executor with that many processes; with one, it is this process.

    An exception ends the processes at once, in the middle of their work.
    """
    if number == 1:
        yield InProcess()
        return
    if sys.platform == "win32":
        number = min(number, MOST_ON_WINDOWS)
    # spawned everywhere, so that a sweep works the same on all systems
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with ours, theirs, ProcessPoolExecutor(number, context, _serve_parent, (theirs,)) as executor:
        try:
            yield executor
        except BaseException:
            ours.close()
            raise


def _serve_parent(parent: Connection) -> None:
    """Ignore Ctrl-C, which every process of the terminal receives and the parent handles; end with the parent."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    Thread(target=_end_with, args=(parent,), daemon=True).start()


def _end_with(parent: Connection) -> None:
    """End this process when its parent closes the connection or ends."""
    with suppress(EOFError, OSError):
        parent.recv()
    os._exit(1)


def run_tasks(
    tasks: Sequence[Task], executor: Executor, *, number: int = 1, watch: Callable[[], None] = lambda: None
) -> Iterator[Line]:
    """Perform tasks; yield their lines in the order of the tasks as they become available.

    Args:
        tasks: The tasks.
        executor: Any `concurrent.futures.Executor`, a cluster's included.
        number: Its number of workers, which determines how many missions are queued.
        watch: Called every second of waiting; raises if no result can come.
    """
    if isinstance(executor, InProcess):  # nothing can be done ahead
        yield from map(evaluate, tasks)
        return
    queue = iter(tasks)
    running: deque[tuple[Task, Future[Line]]] = deque()
    try:
        running.extend((task, executor.submit(evaluate, task)) for task in islice(queue, number * AHEAD))
        while running:
            line = _line(*running[0], watch)
            running.popleft()
            running.extend((task, executor.submit(evaluate, task)) for task in islice(queue, 1))
            yield line
    finally:
        for _, future in running:
            future.cancel()


def _line(task: Task, future: Future[Line], watch: Callable[[], None]) -> Line:
    """Wait for a mission; if it killed its workers, report it as failed."""
    while not wait([future], CHECK_INTERVAL_S).done:
        watch()
    try:
        return future.result()
    except WorkersDied as error:
        return failed(task, error)


def sweep(
    tasks: Sequence[Task],
    out: Path,
    executor: Executor,
    *,
    number: int = 1,
    progress: Callable[[Line], None] = lambda _: None,
    watch: Callable[[], None] = lambda: None,
) -> Swept:
    """Perform the tasks that have no line in the file yet, and append their lines.

    Args:
        tasks: All tasks of the sweep.
        out: The file, with one line of JSON per mission.
        executor: Runs the missions.
        number: Its number of workers.
        progress: Called with each new line, once it is in the file.
        watch: Called every second of waiting; raises if no result can come.

    Raises:
        ConfigError: The file cannot be read or written, or is not a sweep's.
    """
    begun_s = time.perf_counter()
    known = {key_of(line): line for line in read_lines(out)}
    missing = [task for task in tasks if task.key not in known]
    with ResultFile(out) as file:
        for line in run_tasks(missing, executor, number=number, watch=watch):
            file.append(line)
            known[key_of(line)] = line
            progress(line)
    return Swept([known[task.key] for task in tasks], time.perf_counter() - begun_s)
