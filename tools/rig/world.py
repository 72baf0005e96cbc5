"""The host's process of the rig: simulated brick, world and webcam behind USB/IP, and a port for faults and truth.

Started by `tools.rig.rig`. The control port takes lines of JSON and answers each with a line: ``{"unplug": "usb"}``,
``{"cover": true}`` (the lens), ``{"halt": 130}``, ``{"mute": true}``, ``{"radio": "vanish"}`` (or "return", "hang up"),
``{"pin": "1234"}`` (only paired computers may connect), ``{"truth": true}``, ``{"reset": "open"}`` (a fresh brick in a
fresh world, a file or a bundled one, at the same ports); ``{"error": "..."}`` if it cannot.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import queue
import socketserver
import threading
from collections.abc import Callable
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from nxtdrive.signals import until_signal
from nxtdrive.transports.base import WallClock
from sim_backend.doors.door import Door, wait_readable
from sim_backend.doors.server import RealTimeServer, Status
from sim_backend.doors.switchboard import Switchboard
from sim_backend.doors.usbip import UsbIpDoor
from sim_backend.doors.uvc import UvcDoor
from sim_backend.link import SimLink
from sim_backend.simulation import Simulation

if TYPE_CHECKING:
    from .rfcomm import RfcommDoor

ANSWER_S = 20.0
CABLE_MS, RADIO_MS = 1, 30
"""Round trips of the simulated part of the link; the kernel's comes on top."""

Request = dict[str, Any]
Asked = tuple[Request, queue.Queue[Request]]
"""A request, and where its answer goes."""

Reset = tuple[str, queue.Queue[Request]]
"""The next world, and where to report that it is ready."""


class World:
    """The simulation and its doors.

    Attributes:
        simulation: The brick and its world.
        usb: The brick on USB.
        webcam: The webcam on USB.
        radio: The brick on Bluetooth; None without bumble.
    """

    def __init__(self, args: argparse.Namespace, requests: queue.Queue[Asked], closing: contextlib.ExitStack) -> None:
        clock = WallClock()
        self.simulation = Simulation(args.world, seed=args.seed, camera_size=args.size)
        serial_number = self.simulation.brick.serial_number
        self.usb = closing.enter_context(contextlib.closing(UsbIpDoor(serial_number, args.usb, now=clock.now)))
        fps = self.simulation.webcam.fps
        self.webcam = closing.enter_context(contextlib.closing(UvcDoor(args.size, fps, args.webcam)))
        self.radio = _radio(self.simulation, args.bluetooth, clock.now)
        doors: list[Door] = [self.usb]
        if self.radio is not None:
            doors.append(closing.enter_context(contextlib.closing(self.radio)))
        switchboard = closing.enter_context(contextlib.closing(Switchboard(doors, self._plug_in)))
        self._server = RealTimeServer(
            self.simulation, switchboard, [self.webcam], fps=fps, now=clock.now, wait=wait_readable
        )
        self._status = self._server.status()
        self._requests = requests
        self._reset: Reset | None = None

    @property
    def ports(self) -> dict[str, int]:
        """TCP ports by device; 0: none."""
        return {
            "usb": self.usb.port,
            "webcam": self.webcam.port,
            "bluetooth": self.radio.port if self.radio else 0,
        }

    def run(self, stopped: Callable[[], bool]) -> Reset | None:
        """Serve until asked to stop, or to be replaced by the world that it returns."""

        def turn() -> bool:
            self._handle()
            return self._reset is not None or stopped()

        self._server.run(turn, self._report)
        return self._reset

    def _plug_in(self, bluetooth: bool) -> SimLink:
        if self.simulation.brick.powered_off:
            raise ConnectionError
        return SimLink(self.simulation, RADIO_MS if bluetooth else CABLE_MS, bluetooth=bluetooth)

    def _report(self, status: Status) -> None:
        self._status = status

    def _handle(self) -> None:
        """Handle what was asked since the last turn."""
        while self._reset is None and not self._requests.empty():
            request, answer = self._requests.get()
            if "reset" in request:
                self._reset = request["reset"], answer
                return
            try:
                answer.put(self._answer(request))
            except (ArithmeticError, LookupError, TypeError, ValueError) as error:
                answer.put({"error": f"{type(error).__name__}: {error}"})

    def _answer(self, request: Request) -> Request:
        [(verb, value)] = request.items()
        match verb:
            case "unplug":
                unplug = {"usb": self.usb.unplug, "camera": self.webcam.unplug}[value]
                unplug()
            case "halt":
                self.usb.halt(value)
            case "mute":
                self.usb.device.mute = value
            case "radio" if self.radio is not None:
                radio = self.radio
                {"vanish": radio.leave_range, "return": radio.enter_range, "hang up": radio.disconnect}[value]()
            case "pin" if self.radio is not None:
                self.radio.ask_for_pin(value)
            case "cover":
                self.webcam.covered = value
            case "truth":
                return self._truth()
            case _:
                raise ValueError(f"unknown request {verb}")
        return {}

    def _truth(self) -> Request:
        truth = self.simulation.truth
        return {
            "simulated_s": self.simulation.time_s,
            "pose": list(truth.pose),
            "speed_mm_s": truth.speed_mm_s,
            "contacts": truth.contacts,
            "distances_mm": {name: truth.distance_mm(name) for name in truth.pictures},
            "telegrams": self._status.telegrams,
            "real_time_factor": self._status.real_time_factor,
            "frames_per_s": self._status.frames_per_s,
        }


def _radio(simulation: Simulation, port: int, now: Callable[[], float]) -> RfcommDoor | None:
    """Return the brick's Bluetooth, where bumble is installed."""
    if find_spec("bumble") is None:
        return None
    from .rfcomm import RfcommDoor

    return RfcommDoor(simulation.brick.radio.address.hex(":").upper(), port, now=now)


def serve(args: argparse.Namespace) -> None:
    """Run the process."""
    requests: queue.Queue[Asked] = queue.Queue()

    class Control(socketserver.StreamRequestHandler):
        def handle(self) -> None:
            for line in self.rfile:
                answer: queue.Queue[Request] = queue.Queue()
                requests.put((json.loads(line), answer))
                self.wfile.write(json.dumps(answer.get(timeout=ANSWER_S)).encode() + b"\n")

    class Server(socketserver.ThreadingTCPServer):
        allow_reuse_address = True
        daemon_threads = True

    with until_signal() as stopped, Server(("127.0.0.1", 0), Control) as control:
        threading.Thread(target=control.serve_forever, name="control").start()
        try:
            _serve_worlds(args, requests, control.server_address[1], stopped)
        finally:
            control.shutdown()


def _serve_worlds(
    args: argparse.Namespace, requests: queue.Queue[Asked], control: int, stopped: Callable[[], bool]
) -> None:
    """Serve one world after the other, all at the ports of the first."""
    there: queue.Queue[Request] | None = None
    while not stopped():
        with contextlib.ExitStack() as closing:
            world = World(args, requests, closing)
            if there is None:
                print(json.dumps({**world.ports, "control": control}), flush=True)
                vars(args).update(world.ports)
            else:
                there.put({})
            if reset := world.run(stopped):
                args.world, there = reset


def main() -> None:
    """Parse the command line."""
    parser = argparse.ArgumentParser(prog="python -m tools.rig.world", description=__doc__)
    parser.add_argument("--world", default="open")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--size", type=lambda text: tuple(int(part) for part in text.split("x")), default=(320, 240))
    parser.set_defaults(usb=0, webcam=0, bluetooth=0)
    serve(parser.parse_args())


if __name__ == "__main__":
    main()
