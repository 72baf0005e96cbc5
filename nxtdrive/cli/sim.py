"""``nxtdrive sim``: the simulated brick for other programs, in real time."""

from __future__ import annotations

import argparse
import contextlib
import json
import shlex
import signal
import sys
from collections.abc import Callable, Iterator
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.options import add_json_argument

if TYPE_CHECKING:
    from sim_backend.doors.server import Status

DESCRIPTION = """\
Serve the simulated brick as a serial port and its camera as a stream, in real
time, until Ctrl-C. Any program for a brick on Bluetooth can use them; stop it
before the server: a program that made the port its controlling terminal is
ended with it."""
EXAMPLES = """\
  nxtdrive sim serve --pty /tmp/nxt
  nxtdrive sim serve --pty /tmp/nxt --camera-port 8081 --latency-ms 30"""

ENDING_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP")
"""Those that end the server in good order, where the system has them."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare ``serve`` and its arguments."""
    actions = parser.add_subparsers(metavar="ACTION", required=True)
    serve = actions.add_parser("serve", help="a serial port and a camera stream")
    serve.add_argument("--pty", metavar="LINK", type=Path, required=True, help="name of the serial port, made here")
    serve.add_argument("--world", metavar="FILE", help="a world file or the name of a bundled world")
    serve.add_argument("--seed", metavar="N", type=int, default=0, help="of everything random (default: 0)")
    serve.add_argument(
        "--latency-ms", metavar="MS", type=_latency, default=0.0, help="round trip of the link (default: 0; radio: 30)"
    )
    serve.add_argument(
        "--camera-port", metavar="N", type=int, default=0, help="port of the stream on 127.0.0.1 (default: a free one)"
    )
    serve.add_argument(
        "--size", metavar="WxH", type=_size, default=(320, 240), help="of the camera's frames (default: 320x240)"
    )
    add_json_argument(serve)
    serve.set_defaults(action=_serve)


def run(args: argparse.Namespace) -> int:
    """Do what the subcommand says."""
    return int(args.action(args))


def _latency(text: str) -> float:
    value = float(text)
    if not 0 <= value <= 10_000:
        raise ValueError
    return value


def _size(text: str) -> tuple[int, int]:
    width, height = (int(part) for part in text.lower().split("x"))
    if not (16 <= width <= 4096 and 16 <= height <= 4096):
        raise ValueError
    return width, height


_latency.__name__, _size.__name__ = "milliseconds", "size"  # argparse says "invalid size value"


def _serve(args: argparse.Namespace) -> int:
    """Open the doors, let the simulation run, close everything."""
    from nxtdrive.transports.base import WallClock
    from sim_backend.doors.mjpeg import MjpegDoor
    from sim_backend.doors.pty import PtyDoor
    from sim_backend.doors.server import RealTimeServer
    from sim_backend.simulation import DEFAULT_WORLD, SimLink, Simulation

    out, clock = _Output(args.json), WallClock()
    simulation = Simulation(args.world or DEFAULT_WORLD, seed=args.seed, camera_size=args.size)
    with (
        _until_signal() as stopped,
        contextlib.closing(PtyDoor(args.pty.absolute(), now=clock.now)) as door,
        contextlib.closing(MjpegDoor(args.camera_port)) as camera,
    ):
        server = RealTimeServer(
            simulation,
            SimLink(simulation, args.latency_ms),
            door,
            camera,
            fps=simulation.webcam.fps,
            now=clock.now,
            sleep=door.wait,
        )
        out.serving(f"serial://{door.path}", camera.url)
        server.run(stopped, out.status)
        out.ended(server.status())
    return DONE


@contextlib.contextmanager
def _until_signal() -> Iterator[Callable[[], bool]]:
    """A question that is answered with yes once the user or the system wants an end."""
    wanted = False

    def end(*_: object) -> None:
        nonlocal wanted
        wanted = True

    signals = [getattr(signal, name) for name in ENDING_SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, end) for number in signals}
    try:
        yield lambda: wanted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Output:
    """What the user, or the program that started us, is told."""

    def __init__(self, as_json: bool) -> None:
        self._json = as_json
        self._live = not as_json and sys.stdout.isatty()

    def serving(self, nxt: str, camera: str) -> None:
        command = shlex.join(["nxtdrive", "run", "--nxt", nxt, "--camera", camera])
        if self._json:
            self._event("serving", nxt=nxt, camera=camera, command=command)
            return
        print(f"brick   {nxt}\ncamera  {camera}\n\nIn a second terminal:\n  {command}\n\nCtrl-C ends it.", flush=True)

    def status(self, status: Status) -> None:
        if self._json:
            self._event("status", **{name: round(value, 3) for name, value in asdict(status).items()})
        elif self._live:
            print(f"\r{_line(status)}\x1b[K", end="", flush=True)

    def ended(self, status: Status) -> None:
        if self._json:
            self._event("ended", simulated_s=status.simulated_s, telegrams=status.telegrams)
            return
        lead = "\n" if self._live else ""
        print(f"{lead}ended after {status.simulated_s:.1f} s of simulated time and {status.telegrams} telegrams")

    @staticmethod
    def _event(event: str, **values: object) -> None:
        print(json.dumps({"event": event, **values}), flush=True)


def _line(status: Status) -> str:
    slow = " (this computer is too slow)" if status.real_time_factor < 0.95 else ""
    return (
        f"{status.simulated_s:8.1f} s simulated  {status.telegrams_per_s:5.0f} telegrams/s  "
        f"{status.frames_per_s:3.0f} frames/s  {status.real_time_factor:.2f} x real time{slow}"
    )
