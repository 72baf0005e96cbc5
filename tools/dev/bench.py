"""Benchmark protocol, import, simulation and detectors, and list all areas. Run it with ``nxtdrive bench``.

Figures are medians over repeats within one run. Where possible, goals are ratios between figures of the same run, so
that they hold on fast and slow machines alike. CPU time is the time of this process.
"""

from __future__ import annotations

import itertools
import os
import platform
import statistics
import struct
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import partial
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from typing import TYPE_CHECKING, cast

import nxtdrive
from firmware_protocol.direct import GetOutputState, OutputState
from firmware_protocol.enums import OutputMode, OutputPort, RegulationMode, RunState
from nxtdrive.brick import Brick
from nxtdrive.mission.camera import GEOMETRIC, SIMULATED
from nxtdrive.mission.files import PICTURES
from nxtdrive.mission.run import run_mission

from .bench_peer import output_of, run_nxt_python

if TYPE_CHECKING:
    from nxtdrive.vision.detection import Image

REPEATS = 7
"""Repeats of each measurement; the median is reported."""


@dataclass(frozen=True, slots=True)
class Figure:
    """One measured number.

    Attributes:
        name: What was measured.
        value: The median.
        unit: Unit of the value.
        goal: The goal as text, or an empty string.
        met: Whether the goal is met; None without a goal.
        peer: nxt-python's value, measured in the same run; None without a counterpart, or when it is not installed.
    """

    name: str
    value: float
    unit: str
    goal: str = ""
    met: bool | None = None
    peer: float | None = None


AREAS: dict[str, tuple[str, str]] = {
    "protocol": ("bench", "measure_protocol"),
    "import": ("bench", "measure_import"),
    "simulation": ("bench", "measure_simulation"),
    "firmware": ("bench_firmware", "measure_firmware"),
    "detectors": ("bench", "measure_detectors"),
    "doors": ("bench_doors", "measure_doors"),
    "behaviors": ("bench_behaviors", "measure_behaviors"),
    "motion": ("bench_motion", "measure_motion"),
    "nxt-python": ("bench_nxt_python", "measure_nxt_python"),
    "sensors": ("bench_sensors", "measure_sensors"),
    "web": ("bench_web", "measure_web"),
    "classroom": ("bench_classroom", "measure_classroom"),
}
"""Area to (module in this package, function that yields figures); a module is imported when its area is measured."""

DRIVER = "driver"
DRIVER_AREAS = ("protocol", "doors", "motion", "nxt-python", "sensors")
"""The areas of the driver and their common name; they compare with nxt-python where it has a counterpart."""

REAL_AREAS = ("motion", "nxt-python")
"""Areas that can be measured on a real brick; their functions take its address."""


def measure(area: str, address: str | None = None) -> Iterable[Figure]:
    """Yield the figures of one area as they are measured.

    Args:
        area: One of `AREAS`.
        address: A real brick, for one of `REAL_AREAS`; None for the simulator.
    """
    module, function = AREAS[area]
    measure_area = getattr(import_module(f".{module}", __package__), function)
    return cast("Iterable[Figure]", measure_area() if address is None else measure_area(address))


def conditions() -> dict[str, object]:
    """Return the conditions of a measurement: time, machine, versions, and the machine's load."""
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {
        "time": datetime.now(UTC).isoformat(timespec="seconds"),
        "system": platform.platform(),
        "python": platform.python_version(),
        "cores": os.cpu_count(),
        "load": load,
        "nxtdrive": nxtdrive.__version__,
        "nxt-python": version("nxt-python") if find_spec("nxt") else None,
    }


class NullTransport:
    """A transport without a brick: the reply is always available."""

    address = "null://"
    max_telegram = 64
    simulated = True  # keeps the driver from starting threads, which would disturb the measurement

    def __init__(self, answer: bytes) -> None:
        self._answer = answer

    def send(self, telegram: bytes) -> None:
        """Drop the telegram."""

    def receive(self, timeout_s: float) -> bytes:  # noqa: ARG002 - the answer is there at once
        """Return the reply."""
        return self._answer

    def waiting(self) -> bool:
        """Return False: nothing arrives without a request."""
        return False

    def close(self) -> None:
        """Do nothing."""

    now = staticmethod(time.monotonic)
    sleep = staticmethod(time.sleep)


def call_us(action: Callable[[], object], number: int = 50_000, repeats: int = REPEATS) -> float:
    """Return the time of one call in microseconds, the median of the repeats, each of which has this many calls."""
    rounds = []
    for _ in range(repeats):
        begun = time.perf_counter()
        for _ in range(number):
            action()
        rounds.append((time.perf_counter() - begun) / number * 1e6)
    return statistics.median(rounds)


def measure_protocol() -> Iterable[Figure]:
    """Measure encoding, decoding and a request of GetOutputState against bare `struct` and nxt-python."""
    state = OutputState(
        OutputPort.A, 75, OutputMode.MOTOR_ON, RegulationMode.SPEED, 0, RunState.RUNNING, 360, 123, 123, 4567
    )
    command, answer = GetOutputState(OutputPort.A), GetOutputState.encode_reply(state)
    pack, unpack = struct.Struct("<BBB").pack, struct.Struct("<BBBBbBBbBIiii").unpack
    brick = Brick(NullTransport(answer))
    floor_us = call_us(lambda: (pack(0, 6, 0), unpack(answer)))
    request_us = call_us(lambda: brick.request(GetOutputState(OutputPort.A)))
    printed = run_nxt_python(NXT_PYTHON, answer.hex(), str(REPEATS))
    peer_us = None if printed is None else float(printed)
    yield Figure("bare struct: pack 3 bytes, unpack 25", floor_us, "µs")
    yield Figure("encode GetOutputState", call_us(command.encode), "µs")
    yield Figure("decode its reply", call_us(lambda: GetOutputState.decode_reply(answer)), "µs")
    yield Figure("request of a motor's state over a null transport", request_us, "µs", peer=peer_us)
    yield at_most("request / bare struct", request_us / floor_us, "x", 8.0)
    if peer_us is not None:
        yield at_most("request / nxt-python", request_us / peer_us, "x", 0.35)


NXT_PYTHON = """
answer = bytes.fromhex(sys.argv[1])
class Socket:
    type = "null"
    def send(self, data): pass
    def recv(self, size=64): return answer
    def close(self): pass
brick = nxt.brick.Brick(Socket())
rounds = []
for _ in range(int(sys.argv[2])):
    begun = time.perf_counter()
    for _ in range(20000):
        brick.get_output_state(nxt.motor.Port.A)
    rounds.append((time.perf_counter() - begun) / 20000 * 1e6)
print(statistics.median(rounds))
"""


def measure_import() -> Iterable[Figure]:
    """Measure the CPU time of importing the driver without the interpreter's own; modules load on first use."""
    yield at_most("import nxtdrive, CPU", _import_cpu_ms("import nxtdrive"), "ms", 60.0)
    yield at_most("from nxtdrive import open_brick, CPU", _import_cpu_ms("from nxtdrive import open_brick"), "ms", 45.0)


def _import_cpu_ms(statement: str) -> float:
    code = f"import time; begun = time.process_time(); {statement}; print((time.process_time() - begun) * 1e3)"
    return statistics.median(float(output_of("-c", code)) for _ in range(REPEATS))


def measure_simulation() -> Iterable[Figure]:
    """Measure the built-in mission with rendering and detection, and with geometric vision, which skips both."""
    for name, camera, goal in (("camera", SIMULATED, 5.0), ("geometric vision", GEOMETRIC, 100.0)):
        begun = time.perf_counter()
        report = run_mission(nxt="sim://", camera=camera)
        wall_s = time.perf_counter() - begun
        yield Figure(f"built-in mission with {name}: simulated time", report.duration_s, "s")
        yield Figure(f"built-in mission with {name}: wall time", wall_s, "s")
        yield at_least(f"simulated / wall time with {name}", report.duration_s / wall_s, "x", goal)


DETECTORS: dict[str, dict[str, object]] = {
    "picture": {"detector": "picture", "pictures": [str(PICTURES / "lena.png")]},
    "picture, target not there": {"detector": "picture", "pictures": [str(PICTURES / "rilakkuma.png")]},
    "haar": {"detector": "haar"},
    "marker": {"detector": "marker", "id": 7},
    "qr": {"detector": "qr", "text": "7"},
    "color": {"detector": "color", "color": "red"},
}


def measure_detectors() -> Iterable[Figure]:
    """Measure each detector on a frame of the simulated camera that shows lena 2 m ahead."""
    from nxtdrive.vision.detectors import make_detector
    from sim_backend.simulation import Simulation

    for size in ((320, 240), (640, 480)):
        frame = Simulation("open", camera_size=size).camera_frame()
        if frame is None:
            raise RuntimeError("the simulated camera of world 'open' gives no frame")
        for name, spec in DETECTORS.items():
            detector = make_detector(spec).detector
            took_us = call_us(partial(detector.detect, frame), number=3)
            yield Figure(f"detector {name}, {size[0]}x{size[1]}", took_us / 1000, "ms/frame")
        yield from _measure_free_floor(frame)
        yield _measure_gyroscope(frame)
    yield from _measure_several_pictures()


def _measure_free_floor(frame: Image) -> Iterable[Figure]:
    """Measure where the free floor ends in a frame, and what it takes to learn the floor from it."""
    from nxtdrive.vision.free_floor import FreeFloorDetector

    detector, height, width = FreeFloorDetector(), *frame.shape[:2]
    seconds = itertools.count()

    def learn() -> None:
        time_s = float(next(seconds))
        detector.keep(frame, time_s)
        detector.learn(time_s)

    learn_us = call_us(learn, number=3)
    yield at_most(f"free floor, {width}x{height}", call_us(partial(detector.ends, frame), 3) / 1000, "ms/frame", 5)
    yield Figure(f"free floor, learning it, {width}x{height}", learn_us / 1000, "ms/frame")


def _measure_gyroscope(frame: Image) -> Figure:
    from nxtdrive.vision.geometry import Pinhole
    from nxtdrive.vision.visual_gyroscope import VisualGyroscope

    height, width = frame.shape[:2]
    measure = partial(VisualGyroscope().turned_deg, frame, Pinhole.from_hfov(width).resized(width, height))
    return at_most(f"visual gyroscope, {width}x{height}", call_us(measure, 3) / 1000, "ms/frame", 5)


def _measure_several_pictures() -> Iterable[Figure]:
    """Measure looks for several pictures at once against the mean look for one of them; none is in the frame."""
    from nxtdrive.vision.detection import Detector
    from nxtdrive.vision.detectors.picture import PictureDetector
    from nxtdrive.vision.detectors.shared_frame import detect_each
    from nxtdrive.vision.sources import read_image
    from sim_backend.simulation import Simulation

    frame = Simulation("arena", camera_size=(320, 240)).camera_frame()
    if frame is None:
        raise RuntimeError("the simulated camera of world 'arena' gives no frame")
    detectors: dict[str, Detector] = {}
    for path in sorted(PICTURES.glob("*.png")):
        whole = read_image(path)
        half = whole.shape[0] // 2
        for part, image in (("whole", whole), ("top", whole[:half]), ("bottom", whole[half:])):
            if len(detectors) < 12:
                detectors[f"{path.stem} {part}"] = PictureDetector([image])
    one_us = [call_us(partial(detect_each, {name: one}, frame), number=1) for name, one in detectors.items()]
    for number in (3, len(detectors)):
        several = dict(itertools.islice(detectors.items(), number))
        several_us = call_us(partial(detect_each, several, frame), number=1)
        yield Figure(f"{number} pictures at once, 320x240", several_us / 1000, "ms/frame")
        yield at_most(f"{number} pictures / one, 320x240", several_us / statistics.mean(one_us), "x", 2.0)


def at_most(name: str, value: float, unit: str, goal: float) -> Figure:
    """Return a figure that is good when it is small."""
    return Figure(name, value, unit, f"<= {goal:g}", value <= goal)


def at_least(name: str, value: float, unit: str, goal: float) -> Figure:
    """Return a figure that is good when it is large."""
    return Figure(name, value, unit, f">= {goal:g}", value >= goal)
