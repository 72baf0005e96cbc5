"""Checks of the computer: libraries, permissions, ports. They need no brick."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import closing
from importlib.metadata import distributions, requires
from pathlib import Path

from firmware_protocol.errors import CameraError, LinkError, NXTError
from nxtdrive.host.access import device_remedy, usb_remedy
from nxtdrive.host.environment import pip_command
from nxtdrive.transports.base import WallClock
from nxtdrive.transports.pairing import paired_bricks
from nxtdrive.transports.usb_port import UsbTransport

from .finding import Finding, Severity, ok, trouble, warning
from .udev import udev
from .usb_devices import other_devices

FRAME_TIMEOUT_S = 5.0
DARK_FRAMES = 20
"""A webcam may be dark until it has adapted to the light."""
RADIOS = Path("/sys/class/rfkill")
"""Where Linux lists radios and whether they are switched off."""
OPENCV = (
    "opencv-contrib-python",
    "opencv-contrib-python-headless",
    "opencv-python",
    "opencv-python-headless",
)
"""Distributions of OpenCV for Python, which all install the same package ``cv2``."""

_PAIR = "Switch the brick's Bluetooth on, then: bluetoothctl, in it `scan on`, `pair 00:16:53:...`; the PIN is 1234."


def examine(scheme: str, camera: str | None) -> Iterator[Finding]:
    """Run all checks of this computer.

    Args:
        scheme: Scheme of the brick's address: a failed check that it does not need is only a warning.
        camera: Source of a camera to try, or None.
    """
    on_usb = list(usb(needed=scheme == "usb"))
    yield from on_usb
    if sys.platform.startswith("linux"):
        opened = any(finding.topic == "USB" and finding.verdict is Severity.OK for finding in on_usb)
        yield udev(needed=scheme == "usb" and os.geteuid() != 0, opened=opened)
        yield from radio(needed=scheme == "bt")
        yield bluetooth(needed=scheme == "bt")
    yield from serial_ports(needed=scheme == "serial")
    yield from opencv()
    if camera is not None:
        yield webcam(camera)


def usb(*, needed: bool) -> Iterator[Finding]:
    """Check libusb, the bricks on USB, and whether this user may open them."""
    try:
        addresses, others = UsbTransport.discover(), list(other_devices())
    except NXTError as error:
        yield trouble("libusb", error.args[0], error.remedy, needed=needed)
        return
    yield ok("libusb", "found")
    yield from others
    if not addresses:
        yield trouble("USB", "no brick on USB.", _no_brick(), needed=needed)
    for address in addresses:
        if address == "usb://":
            yield trouble("permissions", "this user may not open the brick on USB.", usb_remedy(), needed=needed)
        else:
            yield ok("USB", f"{address}, and this user may open it")


def radio(*, needed: bool) -> Iterator[Finding]:
    """Check whether all Bluetooth radios are switched off."""
    radios = [folder for folder in sorted(RADIOS.glob("rfkill*")) if _read(folder / "type") == "bluetooth"]
    blocked = [folder for folder in radios if "1" in (_read(folder / "soft"), _read(folder / "hard"))]
    if not radios or len(blocked) < len(radios):
        return
    if any(_read(folder / "hard") == "1" for folder in blocked):
        remedy = "Use the computer's switch or key for wireless or flight mode, or its firmware's settings."
        yield trouble("radio", "Bluetooth is switched off by a switch of the computer.", remedy, needed=needed)
    else:
        remedy = "Run `sudo rfkill unblock bluetooth`, or switch Bluetooth on in the settings."
        yield trouble("radio", "Bluetooth is switched off by software.", remedy, needed=needed)


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
            denied = f"this user may not open {port}."
            yield trouble("serial ports", denied, device_remedy(port, "dialout"), needed=needed)
        else:
            yield ok("serial ports", f"serial://{port}")


def webcam(source: str) -> Finding:
    """Check whether a camera delivers frames that show something."""
    from nxtdrive.vision.frames import is_black
    from nxtdrive.vision.sources import open_camera

    try:
        with closing(open_camera(source, clock=WallClock())) as camera:
            for _ in range(DARK_FRAMES):
                image = camera.read(FRAME_TIMEOUT_S).image
                if not (black := is_black(image)):
                    break
    except CameraError as error:
        return warning("camera", error.args[0], error.remedy)
    height, width = image.shape[:2]
    if black:
        remedy = "Open its shutter or take its cap off, and switch the light on."
        return warning("camera", f"the frames of camera {source}, {width}x{height}, are black.", remedy)
    return ok("camera", f"camera {source} delivers frames of {width}x{height}")


def opencv() -> Iterator[Finding]:
    """Check whether several distributions of OpenCV have overwritten each other's files."""
    names = [name for name in OPENCV if any(distributions(name=name))]
    if len(names) > 1:
        wanted = next(each for each in requires("nxtdrive") or () if each.startswith(OPENCV))
        commands = f"`{pip_command('uninstall', *names)}`, `{pip_command('install', wanted)}`"
        remedy = f"Remove them and install one again: {commands}."
        yield warning("OpenCV", f"{' and '.join(names)} are installed and overwrite each other's files.", remedy)


def _read(file: Path) -> str:
    try:
        return file.read_text(encoding="ascii").strip()
    except OSError:
        return ""


def _no_brick() -> str:
    hint = "Plug the brick in and switch it on, then wait a few seconds."
    if sys.platform == "win32":
        hint += " If LEGO's own driver is installed, put WinUSB in its place with Zadig (zadig.akeo.ie)."
    return hint
