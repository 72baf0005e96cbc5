"""Benchmark the simulated brick and its doors: telegrams, passes, memory.

A link never replies before the brick's next pass of one millisecond, so no door can exceed about a thousand round
trips per second; the shortfall is the cost of the door. A brick in the same process does not wait for passes.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from firmware_protocol.direct import GetBatteryLevel, SetOutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from nxtdrive.brick import open_brick
from sim_backend.firmware.brick import SimBrick
from sim_backend.firmware.motors.bench_motor import BenchMotor

from .bench import Figure, call_us
from .bench_peer import output_of, run_nxt_python, serving, where

ROUND_TRIPS = 500
"""Round trips in each repeat over a door."""

REPEATS = 5
PASSES = 20_000
GET_BATTERY = GetBatteryLevel().encode()
SIM_EXEC = (sys.executable, "-m", "nxtdrive", "sim", "exec", "--")
"""Runs a program with the simulated brick on its USB bus."""

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
"""A program that uses only pyusb."""

DRIVER_CLIENT = """
import sys
from nxtdrive.tools.dev.bench_doors import over
print(over(sys.argv[1], *map(int, sys.argv[2:])))
"""
NXT_PYTHON = """
number, repeats = map(int, sys.argv[2:])
with nxt.locator.find(**json.loads(sys.argv[1])) as brick:
    rates = []
    for _ in range(repeats):
        begun = time.perf_counter()
        for _ in range(number):
            brick.get_battery_level()
        rates.append(number / (time.perf_counter() - begun))
print(statistics.median(rates))
"""

STATUS = Path("/proc/self/status")
"""Where Linux reports a process's memory; `resource` includes that of the parent."""

MEMORY_KB = "{}; print(next(line.split()[1] for line in open('" + str(STATUS) + "') if line.startswith('VmHWM')))"
"""Prints the peak memory of the process, kilobytes."""

BRICK = "from sim_backend.firmware.brick import SimBrick; brick = SimBrick(); brick.receive(bytes((0, 11)))"


def measure_doors(*, round_trips: int = ROUND_TRIPS, repeats: int = REPEATS, passes: int = PASSES) -> Iterable[Figure]:
    """Yield every figure as it is measured.

    Args:
        round_trips: GetBatteryLevel and its reply, in each repeat.
        repeats: Number of repeats, of which the median is reported.
        passes: Passes of the firmware in each repeat.
    """
    yield Figure("telegrams to the simulated brick, in process", _in_process(round_trips * 20, repeats), "1/s")
    with tempfile.TemporaryDirectory() as folder:
        pty = ["--pty", str(Path(folder) / "nxt")] if sys.platform != "win32" else []
        with serving(*pty, "--tcp", "0", "--nxt-server", "0", "--world", "open") as addresses:
            for address in addresses:
                scheme = address.partition("://")[0]
                peer = None if scheme == "tcp" else _nxt_python_over(address, round_trips, repeats)
                yield Figure(f"requests over {scheme}", over(address, round_trips, repeats), "1/s", peer=peer)
    numbers = (str(round_trips), str(repeats))
    bare = float(output_of("-c", USB_CLIENT, *numbers, through=SIM_EXEC))
    ours = float(output_of("-c", DRIVER_CLIENT, "usb://", *numbers, through=SIM_EXEC))
    peer = _nxt_python_over("usb://", round_trips, repeats, SIM_EXEC)
    yield Figure("telegrams over USB (sim exec, bare pyusb)", bare, "1/s")
    yield Figure("requests over USB (sim exec)", ours, "1/s", peer=peer)
    yield Figure("firmware passes of 1 ms, three regulated motors", _passes(passes, repeats), "ms/ms")
    if STATUS.exists():
        yield Figure("memory of one brick, over the interpreter", _memory_mb(repeats), "MB")


def _rate(action: Callable[[], object], number: int, repeats: int) -> float:
    """Return calls per second, the median of the repeats."""
    return 1e6 / call_us(action, number, repeats)


def _in_process(number: int, repeats: int) -> float:
    brick = SimBrick()

    def ask() -> None:
        brick.receive(GET_BATTERY)
        brick.tick()

    return _rate(ask, number, repeats)


def over(address: str, number: int, repeats: int) -> float:
    """Return the driver's requests per second at an address, the median of the repeats."""
    with open_brick(address) as brick:
        return _rate(lambda: brick.request(GetBatteryLevel()), number, repeats)


def _nxt_python_over(address: str, number: int, repeats: int, through: Sequence[str] = ()) -> float | None:
    printed = run_nxt_python(NXT_PYTHON, where(address), str(number), str(repeats), through=through)
    return None if printed is None else float(printed)


def _passes(number: int, repeats: int) -> float:
    brick = SimBrick()
    for port in OutputPort.A, OutputPort.B, OutputPort.C:
        brick.attach_motor(port.name, BenchMotor())
        mode = OutputMode.MOTOR_ON | OutputMode.REGULATED
        brick.receive(SetOutputState(port, 75, mode, RegulationMode.SPEED, 0, RunState.RUNNING, 0).encode())
    return _rate(lambda: brick.tick(number), 1, repeats) * number / 1000


def _memory_mb(repeats: int) -> float:
    def median_kb(statement: str) -> float:
        return statistics.median(float(output_of("-c", MEMORY_KB.format(statement))) for _ in range(repeats))

    return (median_kb(BRICK) - median_kb("pass")) / 1024
