"""Measure a class of simulated robots: CPU time, and whether each robot keeps up with real time."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nxtdrive.mission import setup

from ..web.classroom.app import ClassroomServer, serve_class
from ..web.classroom.classroom import Classroom
from ..web.classroom.config import simulated_class
from .bench import Figure

ROBOTS = 12
SECONDS = 20.0
"""How long each state of the class is measured."""
SETTLE_S = 3.0
CORE_PERCENT, REAL_TIME = 100.0, 0.98
"""Goals: within one core, for threads of Python share one; each robot's simulated seconds per second."""

WATCH = """
import asyncio, json, sys, websockets
async def main(url):
    async with websockets.connect(url) as page:
        robots = [robot["name"] for robot in json.loads(await page.recv())["robots"]]
        await page.send(json.dumps({"type": "visible", "robots": robots}))
        async for message in page:
            pass
asyncio.run(main(sys.argv[1]))
"""


def measure_classroom(
    *, robots: int = ROBOTS, seconds: float = SECONDS, settle_s: float = SETTLE_S
) -> Iterable[Figure]:
    """Measure a class whose page is open, at rest and with the built-in mission on every robot."""
    with _running(robots) as classroom:
        yield from _measured(f"class of {robots}, at rest", classroom, seconds, settle_s)
        for profile in ("thesis", "adaptive"):
            for station in classroom.stations:
                station.start("", profile)
            yield from _measured(f"class of {robots}, {profile} missions", classroom, seconds, settle_s)
            for station in classroom.stations:
                station.end_mission()
            _await(lambda: not any(station.hub.running for station in classroom.stations))


def _await(happens: Callable[[], bool]) -> None:
    while not happens():
        time.sleep(0.05)


def _measured(name: str, classroom: Classroom, seconds: float, settle_s: float) -> Iterator[Figure]:
    time.sleep(settle_s)
    stations = classroom.stations
    begun_s, begun_cpu_s, begun = time.perf_counter(), time.process_time(), [station.time_s for station in stations]
    time.sleep(seconds)
    lasted_s, cpu_s = time.perf_counter() - begun_s, time.process_time() - begun_cpu_s
    slowest = min(station.time_s - since_s for station, since_s in zip(stations, begun, strict=True)) / lasted_s
    percent = 100 * cpu_s / lasted_s
    yield Figure(f"{name}: CPU of robots and server", percent, "%", f"<= {CORE_PERCENT:g}", percent <= CORE_PERCENT)
    yield Figure(f"{name}: slowest robot's simulated time", slowest, "s/s", f">= {REAL_TIME}", slowest >= REAL_TIME)


@contextmanager
def _running(robots: int) -> Iterator[Classroom]:
    """Serve a class in this process, with one page open that shows all its tiles."""
    with tempfile.TemporaryDirectory() as name, socket.create_server(("127.0.0.1", 0)) as listener:
        folder, ready = Path(name), threading.Event()
        classroom = Classroom(simulated_class(robots, folder, folder / "runs"), setup.load(None))
        thread = threading.Thread(
            target=serve_class, args=(ClassroomServer(classroom), listener, ready.set), daemon=True
        )
        thread.start()
        ready.wait()
        url = f"ws://127.0.0.1:{listener.getsockname()[1]}/ws"
        page = subprocess.Popen([sys.executable, "-c", WATCH, url])  # noqa: S603 - our own interpreter
        try:
            _await(lambda: all(station.is_open for station in classroom.stations))
            yield classroom
        finally:
            page.kill()
            page.wait()
            classroom.close()
