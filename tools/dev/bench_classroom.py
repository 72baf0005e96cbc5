"""Measure a classroom of simulated robots: CPU time, and whether each robot keeps up with real time."""

from __future__ import annotations

import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from urllib.parse import quote

from nxtdrive.mission.files import read_mission_file

from ..web.classroom.app import ClassroomServer, serve_classroom
from ..web.classroom.classroom import Classroom
from ..web.classroom.config import simulated_classroom
from .bench import Figure, at_least, at_most

ROBOTS = 12
SECONDS = 20.0
"""How long each state of the classroom is measured."""
SETTLE_S = 3.0
CORE_PERCENT, REAL_TIME = 100.0, 0.98
"""Goals: within one core, for threads of Python share one; each robot's simulated seconds per second."""

WATCH = """
import asyncio, json, sys, websockets
async def watch(url):
    async with websockets.connect(url) as page:
        hello = json.loads(await page.recv())
        if "robots" in hello:
            await page.send(json.dumps({"type": "visible", "robots": [robot["name"] for robot in hello["robots"]]}))
        async for message in page:
            pass
async def main(urls):
    await asyncio.gather(*map(watch, urls))
asyncio.run(main(sys.argv[1:]))
"""


def measure_classroom(
    *, robots: int = ROBOTS, seconds: float = SECONDS, settle_s: float = SETTLE_S
) -> Iterable[Figure]:
    """Measure a classroom at rest and with missions on all robots, with its page open, and then with all pages."""
    with _running(robots) as (classroom, url):
        pages = [f"{url}/robot/{quote(station.entry.name)}/ws" for station in classroom.stations]
        with _watching([f"{url}/ws"]):
            _await(lambda: all(station.is_open for station in classroom.stations))
            yield from _measured(f"class of {robots}, at rest", classroom, seconds, settle_s)
            for profile in ("thesis", "adaptive"):
                with _on_missions(classroom, profile):
                    yield from _measured(f"class of {robots}, {profile} missions", classroom, seconds, settle_s)
            with _watching(pages), _on_missions(classroom, "adaptive"):
                yield from _measured(f"class of {robots}, the same, each page open", classroom, seconds, settle_s)


@contextmanager
def _on_missions(classroom: Classroom, profile: str) -> Iterator[None]:
    """Run the built-in mission on every robot."""
    for station in classroom.stations:
        station.start("", profile)
    yield
    for station in classroom.stations:
        station.end_mission()
    _await(lambda: not any(station.busy for station in classroom.stations))


@contextmanager
def _watching(urls: list[str]) -> Iterator[None]:
    """Open pages in another process."""
    pages = subprocess.Popen([sys.executable, "-c", WATCH, *urls])  # noqa: S603 - our own interpreter
    try:
        yield
    finally:
        pages.kill()
        pages.wait()


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
    yield at_most(f"{name}: CPU of robots and server", percent, "%", CORE_PERCENT)
    yield at_least(f"{name}: slowest robot's simulated time", slowest, "s/s", REAL_TIME)


@contextmanager
def _running(robots: int) -> Iterator[tuple[Classroom, str]]:
    """Serve a classroom in this process; yield it and the address of its WebSockets."""
    with tempfile.TemporaryDirectory() as name, socket.create_server(("127.0.0.1", 0)) as listener:
        folder, ready = Path(name), threading.Event()
        classroom = Classroom(simulated_classroom(robots, folder, folder / "runs"), read_mission_file(None))
        server = ClassroomServer(classroom)
        threading.Thread(target=serve_classroom, args=(server, listener, ready.set), daemon=True).start()
        ready.wait()
        with closing(classroom):
            yield classroom, f"ws://127.0.0.1:{listener.getsockname()[1]}"
