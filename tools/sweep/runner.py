"""Run a sweep: tasks on any executor, one result for each, in order, resumable.

The results depend only on the tasks, not on the number of workers or on how often the sweep was interrupted.
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
from dataclasses import dataclass, field
from functools import partial
from itertools import islice, product
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path
from threading import Thread
from typing import Any, TypeVar

from behaviors.mission.robot import RobotFile

from .mission_result import MissionResult
from .result_file import ResultFile, read_results
from .task import UNCHANGED, Task, evaluate, failed

AHEAD = 4
"""Calls queued per worker: the next ones are there when one ends out of order."""
MAX_ON_WINDOWS = 61
"""Processes that Windows can wait for. Source: the documentation of `concurrent.futures.ProcessPoolExecutor`."""
CHECK_INTERVAL_S = 1.0
"""How often the wait for a call checks that workers are left."""

K = TypeVar("K")
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
class Workers:
    """The workers that run calls; by default only this process.

    Attributes:
        executor: Any `concurrent.futures.Executor`, a cluster's included.
        ahead: Number of calls that are submitted before the result of the first of them is taken. 1 for an executor
            that runs each call immediately, or all of them would run before the first result is taken.
        watch: Called every second of waiting; raises if no result can come.
    """

    executor: Executor = field(default_factory=InProcess)
    ahead: int = 1
    watch: Callable[[], None] = lambda: None

    def run(self, calls: Iterable[tuple[K, Callable[[], T]]]) -> Iterator[tuple[K, Future[T]]]:
        """Yield the name of each call with its future, which is done, in the order of the calls."""
        queue = iter(calls)
        running: deque[tuple[K, Future[T]]] = deque()
        try:
            while True:
                more = islice(queue, self.ahead - len(running))
                running.extend((name, self.executor.submit(call)) for name, call in more)
                if not running:
                    return
                while not wait([running[0][1]], CHECK_INTERVAL_S).done:
                    self.watch()
                yield running.popleft()
        finally:
            for _, future in running:
                future.cancel()


@dataclass(frozen=True, slots=True)
class SweepResult:
    """The result of a sweep.

    Attributes:
        results: Those of all its tasks, in order.
        eval_s: Wall time of this run, without earlier runs that it resumed.
    """

    results: list[MissionResult]
    eval_s: float


def plan(
    kinds: Sequence[str],
    seeds: Iterable[int],
    agents: Sequence[str],
    vision: str,
    robot: RobotFile = UNCHANGED,
) -> list[Task]:
    """Return the tasks of a sweep: every agent in every scenario, with this description of the robot."""
    cases = product(kinds, seeds, agents)
    return [Task(index, kind, seed, agent, vision, robot) for index, (kind, seed, agent) in enumerate(cases)]


@contextmanager
def local_workers(number: int) -> Iterator[Workers]:
    """Provide that many processes; one is this process.

    An exception ends the processes at once, in the middle of their work.
    """
    if number == 1:
        yield Workers()
        return
    if sys.platform == "win32":
        number = min(number, MAX_ON_WINDOWS)
    # spawned everywhere, so that a sweep works the same on all systems
    context = get_context("spawn")
    theirs, ours = context.Pipe(duplex=False)
    with ours, theirs, ProcessPoolExecutor(number, context, _serve_parent, (theirs,)) as executor:
        try:
            yield Workers(executor, number * AHEAD)
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


def run_tasks(tasks: Iterable[Task], workers: Workers) -> Iterator[MissionResult]:
    """Run tasks; yield their results in the order of the tasks as they become available.

    A mission that killed its workers is reported as failed.
    """
    for task, future in workers.run((task, partial(evaluate, task)) for task in tasks):
        error = future.exception()
        yield failed(task, error) if isinstance(error, WorkersDied) else future.result()


def sweep(
    tasks: Sequence[Task],
    out: Path,
    workers: Workers,
    *,
    begin: Callable[[], None] = lambda: None,
    progress: Callable[[MissionResult], None] = lambda _: None,
) -> SweepResult:
    """Run the tasks that have no result in the file yet, and append theirs.

    Args:
        tasks: All tasks of the sweep.
        out: The file, with one line of JSON per mission.
        workers: Run the missions.
        begin: Called before the first mission, once the file can be written.
        progress: Called with each new result, once it is in the file.

    Raises:
        ConfigError: The file cannot be read or written, or is not a sweep's.
    """
    begun_s = time.perf_counter()
    known = {result.key: result for result in read_results(out)}
    missing = [task for task in tasks if task.key not in known]
    with ResultFile(out) as file:
        begin()
        for result in run_tasks(missing, workers):
            file.append(result.to_json())
            known[result.key] = result
            progress(result)
    return SweepResult([known[task.key] for task in tasks], time.perf_counter() - begun_s)
