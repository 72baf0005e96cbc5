"""The workers of a command that plays many missions: processes of this computer, or a Dask cluster."""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from concurrent.futures import Executor
from contextlib import AbstractContextManager

from nxtdrive.cli.options import number


def add_worker_arguments(parser: argparse.ArgumentParser, default: int, default_words: str) -> None:
    """Declare ``--workers`` and ``--dask``."""
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers",
        metavar="N",
        type=number("processes", int, 1, math.inf),
        default=default,
        help=f"processes (default: {default_words})",
    )
    where.add_argument(
        "--dask",
        metavar="ADDRESS",
        help="a running Dask cluster, tcp://host:8786; needs the extra nxtdrive[cluster]",
    )


def open_workers(args: argparse.Namespace) -> tuple[AbstractContextManager[Executor], int, Callable[[], None]]:
    """Return the executor, its number of workers, and a function that watches over them."""
    if args.dask:
        from nxtdrive.tools.sweep.cluster import Cluster

        cluster = Cluster(args.dask)
        return cluster, cluster.number, cluster.watch
    from nxtdrive.tools.sweep.runner import workers

    return workers(args.workers), args.workers, lambda: None
