"""Measure the page's server on loopback: delay of pictures, of the joystick, CPU time, size and import time.

Clients are separate processes. All processes of a computer share one monotonic clock, which gives the delays.
"""

from __future__ import annotations

import json
import re
import socket
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import TypeVar, cast

from nxtdrive.mission.files import read_mission_file
from nxtdrive.transports.address import Address
from nxtdrive.transports.sim import SimTransport

from ..web.app import Server, serve
from ..web.hub import FRAME, Hub
from ..web.missions import Missions
from ..web.robot import Robot
from ..web.runs import Runs
from .bench import Figure, at_most
from .bench_peer import output_of

T = TypeVar("T")
SECONDS = 10.0
"""How long pictures are received, and CPU time is measured."""
DRIVES = 25
"""How often the joystick is moved from rest."""
MOTOR_COMMANDS = (b"\x80\x04", b"\x81\x95")
"""How telegrams that drive motors begin: SetOutputState, and a write into the output module's IO map."""
DELAY_P50_MS, DELAY_P95_MS, JOYSTICK_MS, SIZE_MB = 10.0, 30.0, 5.0, 4.0
CPU_PERCENT = {1: 3.0, 12: 15.0}
"""Goals; of the CPU for this many further clients."""

WATCH = """
import asyncio, json, struct, sys, time, websockets
async def watch(url, until):
    seen = []
    async with websockets.connect(url) as page:
        while time.monotonic() < until:
            message = await page.recv()
            if isinstance(message, bytes) and message[0] == 1:
                seen.append((struct.unpack_from("<I", message, 4)[0], time.monotonic()))
    return seen
async def main(url, clients, seconds):
    until = time.monotonic() + seconds
    print(json.dumps((await asyncio.gather(*[watch(url, until) for _ in range(clients)]))[0]))
asyncio.run(main(sys.argv[1], int(sys.argv[2]), float(sys.argv[3])))
"""
DRIVE = """
import asyncio, json, sys, time, websockets
async def main(url, number):
    sent, latency_ms = [], []
    async with websockets.connect(url) as page:
        async def read():
            async for message in page:
                if isinstance(message, str) and '"latency_ms"' in message:
                    latency_ms.append(json.loads(message)["latency_ms"])
        async def steer(ahead):
            await page.send(json.dumps({"type": "drive", "ahead": ahead, "turn": 0}))
        reading = asyncio.create_task(read())
        for trial in range(number):
            await steer(0)
            await asyncio.sleep(0.4 + 0.1 * trial / number)
            sent.append(time.monotonic())
            await steer(0.5)
            await asyncio.sleep(0.2)
        await steer(0)
        reading.cancel()
    print(json.dumps([sent, latency_ms]))
asyncio.run(main(sys.argv[1], int(sys.argv[2])))
"""


class TimedHub(Hub):
    """A hub that notes when each frame is handed to it."""

    def __init__(self) -> None:
        super().__init__()
        self.frames: dict[int, float] = {}

    def show_image(self, kind: int, number: int, time_s: float, encoded: bytes) -> None:
        """Send an image."""
        if kind == FRAME:
            self.frames[number] = time.monotonic()
        super().show_image(kind, number, time_s, encoded)


@contextmanager
def running(hub: Hub, address: str = "sim://open?pace=realtime") -> Iterator[str]:
    """Serve a page of this process; yields the address of its WebSocket."""
    with tempfile.TemporaryDirectory() as name, socket.create_server(("127.0.0.1", 0)) as listener:
        folder, ready = Path(name), threading.Event()
        robot = Robot(Address.parse(address), None, read_mission_file(None), hub, folder / "runs")
        server = Server(robot, hub, Missions(folder), Runs(folder / "runs"), address)
        thread = threading.Thread(target=serve, args=(server, robot, listener, ready.set))
        thread.start()
        try:
            ready.wait()
            yield f"ws://127.0.0.1:{listener.getsockname()[1]}/ws"
        finally:
            robot.close()
            thread.join()


def measure_web(*, seconds: float = SECONDS, drives: int = DRIVES) -> Iterable[Figure]:
    """Measure delays, CPU share, size and import."""
    hub = TimedHub()
    with _motor_telegrams() as telegrams, running(hub) as url:
        before = _cpu_percent(partial(time.sleep, seconds))[0]
        yield Figure("page, CPU of robot and server without clients", before, "%")
        clients = 0
        for more, most in CPU_PERCENT.items():
            clients += more
            percent, seen = _cpu_percent(partial(_client, WATCH, url, clients, seconds))
            yield Figure(f"page, CPU of robot and server, clients: {clients}", percent, "%")
            yield at_most(f"page, CPU added by clients: {more} more", percent - before, "%", most)
            before = percent
            delays_ms = [(at_s - hub.frames[int(number)]) * 1000 for number, at_s in seen if number in hub.frames]
            yield Figure(f"page, pictures a second, clients: {clients}", len(seen) / seconds, "1/s")
            p50, p95 = statistics.median(delays_ms), statistics.quantiles(delays_ms, n=20)[-1]
            yield at_most(f"page, delay of a picture p50, clients: {clients}", p50, "ms", DELAY_P50_MS)
            yield at_most(f"page, delay of a picture p95, clients: {clients}", p95, "ms", DELAY_P95_MS)
        yield _joystick(url, drives, telegrams)
    yield at_most("extra web, installed, without bytecode", installed_mb("web"), "MB", SIZE_MB)
    yield at_most("modules of the extra web that `import nxtdrive` loads", _loaded("import nxtdrive"), "", 0)
    yield at_most(
        "modules of the extra web that `nxtdrive list` loads",
        _loaded("import nxtdrive.cli.commands.list_bricks"),
        "",
        0,
    )


def _joystick(url: str, drives: int, telegrams: list[float]) -> Figure:
    sent, latency_ms = _client(DRIVE, url, drives)
    delays_ms = [(min(at for at in telegrams if at >= begun) - begun) * 1000 for begun in sent]
    above = statistics.median(delays_ms) - statistics.median(latency_ms)
    return at_most("joystick message to telegram p50, above the link's latency", above, "ms", JOYSTICK_MS)


@contextmanager
def _motor_telegrams() -> Iterator[list[float]]:
    """Note when a telegram that moves a motor is sent to a simulated brick that is opened within."""
    times: list[float] = []
    send = SimTransport.send

    def noting(transport: SimTransport, telegram: bytes) -> None:
        if telegram.startswith(MOTOR_COMMANDS):
            times.append(time.monotonic())
        send(transport, telegram)

    SimTransport.send = noting  # type: ignore[assignment, method-assign]
    try:
        yield times
    finally:
        SimTransport.send = send  # type: ignore[method-assign]


def _cpu_percent(action: Callable[[], T]) -> tuple[float, T]:
    """Return the CPU time of this process, as a share of one core, while an action waits for others, and its result."""
    begun_s, begun_cpu_s = time.perf_counter(), time.process_time()
    result = action()
    return 100 * (time.process_time() - begun_cpu_s) / (time.perf_counter() - begun_s), result


def _client(program: str, *arguments: object) -> list[list[float]]:
    return cast("list[list[float]]", json.loads(output_of("-c", program, *map(str, arguments))))


def installed_mb(extra: str) -> float:
    """Return the size of the packages that an extra adds to those that nxtdrive needs anyway, without bytecode."""
    added = _needed(extra) - _needed("")
    files = [Path(str(path.locate())) for name in added for path in distribution(name).files or ()]
    return sum(path.stat().st_size for path in files if path.is_file() and path.suffix != ".pyc") / 1e6


def _needed(extra: str) -> set[str]:
    """Return the normalised names of the installed distributions that nxtdrive needs with an extra."""
    found: set[str] = set()
    waiting = [("nxtdrive", extra)]
    while waiting:
        each, with_extra = waiting.pop()
        for requirement in distribution(each).requires or []:
            if "extra ==" in requirement and not re.search(f"extra == ['\"]{with_extra}['\"]", requirement):
                continue
            key = re.sub(r"[-_.]+", "-", re.split(r"[^\w.-]", requirement)[0]).lower()
            if key not in found:
                with suppress(PackageNotFoundError):  # another system's or another Python's
                    distribution(key)
                    found.add(key)
                    waiting.append((key, ""))
    return found


def _loaded(statement: str) -> int:
    """Return how many modules of the extra's packages a statement loads."""
    packages = ("starlette", "uvicorn", "websockets", "anyio", "segno", "tomlkit")
    code = f"import sys; {statement}; print(sum(name.split('.')[0] in {packages} for name in sys.modules))"
    return int(output_of("-c", code))
