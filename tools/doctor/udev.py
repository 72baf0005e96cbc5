"""The udev rule that lets users open the brick: whether it is there, and its installation."""

from __future__ import annotations

import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from nxtdrive.host.access import FIX_UDEV, UDEV_FILE, UDEV_GROUP, UDEV_RULE, find_rule, join_remedy

from .finding import Finding, ok, trouble, warning

COMMAND_TIMEOUT_S = 5.0
UDEV_COMMANDS = (
    ("groupadd", "--system", "--force", UDEV_GROUP),
    ("udevadm", "control", "--reload"),
    ("udevadm", "trigger", "--subsystem-match=usb"),
)
_REPLUG = "unplug the brick and plug it in again"


def udev(*, needed: bool, opened: bool) -> Finding:
    """Check for a udev rule that lets users other than root open the brick, and whether this user is one of them.

    Args:
        needed: Whether this user needs the rule.
        opened: Whether this user could open a brick on USB: then nothing is missing.
    """
    rule = find_rule()
    if rule is None:
        return trouble("udev", "no rule lets you open the brick without being root.", FIX_UDEV, needed=needed)
    found = f"a rule for the brick in {rule.file}"
    if opened or rule.everyone:
        return ok("udev", found)
    if not rule.group:
        only = f"{found}, but only for the person at the screen, not over ssh and not for services."
        return warning("udev", only, FIX_UDEV)
    if os.geteuid() and (missing := join_remedy(rule.group)):
        return warning("udev", f"{found}; over ssh and in services it needs the group {rule.group}.", missing)
    return ok("udev", f"{found}, for the group {rule.group}")


def instructions() -> str:
    """Return the shell commands that install the rule and add this user to its group."""
    return (
        f"sudo groupadd --system --force {UDEV_GROUP}\n"
        f"echo '{UDEV_RULE}' | sudo tee {UDEV_FILE}\n"
        "sudo udevadm control --reload\n"
        "sudo udevadm trigger --subsystem-match=usb\n"
        f"sudo usermod -aG {UDEV_GROUP} $USER\n"
        f"# then log out and in again, {_REPLUG}"
    )


def install(file: Path, commands: Sequence[Sequence[str]], user: str = "") -> str:
    """Write the rule and make udev read it.

    Args:
        file: Where the rule goes.
        commands: What to run afterwards; commands that are not installed are skipped.
        user: Who is to drive the brick, such as the user that called ``sudo``; may be empty.

    Returns:
        What was done, what was not, and what is left to do; a udev that is not running reads the rule when it starts.

    Raises:
        OSError: The file cannot be written; root can.
    """
    file.write_text(UDEV_RULE + "\n", encoding="utf-8")
    done = [f"wrote {file}"]
    done += [_ran(command) for command in commands if shutil.which(command[0])]
    join = f"sudo usermod -aG {UDEV_GROUP} {user or '$USER'}"
    return "\n".join(
        [*done, f"run `{join}` unless that user is in the group, log out and in again,", f"then {_REPLUG}"]
    )


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
