"""Measures the simulated brick and its doors: telegrams, passes, memory.

A link never answers sooner than the brick's next pass of one millisecond, so no door can do more than about a thousand
round trips a second; how far below it is, is what the door costs. In process nobody waits for passes.
"""

from __future__ import annotations

import contextlib
import json
import socket
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from firmware_protocol.direct import GetBatteryLevel, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from nxtdrive.brick import open_brick
from sim_backend.firmware.bench_motor import BenchMotor
from sim_backend.firmware.brick import SimBrick

from .bench import Figure

ROUND_TRIPS = 500
"""In each repeat over a door."""

REPEATS = 5
PASSES = 20_000
GET_BATTERY = GetBatteryLevel().encode()
REPLY_SIZE = 5

USB_CLIENT = """
import statistics, sys, time, usb.core
brick = usb.core.find(idVendor=0x0694, idProduct=0x0002)
number, repeats = map(int, sys.argv[1:])
rates = []
for _ in range(repeats):
    begun = time.perf_counter()
    for _ in range(number):
        brick.write(0x01, b"\\x00\\x0b")
        brick.read(0x82, 64)
    rates.append(number / (time.perf_counter() - begun))
print(statistics.median(rates))
"""
"""A program that knows only pyusb."""

STATUS = Path("/proc/self/status")
"""Where Linux tells a process its memory; what `resource` tells includes that of the parent."""

MEMORY_KB = "{}; print(next(line.split()[1] for line in open('" + str(STATUS) + "') if line.startswith('VmHWM')))"
"""Prints the most memory the process has had, kilobytes."""

BRICK = "from sim_backend.firmware.brick import SimBrick; brick = SimBrick(); brick.receive(bytes((0, 11)))"


def measure_doors(*, round_trips: int = ROUND_TRIPS, repeats: int = REPEATS, passes: int = PASSES) -> Iterable[Figure]:
    """Every figure, one after the other, as they are measured.

    Args:
        round_trips: GetBatteryLevel and its reply, in each repeat.
        repeats: The median of so many is reported.
        passes: Of the firmware, in each repeat.
    """
    yield Figure("telegrams to the simulated brick, in process", _in_process(round_trips * 20, repeats), "1/s")
    with _served() as doors:
        for name, ask in doors.items():
            yield Figure(f"telegrams over {name}", _rate(ask, round_trips, repeats), "1/s")
    yield Figure("telegrams over USB (sim exec, pyusb)", _over_usb(round_trips, repeats), "1/s")
    yield Figure("firmware passes of 1 ms, three regulated motors", _passes(passes, repeats), "ms/ms")
    if STATUS.exists():
        yield Figure("memory of one brick, over the interpreter", _memory_mb(repeats), "MB")


def _rate(action: Callable[[], object], number: int, repeats: int) -> float:
    """Calls a second, the median of the repeats."""
    rates = []
    for _ in range(repeats):
        begun = time.perf_counter()
        for _ in range(number):
            action()
        rates.append(number / (time.perf_counter() - begun))
    return statistics.median(rates)


def _in_process(number: int, repeats: int) -> float:
    brick = SimBrick()

    def ask() -> None:
        brick.receive(GET_BATTERY)
        brick.tick()

    return _rate(ask, number, repeats)


@contextlib.contextmanager
def _served() -> Iterator[dict[str, Callable[[], object]]]:
    """Ways to ask a brick that another process serves, by the name of their door."""
    with contextlib.ExitStack() as closing:
        folder = closing.enter_context(tempfile.TemporaryDirectory())
        pty = ["--pty", str(Path(folder) / "nxt")] if sys.platform != "win32" else []
        command = ["sim", "serve", *pty, "--tcp", "0", "--nxt-server", "0", "--world", "open", "--json"]
        server = closing.enter_context(
            subprocess.Popen(  # noqa: S603 - our own interpreter
                [sys.executable, "-m", "nxtdrive.cli.main", *command], stdout=subprocess.PIPE, text=True
            )
        )
        closing.callback(server.terminate)
        if server.stdout is None:
            raise RuntimeError("the server has no output")
        addresses = json.loads(server.stdout.readline())["doors"]
        yield {address.partition("://")[0]: _asking(address, closing) for address in addresses}


def _asking(address: str, closing: contextlib.ExitStack) -> Callable[[], object]:
    """One question and its answer at that door."""
    scheme, _, target = address.partition("://")
    if scheme != "nxt-server":
        brick = closing.enter_context(open_brick(address))
        return lambda: brick.request(GetBatteryLevel())
    host, _, port = target.rpartition(":")
    line = closing.enter_context(socket.create_connection((host, int(port)), timeout=10))
    line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def ask() -> None:
        line.sendall(GET_BATTERY)
        if len(line.recv(REPLY_SIZE)) != REPLY_SIZE:
            raise RuntimeError(f"{address} gave no whole answer")

    return ask


def _over_usb(number: int, repeats: int) -> float:
    words = ["sim", "exec", "--", sys.executable, "-c", USB_CLIENT, str(number), str(repeats)]
    return float(_output(["-m", "nxtdrive.cli.main", *words]))


def _passes(number: int, repeats: int) -> float:
    brick = SimBrick()
    for port in OutputPort.A, OutputPort.B, OutputPort.C:
        brick.attach_motor(port.name, BenchMotor())
        mode = OutputMode.MOTOR_ON | OutputMode.REGULATED
        brick.receive(SetOutputState(port, 75, mode, RegulationMode.SPEED, 0, RunState.RUNNING, 0).encode())
    return _rate(lambda: brick.tick(number), 1, repeats) * number / 1000


def _memory_mb(repeats: int) -> float:
    def median_kb(statement: str) -> float:
        return statistics.median(float(_output(["-c", MEMORY_KB.format(statement)])) for _ in range(repeats))

    return (median_kb(BRICK) - median_kb("pass")) / 1024


def _output(words: list[str]) -> str:
    """What our own interpreter prints."""
    done = subprocess.run(  # noqa: S603 - our own interpreter
        [sys.executable, *words], capture_output=True, text=True, check=True, timeout=120
    )
    return done.stdout
