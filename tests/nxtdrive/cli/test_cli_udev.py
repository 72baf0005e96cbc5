"""``doctor --fix-udev --install`` with the real udev, in a namespace of its own: nothing of this computer is touched.

There this user is root, the folders of udev are empty, a real systemd-udevd runs, and the brick is one of umockdev's.
"""

import grp
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from nxtdrive.host.access import UDEV_FILE, UDEV_GROUP, UDEV_RULE

WITHIN_S = 60
UDEVD = next(
    (path for path in ("/lib/systemd/systemd-udevd", "/usr/lib/systemd/systemd-udevd") if Path(path).exists()), ""
)
TOOLS = ("udevadm", "unshare", "umockdev-run")
BRICK = "/devices/pci0000:00/usb1/1-1"
DESCRIPTION = f"""\
P: {BRICK}
N: bus/usb/001/005
E: SUBSYSTEM=usb
E: DEVTYPE=usb_device
E: DEVNAME=/dev/bus/usb/001/005
E: MAJOR=189
E: MINOR=4
E: PRODUCT=694/2/0
E: BUSNUM=001
E: DEVNUM=005
A: idVendor=0694\\n
A: idProduct={{product}}\\n
A: serial=0016530A1B2C\\n
A: busnum=1\\n
A: devnum=5\\n
"""
ROOM = """
set -e
seat=$(cat /lib/udev/rules.d/73-seat-late.rules)
mount -t tmpfs none /run && mkdir -p /run/udev
cp /etc/group /run/group && mount --bind /run/group /etc/group
mount -t tmpfs none /etc/udev && mkdir /etc/udev/rules.d
mount -t tmpfs none /lib/udev/rules.d && echo "$seat" > /lib/udev/rules.d/73-seat-late.rules
"""


@pytest.fixture
def room():
    """Runs shell commands in the namespace; what they need beyond the tools is skipped for with a reason."""
    missing = [tool for tool in TOOLS if shutil.which(tool) is None]
    if missing or not UDEVD:
        pytest.skip(f"not installed: {', '.join([*missing, *([] if UDEVD else ['systemd-udevd'])])}")

    def run(script, **variables):
        return subprocess.run(
            ["unshare", "--map-root-user", "--mount", "sh", "-c", ROOM + script],
            env={**os.environ, "DOCTOR": f"{sys.executable} -m nxtdrive doctor", **variables},
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=WITHIN_S,
            check=False,
        )

    if (tried := run("true")).returncode:
        pytest.skip(f"no namespaces here: {tried.stderr.strip()}")
    return run


@pytest.fixture
def device(tmp_path):
    """Describes a device of LEGO's to umockdev."""

    def make(product):
        file = tmp_path / f"{product}.umockdev"
        file.write_text(DESCRIPTION.format(product=product))
        return str(file)

    return make


def test_the_running_udev_takes_the_installed_rule(room):
    done = room(
        f"{UDEVD} --daemon\nudevadm control --ping\n$DOCTOR --fix-udev --install\n"
        f"cat {UDEV_FILE}\nudevadm control --exit\n"
    )
    assert done.returncode == 0, done.stderr
    assert "ran udevadm control --reload\nran udevadm trigger --subsystem-match=usb\n" in done.stdout
    assert UDEV_RULE in done.stdout


def test_without_a_running_udev_the_rule_is_there_all_the_same(room):
    done = room(f"$DOCTOR --fix-udev --install\ntest -s {UDEV_FILE}")
    assert done.returncode == 0, done.stderr
    assert "udevadm control --reload failed" in done.stdout


@pytest.mark.parametrize(("product", "granted"), [("0002", True), ("0005", False)], ids=["NXT", "EV3"])
def test_udev_gives_the_brick_to_the_group_and_the_person_at_the_screen_and_no_other_device(
    room, device, product, granted
):
    done = room(
        f"$DOCTOR --fix-udev --install >/dev/null\numockdev-run -d $DEVICE -- udevadm test /sys{BRICK} 2>&1",
        DEVICE=device(product),
        SYSTEMD_LOG_LEVEL="debug",
    )
    assert done.returncode == 0, done.stdout
    assert f"Reading rules file: {UDEV_FILE}" in done.stdout
    assert not [line for line in done.stdout.splitlines() if UDEV_FILE in line and ("nvalid" in line or "gnor" in line)]
    assert (f"{UDEV_FILE}:1 MODE 0660" in done.stdout) is granted
    assert (f"{UDEV_FILE}:1 GROUP {grp.getgrnam(UDEV_GROUP).gr_gid}" in done.stdout) is granted
    assert ("run: 'uaccess'" in done.stdout) is granted


def test_udev_finds_nothing_to_object_to(room):
    done = room(f"$DOCTOR --fix-udev --install >/dev/null\nudevadm verify {UDEV_FILE} 2>&1")
    if "Unknown command verb" in done.stdout:
        pytest.skip("this udevadm cannot verify; from version 254 on it can")
    assert done.returncode == 0, done.stdout
