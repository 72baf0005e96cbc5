"""Measure the webcam as a program in the guest sees it: frames per second, and how old a frame is."""

from __future__ import annotations

import queue
import statistics
import threading
import time
from dataclasses import dataclass

from .errors import RigError
from .rig import Rig

FRAMES = 50
COVERS = 10
WAIT_S, LIMIT_S = 10.0, 90.0

PAUSE_S = 0.37
"""Between changes; no multiple of a frame's time, so that changes fall anywhere between two frames."""

WATCH = f"""exec python3 - <<'END'
import sys, time, cv2
def say(line):
    sys.stdout.write(line + "\\n")
    sys.stdout.flush()
camera = cv2.VideoCapture(0, cv2.CAP_V4L2)
for _ in range(5):
    camera.read()
start = time.monotonic()
for _ in range({FRAMES}):
    camera.read()
say(str({FRAMES} / (time.monotonic() - start)))
for number in range({COVERS}):
    while (camera.read()[1].mean() < 8) == number % 2:
        pass
    say("light" if number % 2 else "dark")
END"""
"""Prints the frames per second, then each change of light; ends after the last one."""


@dataclass(frozen=True)
class CameraFigures:
    """Measurements by the guest's program.

    Attributes:
        frames_per_s: Frames that OpenCV read per second.
        latency_s: Median time from covering or uncovering the lens to the first frame that shows it.
        longest_s: The longest of these times.
    """

    frames_per_s: float
    latency_s: float
    longest_s: float


def measure(rig: Rig) -> CameraFigures:
    """Read the webcam in the guest with OpenCV while its lens is covered and uncovered.

    Raises:
        RigError: The program in the guest fails, or does not see what happens to the lens.
    """
    received: queue.Queue[tuple[float, str]] = queue.Queue()

    def receive(kind: str, text: str) -> None:
        for line in text.splitlines() if kind == "out" else ():
            received.put((time.monotonic(), line))

    def next_line(limit_s: float) -> tuple[float, str]:
        try:
            return received.get(timeout=limit_s)
        except queue.Empty:
            raise RigError(f"The program that reads the webcam printed nothing for {limit_s:g} s.") from None

    watching = threading.Thread(target=lambda: rig.run(WATCH, timeout_s=LIMIT_S, show=receive))
    watching.start()
    try:
        fps = float(next_line(LIMIT_S)[1])
        delays = []
        for number in range(COVERS):
            time.sleep(PAUSE_S)
            start = time.monotonic()
            rig.fault(cover=number % 2 == 0)
            delays.append(next_line(WAIT_S)[0] - start)
    finally:
        watching.join()
        rig.fault(cover=False)
    return CameraFigures(fps, statistics.median(delays), max(delays))
