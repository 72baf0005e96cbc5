"""Run nxt-python as an external client for comparisons, and serve a simulated brick to both programs.

nxt-python (GPL) runs in separate processes; it is never imported here.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_protocol.errors import ConfigError

NOT_INSTALLED = 3
PROGRAM_TIMEOUT_S = 120.0
PROLOGUE = f"""
import json, statistics, sys, time
try:
    import nxt.brick, nxt.locator, nxt.motor, nxt.sensor, nxt.sensor.generic
except ImportError:
    sys.exit({NOT_INSTALLED})
"""


def run_nxt_python(program: str, *words: str, through: Sequence[str] = ()) -> str | None:
    """Run a program with nxt-python's modules imported.

    Args:
        program: Source of the program.
        words: Arguments of the program.
        through: Command to prepend to the interpreter's.

    Returns:
        The output, or None when nxt-python is not installed.

    Raises:
        RuntimeError: The program fails.
    """
    done = subprocess.run(  # noqa: S603 - our own interpreter on a text of ours
        [*through, sys.executable, "-c", PROLOGUE + program, *words],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=PROGRAM_TIMEOUT_S,
    )
    if done.returncode == NOT_INSTALLED:
        return None
    if done.returncode:
        raise RuntimeError(f"nxt-python failed: {done.stderr}")
    return done.stdout


def output_of(*words: str, through: Sequence[str] = ()) -> str:
    """Run our own interpreter and return its output.

    Args:
        words: Its arguments.
        through: Command to prepend to the interpreter's.
    """
    done = subprocess.run(  # noqa: S603 - our own interpreter
        [*through, sys.executable, *words], capture_output=True, text=True, check=True, timeout=PROGRAM_TIMEOUT_S
    )
    return done.stdout


def where(address: str) -> str:
    """Return the arguments of ``nxt.locator.find`` for one of our addresses, as JSON.

    Raises:
        ConfigError: nxt-python has no counterpart.
    """
    scheme, _, target = address.partition("://")
    host, _, port = target.rpartition(":")
    known: dict[str, dict[str, object]] = {
        "serial": {"backends": ["devfile"], "filename": target},
        "usb": {"backends": ["usb"]},
        "nxt-server": {"backends": ["socket"], "server_host": host, "server_port": port},
    }
    if scheme not in known:
        raise ConfigError(f"nxt-python cannot be compared at {address}.", remedy="Use usb:// or serial://.")
    return json.dumps(known[scheme])


@contextlib.contextmanager
def served(latency_ms: float) -> Iterator[str]:
    """Serve a simulated brick at a serial port from another process, in real time; yield its address."""
    with tempfile.TemporaryDirectory() as folder:
        port = Path(folder) / "nxt"
        with serving("--pty", str(port), "--latency-ms", str(latency_ms)):
            yield f"serial://{port}"


@contextlib.contextmanager
def serving(*words: str) -> Iterator[list[str]]:
    """Run ``nxtdrive sim serve`` with these arguments; yield the addresses of the simulated brick."""
    server = subprocess.Popen(  # noqa: S603 - our own command
        [sys.executable, "-m", "nxtdrive", "sim", "serve", *words, "--json"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        line = server.stdout.readline() if server.stdout else ""
        if not line:
            raise RuntimeError("the simulated brick could not be served")
        yield json.loads(line)["doors"]
    finally:
        server.terminate()
        server.communicate(timeout=PROGRAM_TIMEOUT_S)
