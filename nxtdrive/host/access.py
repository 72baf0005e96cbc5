"""Access rights of devices on Linux: which udev rule and group grant it, and what is missing."""

from __future__ import annotations

import errno
import os
import re
import stat
import sys
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

UDEV_GROUP = "plugdev"
"""Debian, Raspberry Pi OS and Ubuntu have this group for devices that users plug in, and put their users into it."""
UDEV_RULE = (
    'SUBSYSTEM=="usb", ATTR{idVendor}=="0694", ATTR{idProduct}=="0002", '
    f'MODE="0660", GROUP="{UDEV_GROUP}", TAG+="uaccess"'
)
"""``uaccess`` gives access to the person at the screen; ssh sessions and services need the group."""
UDEV_FILE = "/etc/udev/rules.d/60-nxtdrive.rules"
RULE_FOLDERS = (
    "/etc/udev/rules.d",
    "/run/udev/rules.d",
    "/usr/local/lib/udev/rules.d",
    "/lib/udev/rules.d",
    "/usr/lib/udev/rules.d",
)

_GROUP = re.compile(r'\bGROUP:?="([^"]+)"')
_EVERYONE = re.compile(r'\bMODE:?="0?\d\d[67]"')
_PRODUCT = re.compile(r'idProduct\}=="(\w+)"')
FIX_UDEV = "Run `nxtdrive doctor --fix-udev`, do what it says, and plug the brick in again."
_AGAIN = "then log out and in again (a service: restart it)"


class Membership(StrEnum):
    """How this user relates to a group."""

    NO_GROUP = "the group does not exist"
    OUTSIDER = "not in the group"
    NEXT_LOGIN = "in the group since after this session began"
    MEMBER = "in the group"


@dataclass(frozen=True, slots=True)
class UdevRule:
    """A rule for the brick.

    Attributes:
        file: The file that has it.
        group: The group that it gives access to, or an empty string.
        everyone: Whether it gives access to all users.
    """

    file: Path
    group: str
    everyone: bool


def membership(group: str) -> Membership:
    """Return how this user and this process relate to a group."""
    import grp

    try:
        entry = grp.getgrnam(group)
    except KeyError:
        return Membership.NO_GROUP
    if entry.gr_gid in (os.getegid(), *os.getgroups()):
        return Membership.MEMBER
    return Membership.NEXT_LOGIN if user_name() in entry.gr_mem else Membership.OUTSIDER


def user_name() -> str:
    """Return this user's name for a shell command."""
    import pwd

    try:
        return pwd.getpwuid(os.geteuid()).pw_name
    except KeyError:  # an arbitrary user id, as in containers
        return "$USER"


def join_remedy(group: str) -> str:
    """Return how this user becomes a member of a group, as a sentence; an empty string for a member."""
    join = f"`sudo usermod -aG {group} {user_name()}`, {_AGAIN}"
    match membership(group):
        case Membership.NO_GROUP:
            return (
                f"Make the group and join it: `sudo groupadd --system {group}`, {join}, and plug the device in again."
            )
        case Membership.OUTSIDER:
            return f"Join the group {group}: {join}."
        case Membership.NEXT_LOGIN:
            return f"This user joined the group {group} after this session began: log out and in again."
    return ""


def find_rule() -> UdevRule | None:
    """Return the udev rule for the brick that gives access to most users, or None."""
    found = []
    for folder in RULE_FOLDERS:
        for file in sorted(Path(folder).glob("*.rules")):
            try:
                text = file.read_text(encoding="utf-8", errors="replace").replace("\\\n", "")
            except OSError:  # only root may read it
                continue
            for line in text.splitlines():
                if _is_for_brick(line):
                    group = _GROUP.search(line)
                    found.append(UdevRule(file, group[1] if group else "", bool(_EVERYONE.search(line))))
    return max(found, key=lambda rule: (rule.everyone, bool(rule.group)), default=None)


def usb_remedy() -> str:
    """Return what to do when this user may not open the brick on USB."""
    if not sys.platform.startswith("linux"):
        return (
            "Close other programs that use the brick; on Windows, give it the WinUSB driver with Zadig (zadig.akeo.ie)."
        )
    if os.geteuid() == 0:
        return "Pass the device /dev/bus/usb to this container or virtual machine: even root may not open it here."
    rule = find_rule()
    if rule is None:
        return f"No udev rule allows it (the brick is 0694:0002). {FIX_UDEV}"
    if not (rule.group or rule.everyone):
        return f"The udev rule {rule.file} names no group, so it does not count over ssh and for services. {FIX_UDEV}"
    return (
        (join_remedy(rule.group) if rule.group and not rule.everyone else "")
        or "The udev rule is there but has not been applied: run `sudo udevadm control --reload`, "
        "and plug the brick in again."
    )


def is_denied(device: str) -> bool:
    """Return whether the device exists and this user may not open it; it is opened for a moment."""
    try:
        os.close(os.open(device, os.O_RDWR | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_NOCTTY", 0)))
    except OSError as error:
        return error.errno in (errno.EACCES, errno.EPERM)
    return False


def device_remedy(device: str, usual_group: str) -> str:
    """Return what to do when this user may not open a device file.

    Args:
        device: Such as ``/dev/video0``.
        usual_group: The group that such devices belong to, for a file that belongs to root alone.
    """
    if not sys.platform.startswith("linux"):
        return f"Allow it in the system's settings, or give this user access to {device}."
    try:
        status = os.stat(device)
    except OSError:
        return join_remedy(usual_group)
    group = _group_name(status.st_gid)
    if not group or not status.st_gid or not status.st_mode & stat.S_IRGRP:
        give = f"Give it to the group {usual_group}: `sudo chgrp {usual_group} {device}`, `sudo chmod g+rw {device}`."
        return f"{give} {join_remedy(usual_group)}".strip()
    return join_remedy(group) or f"Is {device} passed to this container, with the right to use it?"


def _is_for_brick(line: str) -> bool:
    product = _PRODUCT.search(line)
    return "0694" in line and not line.lstrip().startswith("#") and (product is None or product[1] == "0002")


def _group_name(number: int) -> str:
    import grp

    try:
        return grp.getgrgid(number).gr_name
    except KeyError:
        return ""
