"""Measures turns by an angle next to nxt-python's `Motor.turn`: same brick, same motor, same moves, in real time.

nxt-python (GPL) is an outside client in its own process; nothing of it is imported here. Without an address both talk
to ``nxtdrive sim serve`` through its serial port. See docs/motion.md.
"""

from __future__ import annotations

import contextlib
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_protocol.errors import ConfigError
from nxtdrive.brick import open_brick
from nxtdrive.motion.motor import FASTEST_DEG_S, Then
from nxtdrive.tools.bench import Figure
from nxtdrive.tools.bench_motion import LATENCIES_MS, REST_S, error_figures, rotation

MOVES = ((40, 90), (-75, 360), (100, 720), (-40, 450), (75, 180), (-100, 270))
"""Power in percent, its sign being the direction, and degrees."""
NOT_INSTALLED = 3
LONGEST_S = 120.0

PROGRAM = """
import json, sys, time
try:
    import nxt.locator, nxt.motor
except ImportError:
    sys.exit(int(sys.argv[4]))
with nxt.locator.find(**json.loads(sys.argv[1])) as brick:
    motor = brick.get_motor(nxt.motor.Port.A)
    for power, angle in json.loads(sys.argv[2]):
        before = motor.get_tacho().rotation_count
        motor.turn(power, angle)
        time.sleep(float(sys.argv[3]))
        turned = motor.get_tacho().rotation_count - before
        print(turned - (angle if power > 0 else -angle), flush=True)
"""


def measure_nxt_python(address: str | None = None) -> Iterator[Figure]:
    """Errors at rest of nxt-python's turns and of ours, by the brick's own counter.

    Args:
        address: A real brick with a free motor on port A, on USB or at a serial port; None for the simulator at the
            latencies of a cable and of a radio.

    Raises:
        ConfigError: nxt-python cannot open such an address.
    """
    if address is not None:
        yield from _compare(address, "")
        return
    for latency_ms in LATENCIES_MS:
        with _served(latency_ms) as served:
            yield from _compare(served, f", serial port, {latency_ms} ms")


def _compare(address: str, link: str) -> Iterator[Figure]:
    theirs = _their_errors(address)
    if theirs is None:
        yield Figure("nxt-python is not installed; pip install nxt-python to compare", math.nan, "")
        return
    yield from error_figures(f"nxt-python Motor.turn{link}", theirs, "deg")
    yield from error_figures(f"run_angle{link}", _our_errors(address), "deg", 2.0, 5.0)


def _their_errors(address: str) -> list[int] | None:
    scheme, _, target = address.partition("://")
    if scheme == "serial":
        where: dict[str, object] = {"backends": ["devfile"], "filename": target}
    elif scheme == "usb":
        where = {"backends": ["usb"]}
    else:
        raise ConfigError(f"nxt-python cannot be compared at {address}.", remedy="Use usb:// or serial://.")
    moves = json.dumps(MOVES)
    done = subprocess.run(  # noqa: S603 - our own interpreter on the text above
        [sys.executable, "-c", PROGRAM, json.dumps(where), moves, str(REST_S), str(NOT_INSTALLED)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        check=False,
        timeout=LONGEST_S,
    )
    if done.returncode == NOT_INSTALLED:
        return None
    done.check_returncode()
    return [int(line) for line in done.stdout.split()]


def _our_errors(address: str) -> Sequence[float]:
    errors = []
    with open_brick(address) as brick:
        for power, angle_deg in MOVES:
            before = rotation(brick)
            brick.motor("A").run_angle(power / 100 * FASTEST_DEG_S, angle_deg, Then.BRAKE)
            brick.sleep(REST_S)
            errors.append(rotation(brick) - before - math.copysign(angle_deg, power))
    return errors


@contextlib.contextmanager
def _served(latency_ms: float) -> Iterator[str]:
    """The address of a simulated brick in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        port = Path(folder) / "nxt"
        words = ["sim", "serve", "--pty", str(port), "--latency-ms", str(latency_ms), "--json"]
        server = subprocess.Popen(  # noqa: S603 - our own command
            [sys.executable, "-m", "nxtdrive.cli.main", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            if server.stdout is None or not server.stdout.readline():
                raise RuntimeError("the simulated brick could not be served")
            yield f"serial://{port}"
        finally:
            server.terminate()
            server.communicate(timeout=10)
