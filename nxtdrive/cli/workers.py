"""The workers of a command that runs many missions: processes of this computer, or a Dask cluster."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from concurrent.futures import BrokenExecutor
from contextlib import contextmanager
from typing import TYPE_CHECKING

from firmware_protocol.errors import ConfigError
from nxtdrive.cli.options import number

if TYPE_CHECKING:
    from nxtdrive.tools.sweep.runner import Workers


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


@contextmanager
def open_workers(args: argparse.Namespace, remedy: str) -> Iterator[Workers]:
    """Provide the workers that the arguments name.

    Args:
        args: The command's arguments.
        remedy: What to do when a worker dies.

    Raises:
        ConfigError: A worker died, or the cluster cannot be used.
    """
    from nxtdrive.tools.sweep.runner import WorkersDied, local_workers

    try:
        if args.dask:
            from nxtdrive.tools.sweep.cluster import Cluster

            with Cluster(args.dask) as cluster:
                yield cluster.workers
        else:
            with local_workers(args.workers) as workers:
                yield workers
    except (BrokenExecutor, WorkersDied) as error:
        raise ConfigError(f"a worker died ({error}).", remedy=remedy) from None
