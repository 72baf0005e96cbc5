"""Measure how often a distance can be read over a slow link, compared with nxt-python on the same link.

Both are external clients of the same simulated brick, behind a serial port with the latency of a radio; times are wall
time.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

from nxtdrive.brick import open_brick
from nxtdrive.ports import SensorPort

from .bench import Figure, at_least
from .bench_peer import run_nxt_python, served, where

LATENCY_MS = 45
"""Latency of a good Bluetooth link."""
READINGS = 60
GOAL = 2.0
SONAR_PORT: SensorPort = 4

NXT_PYTHON = """
port, readings = int(sys.argv[2]), int(sys.argv[3])
with nxt.locator.find(**json.loads(sys.argv[1])) as brick:
    sonar = brick.get_sensor(nxt.sensor.Port(port - 1), nxt.sensor.generic.Ultrasonic)
    sonar.get_distance()
    begun = time.perf_counter()
    for _ in range(readings):
        sonar.get_distance()
    print(readings / (time.perf_counter() - begun))
"""


def measure_sensors() -> Iterable[Figure]:
    """Measure distances per second, ours and nxt-python's; takes about 15 s."""
    with served(LATENCY_MS) as address:
        ours_hz, age_ms = _ours(address)
        printed = run_nxt_python(NXT_PYTHON, where(address), str(SONAR_PORT), str(READINGS))
    peer_hz = None if printed is None else float(printed)
    yield Figure(f"distances over a {LATENCY_MS} ms link", ours_hz, "1/s", peer=peer_hz)
    yield Figure("their age when they are there, mean", age_ms, "ms")
    if peer_hz is not None:
        ratio = ours_hz / peer_hz
        yield at_least("distances / nxt-python's", ratio, "x", GOAL)


def _ours(address: str) -> tuple[float, float]:
    """Return readings per second and their mean age."""
    with open_brick(address) as brick:
        sonar = brick.ultrasonic(SONAR_PORT)
        sonar.set_up()
        ages, begun = [], time.perf_counter()
        for _ in range(READINGS):
            reading = sonar.measure()
            ages.append(reading.age_s(brick.now()))
        took_s = time.perf_counter() - begun
    return READINGS / took_s, sum(ages) / len(ages) * 1000
