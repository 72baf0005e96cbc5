"""The rig: start it, run commands in its guest, plug and unplug devices, read the world's truth, end it."""

from __future__ import annotations

import compileall
import contextlib
import json
import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, cast

from . import initrd, kernel, qemu
from .errors import RigError

KERNEL_PORTS = {"usb": 0, "camera": 1}
"""Ports of the guest's virtual hub."""

DOORS = ("usb", "webcam", "bluetooth")

ROOT = Path(__file__).resolve().parents[2]
READY_S = 30.0
REPORT_TIMEOUT_S = 30.0
"""How long the guest may take to say that it has ended a command whose time is over."""

END_S = 10.0

BROKEN = re.compile(r"kernel BUG|Oops|list_del corruption|Kernel panic|general protection fault|soft lockup")
"""Messages on a kernel's console after which it is no longer reliable."""


@dataclass(frozen=True)
class Done:
    """A command that has ended in the guest.

    Attributes:
        code: Exit code.
        out: Standard output.
        err: Standard error.
    """

    code: int
    out: str
    err: str


@dataclass
class Rig:
    """A running rig: its processes and ports.

    Attributes:
        guest: Process number of QEMU.
        world: Process number of the simulated brick and world.
        agent: Port of the guest's agent.
        control: Port for faults and truth.
        usb: Port of the brick on USB/IP.
        webcam: Port of the webcam on USB/IP.
        bluetooth: Port of the Bluetooth adapter; 0 without one, as without bumble.
        options: How the world was started.
        linux: The guest's version of Linux.
        name: Distinguishes rigs that run at the same time.
    """

    guest: int
    world: int
    agent: int
    control: int
    usb: int
    webcam: int
    bluetooth: int
    options: list[str]
    linux: str
    name: str
    _children: list[subprocess.Popen[bytes]] = field(default_factory=list, repr=False)

    @classmethod
    def start(
        cls,
        world: str = "open",
        *,
        seed: int = 0,
        size: str = "320x240",
        name: str = "rig",
        avoid: Collection[str] = (),
    ) -> Rig:
        """Build what is missing, boot the guest, and plug in brick and webcam.

        Args:
            world: A world file or the name of a bundled world.
            seed: Random seed.
            size: Of the webcam's frames.
            name: Distinguishes rigs that run at the same time.
            avoid: Versions of Linux not to boot if there is another one.

        Raises:
            RigError: Something is missing on this computer, or the guest does not start.
        """
        if lacking := kernel.missing():
            raise RigError(lacking)
        with kernel.locked():
            _compile()
            image = kernel.fetch(avoid)
            first = initrd.build(image)
        options = ["--world", world, "--seed", str(seed), "--size", size]
        process, ports = _start_world(options, name)
        try:
            agent = _free_port()
            doors = [ports[name] for name in DOORS if ports[name]]
            guest = qemu.boot(image, first, agent, doors, _console(name))
        except BaseException:
            _end(process.pid)
            raise
        rig = cls(
            guest=guest.pid, world=process.pid, agent=agent, options=options, linux=image.linux, name=name, **ports
        )
        rig._children = [guest, process]
        try:
            rig.plug_all()
        except BaseException:
            rig.stop()
            raise
        return rig

    def reset(self, world: str) -> None:
        """Begin with a fresh brick in a fresh world, plugged in.

        Args:
            world: A world file or the name of a bundled world.

        Raises:
            RigError: The world does not start, or the guest does not see the devices.
        """
        self.run("pkill -INT nxtdrive", timeout_s=READY_S)
        self._ask_world({"reset": world})
        gone = "! cat /sys/bus/usb/devices/*/idVendor | grep -v 1d6b && ! test -e /sys/class/bluetooth/hci0"
        self.wait_for(gone, "that the devices are gone")
        self.plug_all()

    @property
    def broken(self) -> bool:
        """Whether the guest's kernel has failed, by its console."""
        return self._kernel_failure() is not None

    # --- the guest ---

    def run(
        self,
        command: str,
        *,
        timeout_s: float = 60.0,
        user: int | None = None,
        groups: Sequence[int] = (),
        show: Callable[[str, str], None] = lambda kind, text: None,  # noqa: ARG005
    ) -> Done:
        """Run a shell command in the guest.

        Args:
            command: For bash, in a folder that is empty at first.
            timeout_s: After it the command is interrupted, as by Ctrl-C, and 10 s later killed.
            user: User number; by default root.
            groups: Further groups of that user.
            show: Called with ``"out"`` or ``"err"`` and text as it comes.

        Raises:
            RigError: The guest does not say within `timeout_s` and `REPORT_TIMEOUT_S` that the command has ended.
        """
        received = {"out": "", "err": ""}
        request = {"run": command, "timeout_s": timeout_s, "user": user, "groups": list(groups)}
        for answer in self._ask_guest(request, timeout_s + REPORT_TIMEOUT_S):
            if "code" in answer:
                return Done(answer["code"], received["out"], received["err"])
            for kind, text in answer.items():
                received[kind] += text
                show(kind, text)
        raise RigError(f"The guest ended while the command ran. {self._failure_context()}")

    def wait_for(self, command: str, what: str, limit_s: float = 20.0) -> None:
        """Wait until a shell command succeeds in the guest.

        Raises:
            RigError: It does not within `limit_s`.
        """
        waiting = f"until {command} > /dev/null 2>&1; do sleep 0.1; done"
        if self.run(waiting, timeout_s=limit_s).code:
            raise RigError(f"The guest does not see {what} after {limit_s:g} s. {self._failure_context()}")

    # --- the devices ---

    def plug_all(self) -> None:
        """Plug in brick and webcam, and wait until the kernel has them.

        Raises:
            RigError: It does not see them.
        """
        self.plug("usb")
        self.plug("camera")
        if self.bluetooth:
            list(self._ask_guest({"adapter": self.bluetooth}, READY_S))
            self.wait_for("test -e /sys/class/bluetooth/hci0", "the Bluetooth adapter")
        self.wait_for("test -e /dev/video0 && grep -q 0694 /sys/bus/usb/devices/*/idVendor", "the devices")

    def plug(self, device: str) -> None:
        """Plug in ``"usb"``, the brick, or ``"camera"``.

        Raises:
            RigError: The kernel has it already.
        """
        port = {"usb": self.usb, "camera": self.webcam}[device]
        [answer] = self._ask_guest({"plug": port, "port": KERNEL_PORTS[device]}, READY_S)
        if answer["code"]:
            raise RigError(f"The {device} cannot be plugged in (status {answer['code']}); is it plugged in already?")

    def fault(self, **request: object) -> None:
        """Make a fault: ``unplug="usb"`` or ``"camera"``, ``halt=0x82`` (endpoint), ``mute=True``.

        Raises:
            RigError: There is no such fault.
        """
        self._ask_world(dict(request))

    def truth(self) -> dict[str, Any]:
        """Return the ground truth, for verdicts only: pose, speed, contacts, distances to the pictures."""
        return self._ask_world({"truth": True})

    # --- the end ---

    def stop(self) -> None:
        """Switch the guest off and end the world."""
        with contextlib.suppress(RigError):
            list(self._ask_guest({"halt": True}, END_S))
        for process in (self.guest, self.world):
            _end(process)
        for child in self._children:
            child.wait()

    def save(self) -> None:
        """Record this rig for other commands."""
        saved = {name: value for name, value in vars(self).items() if not name.startswith("_")}
        _state().write_text(json.dumps(saved))

    @classmethod
    def running(cls) -> Rig:
        """Return the rig that was saved.

        Raises:
            RigError: None runs.
        """
        try:
            rig = cls(**json.loads(_state().read_text()))
            os.kill(rig.guest, 0)
        except (OSError, ValueError, TypeError) as error:
            raise RigError("No rig is running. Start one: python -m tools.rig up") from error
        return rig

    def _ask_guest(self, request: dict[str, Any], timeout_s: float) -> Any:  # noqa: ANN401 - lines of JSON
        until = time.monotonic() + timeout_s
        try:
            with socket.create_connection(("127.0.0.1", self.agent), timeout=timeout_s) as line:
                line.sendall(json.dumps(request).encode() + b"\n")
                for answer in line.makefile("rb"):
                    yield json.loads(answer)
                    if time.monotonic() > until:
                        raise TimeoutError("it is still running")
                    line.settimeout(max(0.001, until - time.monotonic()))
        except OSError as error:
            raise RigError(
                f"The guest does not answer within {timeout_s:g} s ({error}): {request}. {self._failure_context()}"
            ) from error

    def _kernel_failure(self) -> re.Match[str] | None:
        return BROKEN.search(_console(self.name).read_text(errors="replace"))

    def _failure_context(self) -> str:
        """Return where the guest's console is, and what it says of the kernel's failure, if it failed."""
        failed = self._kernel_failure()
        reason = f"Its kernel failed: {failed[0]}. " if failed else ""
        return f"{reason}The console is {_console(self.name)}."

    def _ask_world(self, request: dict[str, Any]) -> dict[str, Any]:
        try:
            with socket.create_connection(("127.0.0.1", self.control), timeout=READY_S) as line:
                line.sendall(json.dumps(request).encode() + b"\n")
                answer: dict[str, Any] = json.loads(line.makefile("rb").readline())
        except (OSError, ValueError) as error:
            raise RigError(
                f"The world does not answer ({error}): {request}. Its log is {_folder() / self.name}.world.log."
            ) from error
        if "error" in answer:
            raise RigError(answer["error"])
        return answer


def _compile() -> None:
    """Compile the packages, for the guest would compile them again for each command: it cannot write to the host."""
    for folder in sorted(ROOT.glob("*/__init__.py")):
        compileall.compile_dir(folder.parent, quiet=2)


def forget() -> None:
    """Remove what `Rig.save` wrote."""
    _state().unlink(missing_ok=True)


def _start_world(options: Sequence[str], name: str) -> tuple[subprocess.Popen[bytes], dict[str, Any]]:
    """Start the world; returns its process and its ports."""
    command = [sys.executable, "-m", "tools.rig.world", *options]
    log = _folder() / f"{name}.world.log"
    with log.open("w") as errors:
        process = subprocess.Popen(
            command,
            cwd=ROOT,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=errors,
            start_new_session=True,
        )
    with contextlib.closing(cast("IO[bytes]", process.stdout)) as output:
        line = output.readline()
    if not line:
        process.wait()
        raise RigError("The world did not start:\n" + log.read_text()[-1000:])
    return process, json.loads(line)


def _end(process: int) -> None:
    with contextlib.suppress(ProcessLookupError, ChildProcessError):
        os.kill(process, signal.SIGTERM)
        until = time.monotonic() + END_S
        while time.monotonic() < until:
            with contextlib.suppress(ChildProcessError):
                os.waitpid(process, os.WNOHANG)
            os.kill(process, 0)
            time.sleep(0.05)
        os.kill(process, signal.SIGKILL)


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
    return port


def _folder() -> Path:
    folder = kernel.cache() / "run"
    folder.mkdir(exist_ok=True)
    return folder


def _console(name: str) -> Path:
    return _folder() / f"{name}.guest.log"


def _state() -> Path:
    return _folder() / "rig.json"
