"""Checks of the computer: libraries, permissions, ports. They need no brick."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

from firmware_protocol.errors import CameraError, LinkError, NXTError
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.pairing import paired_bricks
from nxtdrive.transports.usb_port import UDEV_FILE, UDEV_RULE, UsbTransport

from .finding import Finding, ok, problem, trouble, warning

RULE_FOLDERS = ("/etc/udev/rules.d", "/run/udev/rules.d", "/lib/udev/rules.d", "/usr/lib/udev/rules.d")
COMMAND_TIMEOUT_S = 5.0
FRAME_TIMEOUT_S = 5.0

_PAIR = "Switch the brick's Bluetooth on, then: bluetoothctl, in it `scan on`, `pair 00:16:53:...`; the PIN is 1234."


def examine(scheme: str, camera: str | None) -> Iterator[Finding]:
    """Run all checks of this computer.

    Args:
        scheme: Scheme of the brick's address: a failed check that it does not need is only a warning.
        camera: Source of a camera to try, or None.
    """
    yield from usb(needed=scheme == "usb")
    if sys.platform.startswith("linux"):
        yield udev(RULE_FOLDERS, needed=scheme == "usb" and os.geteuid() != 0)
        yield bluetooth(needed=scheme == "bt")
    yield from serial_ports(needed=scheme == "serial")
    if camera is not None:
        yield webcam(camera)


def usb(*, needed: bool) -> Iterator[Finding]:
    """Check libusb, the bricks on USB, and whether this user may open them."""
    try:
        addresses = UsbTransport.discover()
    except NXTError as error:
        yield trouble("libusb", error.args[0], error.remedy, needed=needed)
        return
    yield ok("libusb", "found")
    if not addresses:
        yield trouble("USB", "no brick on USB.", _no_brick(), needed=needed)
    for address in addresses:
        if address == "usb://":
            yield problem("permissions", "this user may not open the brick on USB.", _not_allowed())
        else:
            yield ok("USB", f"{address}, and this user may open it")


def udev(folders: Sequence[str], *, needed: bool) -> Finding:
    """Check for a udev rule that lets users other than root open the brick."""
    for folder in folders:
        for rules in sorted(Path(folder).glob("*.rules")):
            text = rules.read_text(encoding="utf-8", errors="replace")
            if any("0694" in line and "0002" in line for line in text.splitlines() if not line.startswith("#")):
                return ok("udev", f"a rule for the brick in {rules}")
    return trouble("udev", "no rule lets you open the brick without being root.", _not_allowed(), needed=needed)


def bluetooth(*, needed: bool) -> Finding:
    """Check for a Bluetooth adapter and a paired brick."""
    topic = "pairing"
    try:
        bricks = paired_bricks()
    except LinkError as error:
        return trouble(topic, error.args[0], error.remedy, needed=needed)
    if not bricks:
        return trouble(topic, "no brick is paired with this computer.", _PAIR, needed=needed)
    return ok(topic, ", ".join(f"bt://{mac} {name}".strip() for mac, name in sorted(bricks.items())))


def serial_ports(*, needed: bool) -> Iterator[Finding]:
    """Check the serial ports behind which a paired brick may be."""
    from serial.tools.list_ports import comports

    ports = [port.device for port in comports()]
    if not ports:
        remedy = "Pair the brick and make its port: sudo rfcomm bind 0 00:16:53:... (the brick's address)."
        yield trouble("serial ports", "none on this computer.", remedy, needed=needed)
        return
    for port in ports:
        if os.path.exists(port) and not os.access(port, os.R_OK | os.W_OK):
            remedy = "sudo usermod -aG dialout $USER, then log out and in again."
            yield trouble("serial ports", f"this user may not open {port}.", remedy, needed=needed)
        else:
            yield ok("serial ports", f"serial://{port}")


def webcam(source: str) -> Finding:
    """Check whether a camera delivers frames."""
    from nxtdrive.vision.sources import open_camera

    try:
        camera = open_camera(source, clock=WallClock())
        try:
            height, width = camera.read(FRAME_TIMEOUT_S).image.shape[:2]
        finally:
            camera.close()
    except CameraError as error:
        return warning("camera", error.args[0], error.remedy)
    return ok("camera", f"camera {source} gives pictures of {width}x{height}")


def udev_instructions() -> str:
    """Return the shell commands that install the rule."""
    return (
        f"echo '{UDEV_RULE}' | sudo tee {UDEV_FILE}\n"
        "sudo udevadm control --reload\n"
        "sudo udevadm trigger --subsystem-match=usb\n"
        "# then unplug the brick and plug it in again"
    )


def install_udev_rule(file: Path, commands: Sequence[Sequence[str]]) -> str:
    """Write the rule and make udev read it.

    Args:
        file: Where the rule goes.
        commands: What to run afterwards; commands that are not installed are skipped.

    Returns:
        What was done and what was not; a udev that is not running reads the rule when it starts.

    Raises:
        OSError: The file cannot be written; root can.
    """
    file.write_text(UDEV_RULE + "\n", encoding="utf-8")
    done = [f"wrote {file}"]
    done += [_ran(command) for command in commands if shutil.which(command[0])]
    return "\n".join([*done, "unplug the brick and plug it in again"])


def _ran(command: Sequence[str]) -> str:
    words = " ".join(command)
    try:
        ran = subprocess.run(command, check=False, timeout=COMMAND_TIMEOUT_S, capture_output=True, text=True)  # noqa: S603 - ours
    except subprocess.TimeoutExpired:
        return f"{words} does not end; the rule counts from the next start of this computer"
    if ran.returncode:
        reason = ran.stderr.strip() or f"exit code {ran.returncode}"
        return f"{words} failed ({reason}); the rule counts from the next start of udev"
    return f"ran {words}"


UDEV_COMMANDS = (("udevadm", "control", "--reload"), ("udevadm", "trigger", "--subsystem-match=usb"))


def _no_brick() -> str:
    hint = "Plug the brick in and switch it on; it needs some seconds before USB sees it."
    if sys.platform == "win32":
        hint += " If LEGO's own driver is installed, put WinUSB in its place with Zadig (zadig.akeo.ie)."
    return hint


def _not_allowed() -> str:
    return "Run `nxtdrive doctor --fix-udev`, do what it says, and plug the brick in again."
