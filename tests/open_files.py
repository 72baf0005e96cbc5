"""A limit on the number of files that this process may open."""

import contextlib
import os

import pytest


@contextlib.contextmanager
def files_left(number):
    """Let this process open only this number of further files; skips the test where there is no such limit."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    spare = os.dup(0)
    os.close(spare)
    resource.setrlimit(resource.RLIMIT_NOFILE, (spare + number, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
