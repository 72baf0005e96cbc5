"""Run a sweep on a Dask cluster that is already running: ``nxtdrive sweep --dask tcp://host:8786``.

A mission is sent as names and numbers; each worker runs it with its own code. Every worker must therefore have the
same nxtdrive as this computer: all workers are checked at the start, and a worker that joins later with another
nxtdrive refuses its first mission.
"""

from __future__ import annotations

import logging
import socket
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future
from functools import cache, partial
from hashlib import sha256
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import nxtdrive
from firmware_protocol.errors import AddressError, ConfigError
from input_files.plain import whole_number
from nxtdrive.host.environment import require

from .runner import AHEAD, Workers, WorkersDied

CONNECT_S = 5.0
"""How long the scheduler may take to answer."""
WITHOUT_WORKERS_S = 30.0
"""How long a cluster may be without any worker before the sweep ends."""
GREETING_SIZE, LONGEST_GREETING = 8, 1 << 20
"""A scheduler sends first: the size of this field in bytes, and a limit far above the greeting's length in it."""

PACKAGES = ("firmware_protocol", "input_files", "behaviors", "sim_backend", "nxtdrive", "nxtdrive.tools")
RESULT_SUFFIXES = (".json", ".py", ".toml", ".png")
"""Results depend on the files of `PACKAGES` with these extensions."""
RESUME_REMEDY = "What is done is in the file: continue with --resume."

T = TypeVar("T")


class InstalledVersion(NamedTuple):
    """The nxtdrive that a process uses.

    Attributes:
        version: Its version.
        sources: A digest of all files that results depend on; a checkout changes more often than its version.
    """

    version: str
    sources: str


class Cluster(Executor):
    """The workers of a running cluster, as an executor."""

    def __init__(self, address: str, *, workers_timeout_s: float = WITHOUT_WORKERS_S) -> None:
        """Connect, and check that the workers have the same nxtdrive as this computer.

        Args:
            address: The scheduler's, as in ``tcp://host:8786``.
            workers_timeout_s: How long the cluster may be without a worker, now or later.

        Raises:
            AddressError: `address` is not valid.
            ConfigError: Dask is not installed, no scheduler answers, it has no worker, or a worker differs.
        """
        self._address, self._workers_timeout_s, self._seen_s = address, workers_timeout_s, time.monotonic()
        self._client = _connect(address)
        try:
            try:
                self._client.wait_for_workers(1, timeout=workers_timeout_s)
            except TimeoutError:
                raise self._without_workers() from None
            _compare(self._client.run(installed, on_error="return"))
            self.number = sum(self._client.nthreads().values())
        except BaseException:
            self._client.close()
            raise
        self._remote: Executor = self._client.get_executor(pure=False)

    def submit(self, fn: Callable[..., T], /, *args: Any, **kwargs: Any) -> Future[T]:  # noqa: ANN401 - as its base declares
        """Submit a call to a worker; if the worker dies, the scheduler gives the call to others.

        The future raises `WorkersDied` if those die as well, and ConfigError if the cluster itself fails.
        """
        future: Future[T] = Future()
        remote = self._remote.submit(as_there, installed(), fn, *args, **kwargs)
        remote.add_done_callback(partial(self._settle, future))
        future.add_done_callback(lambda ours: ours.cancelled() and remote.cancel())
        return future

    @property
    def workers(self) -> Workers:
        """The cluster as the workers of a command."""
        return Workers(self, self.number * AHEAD, self.watch)

    def watch(self) -> None:
        """Check that the cluster still has workers.

        Raises:
            ConfigError: The scheduler is gone, or has had no worker for too long.
        """
        try:
            alive = bool(self._client.nthreads())
        except (OSError, RuntimeError) as error:
            raise self._failed(error) from error
        now_s = time.monotonic()
        if alive:
            self._seen_s = now_s
        elif now_s - self._seen_s > self._workers_timeout_s:
            raise self._without_workers()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:  # noqa: ARG002 - as its base declares
        """Disconnect from the cluster, which then drops this client's pending work."""
        self._client.close()

    def _settle(self, ours: Future[T], remote: Future[T]) -> None:
        """Copy the outcome to our future and translate its errors."""
        from distributed.scheduler import KilledWorker

        if not ours.set_running_or_notify_cancel():
            return
        error = ConnectionError("the link broke") if remote.cancelled() else remote.exception()
        if error is None:
            ours.set_result(remote.result())
        elif isinstance(error, KilledWorker):
            ours.set_exception(WorkersDied(f"{error.allowed_failures + 1} workers died over it, one after the other"))
        else:
            ours.set_exception(error if isinstance(error, ConfigError) else self._failed(error))

    def _failed(self, error: BaseException) -> ConfigError:
        return ConfigError(f"the cluster at {self._address} failed ({error}).", remedy=RESUME_REMEDY)

    def _without_workers(self) -> ConfigError:
        return ConfigError(
            f"the cluster at {self._address} has had no worker for {self._workers_timeout_s:.0f} s.",
            remedy=f"Start some: dask worker {self._address} --nworkers auto --nthreads 1. {RESUME_REMEDY}",
        )


@cache
def installed() -> InstalledVersion:
    """Return the nxtdrive of this process; read once, since loaded modules stay when their files change."""
    files: dict[str, Path] = {}
    for package in PACKAGES:
        # tools/ is inside the package or, in a checkout, beside it; module names are the same
        root = Path(import_module(package).__path__[0])
        for path in root.rglob("*"):
            name = path.relative_to(root).as_posix()
            if path.suffix in RESULT_SUFFIXES and not name.startswith("dev/"):  # tools/dev is in checkouts only
                files[f"{package.replace('.', '/')}/{name}"] = path
    return InstalledVersion(nxtdrive.__version__, digest_of(files))


def digest_of(files: Mapping[str, Path]) -> str:
    """Return a digest of files and their names."""
    digest = sha256()
    for name, path in sorted(files.items()):
        digest.update(f"{name} {sha256(path.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()


def as_there(there: InstalledVersion, fn: Callable[..., T], *args: Any, **kwargs: Any) -> T:  # noqa: ANN401 - whatever fn takes
    """Call `fn` on a worker whose nxtdrive is that of the caller.

    Raises:
        ConfigError: The worker has another nxtdrive.
    """
    if installed() != there:
        from distributed import get_worker

        raise _unlike({get_worker().address: installed()}, there)
    return fn(*args, **kwargs)


def _compare(found: dict[str, Any]) -> None:
    unlike = {worker: what for worker, what in found.items() if what != installed()}
    if unlike:
        raise _unlike(unlike, installed())


def _unlike(workers: dict[str, Any], expected: InstalledVersion) -> ConfigError:
    differences = "; ".join(f"{worker} {_difference(what, expected)}" for worker, what in sorted(workers.items()))
    return ConfigError(
        f"not every worker has the nxtdrive of this computer, {expected.version}: {differences}.",
        remedy="Install the same there and start these workers again.",
    )


def _difference(what: object, expected: InstalledVersion) -> str:
    if not isinstance(what, tuple):  # its class may differ, too
        return f"has none of this kind ({what})"
    return "has the same version with other sources" if what[0] == expected.version else f"has {what[0]}"


def _connect(address: str) -> Any:  # noqa: ANN401 - a distributed.Client
    require("cluster", "distributed", what="a cluster")
    from distributed import Client

    if not logging.getLogger().isEnabledFor(logging.DEBUG):
        for name in ("distributed", "distributed.client"):
            logging.getLogger(name).setLevel(logging.CRITICAL)  # we report each error ourselves, once
    try:
        _expect_greeting(address)
        return Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ImportError) as error:
        raise ConfigError(
            f"no Dask scheduler answers at {address} ({error}).",
            remedy="Start one there with: dask scheduler. It prints the address to give to --dask.",
        ) from error


def _expect_greeting(address: str) -> None:
    """Check that a scheduler answers; Dask's client waits forever for a greeting from any other program."""
    scheme, _, place = address.rpartition("://")
    host, _, port = place.rpartition(":")
    number = whole_number(port)
    if scheme not in ("", "tcp", "tls") or not host or number is None or number > 0xFFFF:
        raise AddressError(f"{address!r} is not an address of a Dask scheduler.", remedy="Write tcp://host:8786.")
    with socket.create_connection((host.strip("[]"), number), CONNECT_S) as connection:
        if scheme == "tls":
            return  # there the client sends first
        with connection.makefile("rb") as stream:
            size = stream.read(GREETING_SIZE)
        if len(size) < GREETING_SIZE or int.from_bytes(size, "little") > LONGEST_GREETING:
            raise ConnectionError("another program does")
