"""``nxtdrive sim exec``: runs a program that finds the simulated brick on USB.

The brick runs in this process on the wall clock, whatever the program does: it may compute, use threads, start other
programs or be killed.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

import sim_backend.doors
from firmware_protocol.errors import ConfigError
from nxtdrive.cli.commands.sim_serve import links
from nxtdrive.cli.output import write_error
from nxtdrive.signals import SIGNALLED, handling
from nxtdrive.transports.base import WallClock
from sim_backend.doors.door import wait_readable
from sim_backend.doors.server import RealTimeServer
from sim_backend.doors.sockets import UsbDoor
from sim_backend.doors.switchboard import Switchboard
from sim_backend.simulation import DEFAULT_WORLD, Simulation

HOOK = Path(sim_backend.doors.__file__).parent / "usb_hook"
"""Folder of the `sitecustomize` that puts the brick below pyusb, and of the program that puts it below libusb."""

VARIABLE = "NXTDRIVE_SIM_USB"
"""Environment variable with the brick's address, for the hook."""

CAN_UMOCKDEV = "import gi; gi.require_version('UMockdev', '1.0'); from gi.repository import UMockdev"


def execute(args: argparse.Namespace, program: Sequence[str]) -> int:
    """Run the program; returns its exit code. See `nxtdrive.cli.commands.sim` for the arguments.

    Raises:
        ConfigError: There is no such program, or a file has mistakes.
    """
    clock = WallClock()
    simulation = Simulation(args.world or DEFAULT_WORLD, seed=args.seed, firmware=args.firmware)
    plug_in, serial_number = links(args, simulation), simulation.brick.serial_number
    with contextlib.ExitStack() as closing:
        door = closing.enter_context(contextlib.closing(UsbDoor(serial_number, now=clock.now)))
        switchboard = closing.enter_context(contextlib.closing(Switchboard([door], plug_in)))
        server = RealTimeServer(simulation, switchboard, now=clock.now, wait=wait_readable)
        if args.native:
            _find(program[0])
            child = _start([*_native(), "127.0.0.1", str(door.port), serial_number, *program], os.environ)
        else:
            child = _start(program, environment(os.environ, door.port, serial_number))
        # the terminal also sends Ctrl-C to the program, which decides what to do
        with child, handling(lambda number, _: _pass_on(child, number)):
            server.run(lambda: child.poll() is not None, lambda _: None)
    if not switchboard.telegrams:
        native = "If it is no Python program with pyusb, add --native."
        advice = "Does it look for a brick on USB?" if args.native else native
        write_error(
            f"the program sent nothing to the brick on USB. {advice} `nxtdrive sim serve` has other connections."
        )
    return child.returncode if child.returncode >= 0 else SIGNALLED - child.returncode


def environment(base: Mapping[str, str], port: int, serial_number: str) -> dict[str, str]:
    """Return an environment in which Python programs find the brick that a `UsbDoor` serves.

    Args:
        base: The environment to extend.
        port: Port of the door.
        serial_number: Serial number of the brick.
    """
    path = os.pathsep.join(filter(None, [str(HOOK), base.get("PYTHONPATH")]))
    return {**base, "PYTHONPATH": path, VARIABLE: f"127.0.0.1:{port}/{serial_number}"}


def umockdev_interpreter() -> str | None:
    """Return a Python interpreter that has umockdev's bindings (this one or the system's), or None."""
    for interpreter in (sys.executable, "/usr/bin/python3"):
        if Path(interpreter).exists():
            tried = subprocess.run([interpreter, "-c", CAN_UMOCKDEV], check=False, capture_output=True)  # noqa: S603
            if tried.returncode == 0:
                return interpreter
    return None


def _native() -> list[str]:
    """Return the command that puts the brick below libusb instead of below pyusb."""
    interpreter = umockdev_interpreter()
    if interpreter is None:
        raise ConfigError(
            "native programs need umockdev with its Python bindings.",
            remedy="On Debian: apt install python3-gi gir1.2-umockdev-1.0; for Python programs leave --native out.",
        )
    return [interpreter, str(HOOK / "native.py")]


def _find(name: str) -> None:
    """Check that the program exists before the wrapper that would start it is started."""
    if shutil.which(name) is None:
        raise ConfigError(f"{name} cannot be run: it was not found.", remedy="Check its name and your PATH.")


def _start(program: Sequence[str], environ: Mapping[str, str]) -> subprocess.Popen[bytes]:
    try:
        return subprocess.Popen(program, env=environ)  # noqa: S603 - what the user asked for
    except OSError as error:
        raise ConfigError(
            f"{program[0]} cannot be run: {error.strerror}.", remedy="Check its name and your PATH."
        ) from error


def _pass_on(child: subprocess.Popen[bytes], number: int) -> None:
    """Forward a signal to the program, except a Ctrl-C, which the terminal sends to both."""
    import signal

    if number != signal.SIGINT or not _in_foreground():
        child.send_signal(number)


def _in_foreground() -> bool:
    """Return whether a Ctrl-C typed at a terminal reaches this process and its children."""
    if sys.platform == "win32":
        return True
    try:
        with open("/dev/tty", "rb") as terminal:
            return os.tcgetpgrp(terminal.fileno()) == os.getpgrp()
    except OSError:
        return False
