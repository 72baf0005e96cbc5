"""Find the LEGO bricks that are paired with this computer, through BlueZ's own command, without extra packages."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

from firmware_protocol.errors import LinkError

ADAPTERS = Path("/sys/class/bluetooth")
"""Where Linux lists Bluetooth adapters."""
COMMANDS = (("bluetoothctl", "devices", "Paired"), ("bluetoothctl", "paired-devices"))
"""The same query for newer and older versions of BlueZ; each rejects the other's."""
COMMAND_TIMEOUT_S = 3.0
"""bluetoothctl waits forever if the service does not run, and otherwise answers within milliseconds."""

_LEGO = re.compile(r"\bDevice ((?:00:16:53)(?::[0-9A-F]{2}){3})\b[ \t]*(.*)", re.IGNORECASE)
"""00:16:53 are LEGO's addresses: the NXT's, but the EV3's as well."""
_NO_ADAPTER = "No default controller"


def paired_bricks() -> dict[str, str]:
    """Return the names of paired bricks by Bluetooth address, as in ``bt://``; empty on systems other than Linux.

    Raises:
        LinkError: The paired devices cannot be listed; the remedy says what is missing.
    """
    if not sys.platform.startswith("linux"):
        return {}
    if not ADAPTERS.is_dir() or not any(ADAPTERS.iterdir()):
        raise _no_adapter()
    listed = _list_devices()
    if _NO_ADAPTER in listed:
        raise _no_adapter()
    return {mac.upper(): name.strip() for mac, name in _LEGO.findall(listed)}


def _list_devices() -> str:
    """Return the output of the first command that works."""
    if shutil.which("bluetoothctl") is None:
        raise LinkError("bluetoothctl is not installed.", remedy="Debian: sudo apt install bluez.")
    for command in COMMANDS:
        try:
            done = subprocess.run(  # noqa: S603 - a constant command
                command,
                capture_output=True,
                errors="replace",
                check=False,
                timeout=COMMAND_TIMEOUT_S,
                stdin=subprocess.DEVNULL,
                env={**os.environ, "LC_ALL": "C"},
            )
        except subprocess.TimeoutExpired:
            raise _no_service() from None
        if done.returncode == 0:
            return done.stdout
    raise _no_service()


def _no_adapter() -> LinkError:
    return LinkError("this computer has no Bluetooth adapter.", remedy="Plug in an adapter, or use USB.")


def _no_service() -> LinkError:
    return LinkError(
        "the Bluetooth service does not answer.", remedy="Start the service: sudo systemctl start bluetooth."
    )
