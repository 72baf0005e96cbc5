"""Measures how often a distance can be read over a slow link, against nxt-python on the same link.

Both are outside clients of the same simulated brick, behind a serial port with the latency of a radio; the time is the
clock on the wall.
"""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path

from nxtdrive.brick import open_brick
from nxtdrive.ports import SensorPort

from .bench import Figure

LATENCY_MS = 45
"""A Bluetooth link of the better kind."""
READINGS = 60
GOAL = 2.0
SONAR_PORT: SensorPort = 4
PATIENCE_S = 60

NXT_PYTHON = """
import sys, time
try:
    import nxt.locator, nxt.sensor, nxt.sensor.generic
except ImportError:
    sys.exit(3)
link, port, readings = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
with nxt.locator.find(backends=["devfile"], filename=link) as brick:
    sonar = brick.get_sensor(nxt.sensor.Port(port - 1), nxt.sensor.generic.Ultrasonic)
    sonar.get_distance()
    begun = time.perf_counter()
    for _ in range(readings):
        sonar.get_distance()
    print(readings / (time.perf_counter() - begun))
"""
"""An outside client in its own process; nothing of nxt-python (GPL) is imported here."""


def measure_sensors() -> Iterable[Figure]:
    """Distances per second, ours and nxt-python's; takes some 15 s."""
    with _served() as link:
        ours_hz, age_ms = _ours(link)
        peer_hz = _nxt_python(link)
    yield Figure(f"distances over a {LATENCY_MS} ms link", ours_hz, "1/s")
    yield Figure("their age when they are there, mean", age_ms, "ms")
    if peer_hz is None:
        yield Figure("nxt-python is not installed; pip install nxt-python to compare", float("nan"), "")
        return
    yield Figure("nxt-python's on the same link, own process", peer_hz, "1/s")
    ratio = ours_hz / peer_hz
    yield Figure("distances / nxt-python's", ratio, "x", f">= {GOAL:g}", ratio >= GOAL)


@contextlib.contextmanager
def _served() -> Iterator[Path]:
    """A simulated brick in real time in a process of its own; its serial port."""
    with tempfile.TemporaryDirectory() as folder:
        link = Path(folder) / "nxt"
        command = [sys.executable, "-m", "nxtdrive.cli.main", "sim", "serve", "--json"]
        command += ["--pty", str(link), "--latency-ms", str(LATENCY_MS)]
        with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:  # noqa: S603 - our own program
            try:
                if server.stdout is None or json.loads(server.stdout.readline())["event"] != "serving":
                    raise RuntimeError("the simulated brick does not serve")
                yield link
            finally:
                server.terminate()
                server.communicate(timeout=PATIENCE_S)


def _ours(link: Path) -> tuple[float, float]:
    """Readings per second, and their mean age."""
    with open_brick(f"serial://{link}") as brick:
        sonar = brick.ultrasonic(SONAR_PORT)
        sonar.set_up()
        ages, begun = [], time.perf_counter()
        for _ in range(READINGS):
            reading = sonar.measure()
            ages.append(reading.age_s(brick.now()))
        took_s = time.perf_counter() - begun
    return READINGS / took_s, sum(ages) / len(ages) * 1000


def _nxt_python(link: Path) -> float | None:
    done = subprocess.run(  # noqa: S603 - our own interpreter on the text above
        [sys.executable, "-c", NXT_PYTHON, str(link), str(SONAR_PORT), str(READINGS)],
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )
    if done.returncode == 3:
        return None
    if done.returncode:
        raise RuntimeError(f"nxt-python failed: {done.stderr}")
    return float(done.stdout)
