"""``nxtdrive sim serve``: opens the doors, runs the simulation, reports what happens."""

from __future__ import annotations

import argparse
import contextlib
import shlex
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING

from nxtdrive.cli.main import DONE
from nxtdrive.cli.output import make_console, write_error, write_json, write_line, write_text
from nxtdrive.signals import until_signal
from nxtdrive.transports.base import WallClock
from sim_backend.doors.door import Door, wait_readable
from sim_backend.doors.mjpeg import MjpegDoor
from sim_backend.doors.pty import PtyDoor
from sim_backend.doors.server import RealTimeServer, Status
from sim_backend.doors.sockets import NxtServerClient, SocketDoor, StreamClient, is_loopback
from sim_backend.doors.switchboard import CLIENT_LIMIT, ConnectionEvent, Switchboard
from sim_backend.doors.usbip import UsbIpClient, UsbIpDoor
from sim_backend.doors.uvc import UvcDoor
from sim_backend.faults_file import load_faults
from sim_backend.link import LinkFaults, SimLink
from sim_backend.simulation import DEFAULT_WORLD, Simulation

if TYPE_CHECKING:
    from rich.live import Live

USB = "usb://"
"""The driver's address of the only brick on this computer's USB."""


def serve(args: argparse.Namespace) -> int:
    """Serve until a signal arrives; see `nxtdrive.cli.commands.sim` for the arguments.

    Raises:
        ConfigError: A door cannot be opened, or a file has mistakes.
    """
    clock = WallClock()
    simulation = Simulation(args.world or DEFAULT_WORLD, seed=args.seed, firmware=args.firmware, camera_size=args.size)
    plug_in = links(args, simulation)

    with until_signal() as stopped, contextlib.ExitStack() as closing:
        out = closing.enter_context(contextlib.closing(Output(args.json)))
        serial_number = simulation.brick.serial_number
        doors = [closing.enter_context(contextlib.closing(door)) for door in _doors(args, serial_number, clock)]
        stream = closing.enter_context(contextlib.closing(MjpegDoor(args.camera_port)))
        fps = simulation.webcam.fps
        webcams = [
            closing.enter_context(contextlib.closing(UvcDoor(args.size, fps, port, host=args.host)))
            for port in args.uvc
        ]
        switchboard = closing.enter_context(contextlib.closing(Switchboard(doors, plug_in, out.connection)))
        server = RealTimeServer(simulation, switchboard, [stream, *webcams], fps=fps, now=clock.now, wait=wait_readable)
        if not is_loopback(args.host):
            write_error(f"warning: anyone who can reach {args.host} can drive this brick.")
        out.serving(doors, stream.url, webcams)

        def report(status: Status) -> None:
            if simulation.brick.powered_off:
                out.switched_off()
            out.status(status)

        server.run(stopped, report)
        switchboard.close()
        out.ended(server.status())
    return DONE


def links(args: argparse.Namespace, simulation: Simulation) -> Callable[[bool], SimLink]:
    """Return a function that makes links to the simulated brick with the requested latency and faults.

    Raises:
        ConfigError: The file of faults has mistakes.
    """
    faults = load_faults(args.faults) if args.faults else LinkFaults()

    def plug_in(bluetooth: bool) -> SimLink:
        if simulation.brick.powered_off:
            raise ConnectionError("the brick is off")
        return SimLink(simulation, args.latency_ms, faults, bluetooth=bluetooth)

    return plug_in


def _doors(args: argparse.Namespace, serial_number: str, clock: WallClock) -> Iterator[Door]:
    """Open the doors, pseudo-terminals first: they are closed last, and closing one may end programs."""
    for path in args.pty:
        yield PtyDoor(path.absolute(), now=clock.now)
    for port in args.tcp:
        yield SocketDoor(StreamClient, port, host=args.host, now=clock.now)
    for port in args.nxt_server:
        yield SocketDoor(NxtServerClient, port, host=args.host, now=clock.now)
    for port in args.usbip:
        yield UsbIpDoor(serial_number, port, host=args.host, now=clock.now)


class Output:
    """Reports to the user, or as JSON to the program that started us; on a terminal with a live line of figures."""

    def __init__(self, as_json: bool) -> None:
        self._json = as_json
        self._live = None if as_json or not sys.stdout.isatty() else _live_line()
        self._off = False

    def serving(self, opened: Sequence[Door], camera: str, webcams: Sequence[UvcDoor]) -> None:
        """Report the addresses, and the commands that attach what is on USB/IP to this computer."""
        doors = [door.address for door in opened]
        attach = [door.command for door in (*opened, *webcams) if isinstance(door, UsbIpDoor | UvcDoor)]
        nxt = None if not doors else USB if doors[0].startswith(UsbIpClient.scheme) else doors[0]
        command = shlex.join(["nxtdrive", "run", "--nxt", nxt, "--camera", camera]) if nxt else None
        if self._json:
            self._event("serving", nxt=nxt, doors=doors, camera=camera, command=command, attach=attach)
            return
        cameras = [camera, *(webcam.address for webcam in webcams)]
        for address in (*(f"brick   {door}" for door in doors), *(f"camera  {address}" for address in cameras)):
            write_line(address)
        if attach:
            write_text("\nTo plug into this computer, Linux with the package usbip, as root:")
            for line in ("modprobe vhci-hcd", *attach):
                write_line(f"  {line}")
        if command:
            write_text("\nIn a second terminal:")
            write_line(f"  {command}")
            if webcams:
                write_line("With the attached webcam, if the computer has no other: --camera 0")
        write_text("\nCtrl-C ends it.", flush=True)
        if self._live:
            self._live.start()

    def connection(self, event: ConnectionEvent) -> None:
        """Report that a program has connected or disconnected."""
        if self._json:
            values = asdict(event)
            self._event(values.pop("event"), **values)
            return
        if event.event == "refused":
            full = f"and further ones: {CLIENT_LIMIT} programs are connected"
            write_line(f"refused: {event.name} at {event.door}, {full}", flush=True)
            return
        count = f" after {event.telegrams} telegrams" if event.event == "disconnected" else ""
        write_line(f"{event.event}: program {event.client} at {event.door}{count}", flush=True)

    def status(self, status: Status) -> None:
        """Report the current state."""
        if self._json:
            self._event("status", **{name: round(value, 3) for name, value in asdict(status).items()})
        elif self._live:
            from rich.text import Text

            self._live.update(Text(_line(status), no_wrap=True, overflow="ellipsis"), refresh=True)

    def switched_off(self) -> None:
        """Report, once, that the brick has switched itself off."""
        if self._off:
            return
        self._off = True
        if self._json:
            self._event("switched_off")
            return
        write_line("the brick has switched itself off; start the server again to switch it on", flush=True)

    def ended(self, status: Status) -> None:
        """Report the totals, below what was reported before."""
        self.close()
        if self._json:
            self._event("ended", simulated_s=status.simulated_s, telegrams=status.telegrams)
            return
        write_line(f"ended after {status.simulated_s:.1f} s of simulated time and {status.telegrams} telegrams")

    def close(self) -> None:
        """Clear the live line."""
        if self._live:
            self._live.stop()

    @staticmethod
    def _event(event: str, **values: object) -> None:
        write_json({"event": event, **values}, flush=True)


def _live_line() -> Live:
    from rich.live import Live

    return Live(console=make_console(), auto_refresh=False, transient=True)


def _line(status: Status) -> str:
    slow = " (this computer is too slow)" if status.real_time_factor < 0.95 else ""
    return (
        f"{status.simulated_s:8.1f} s simulated  {status.clients} programs  {status.telegrams_per_s:5.0f} telegrams/s  "
        f"{status.frames_per_s:3.0f} frames/s  {status.real_time_factor:.2f} x real time{slow}"
    )
