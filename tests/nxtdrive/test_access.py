"""Access that the operating system denies, with a remedy for each cause."""

import errno
import grp
import os
import pwd
import re
import sys
from types import SimpleNamespace

import pytest
import serial

from firmware_protocol.errors import CameraError, PermissionDenied
from nxtdrive.host import access
from nxtdrive.transports import open_transport
from nxtdrive.vision.sources import open_camera

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="groups and udev of Linux")

OLD_RULE = access.UDEV_RULE.replace(' GROUP="plugdev",', "")
GROUPS = {"plugdev": 46, "video": 44, "dialout": 20, "root": 0}


@pytest.fixture
def pi(monkeypatch):
    """The user pi, who is in no group but her own; returns a function that changes that."""
    members, processes = set(), set()

    def getgrnam(name):
        return SimpleNamespace(gr_gid=GROUPS[name], gr_mem=["pi"] if name in members else [])

    def getgrgid(number):
        return SimpleNamespace(gr_name={number: name for name, number in GROUPS.items()}[number])

    monkeypatch.setattr(grp, "getgrnam", getgrnam)
    monkeypatch.setattr(grp, "getgrgid", getgrgid)
    monkeypatch.setattr(
        pwd, "getpwuid", lambda _: pwd.struct_passwd(("pi", "x", 1000, 1000, "", "/home/pi", "/bin/sh"))
    )
    monkeypatch.setattr(os, "geteuid", lambda: 1000)
    monkeypatch.setattr(os, "getegid", lambda: 1000)
    monkeypatch.setattr(os, "getgroups", lambda: [GROUPS[name] for name in processes])

    def join(*groups, since_login=True):
        members.update(groups)
        processes.update(groups if since_login else ())

    return join


@pytest.fixture
def rules(monkeypatch, tmp_path):
    """Writes the only udev rules of this computer."""
    monkeypatch.setattr(access, "RULE_FOLDERS", (str(tmp_path),))
    return lambda text: (tmp_path / "60-some.rules").write_text(text + "\n")


def test_the_rule_grants_access_to_a_group_and_to_the_person_at_the_screen():
    assert 'GROUP="plugdev"' in access.UDEV_RULE
    assert 'TAG+="uaccess"' in access.UDEV_RULE


def test_each_reason_why_usb_is_denied_has_its_own_remedy(pi, rules, monkeypatch):
    remedies = {"rule missing": access.usb_remedy()}
    assert "--fix-udev" in remedies["rule missing"]
    rules(OLD_RULE)
    remedies["rule old"] = access.usb_remedy()
    assert re.search("group.*ssh.*--fix-udev", remedies["rule old"])
    rules(access.UDEV_RULE)
    remedies["outsider"] = access.usb_remedy()
    assert re.search("sudo usermod -aG plugdev pi`.*log out and in", remedies["outsider"])
    pi("plugdev", since_login=False)
    remedies["not logged in again"] = access.usb_remedy()
    assert "log out and in" in remedies["not logged in again"]
    assert "usermod" not in remedies["not logged in again"]
    pi("plugdev")
    remedies["rule not applied"] = access.usb_remedy()
    assert re.search("udevadm control --reload.*plug the brick in again", remedies["rule not applied"])
    monkeypatch.delitem(GROUPS, "plugdev")
    remedies["group missing"] = access.usb_remedy()
    assert re.search("groupadd --system plugdev.*usermod -aG plugdev pi", remedies["group missing"])
    monkeypatch.setattr(os, "geteuid", lambda: 0)
    remedies["root"] = access.usb_remedy()
    assert "container" in remedies["root"]
    assert len(set(remedies.values())) == 7


@pytest.mark.parametrize(
    ("line", "group", "everyone"),
    [
        (access.UDEV_RULE, "plugdev", False),
        (OLD_RULE, "", False),
        ('ATTRS{idVendor}=="0694", GROUP="lego", MODE="0660"', "lego", False),
        ('ATTRS{idVendor}=="0694", ATTRS{idProduct}=="0002", \\\n MODE:="0666"', "", True),
    ],
)
def test_rules_of_other_programs_are_understood(rules, line, group, everyone):
    rules(line)
    rule = access.find_rule()
    assert (rule.group, rule.everyone) == (group, everyone)


@pytest.mark.parametrize("line", ["# " + access.UDEV_RULE, access.UDEV_RULE.replace("0002", "0005")])
def test_comments_and_rules_for_other_devices_do_not_count(rules, line):
    rules(line)
    assert access.find_rule() is None


def test_a_file_of_rules_that_cannot_be_read_is_left_out(rules, tmp_path):
    (tmp_path / "10-secret.rules").mkdir()
    rules(access.UDEV_RULE)
    assert access.find_rule().group == "plugdev"


def test_of_several_rules_the_most_generous_counts(rules):
    rules(f"{access.UDEV_RULE}\n{OLD_RULE}")
    assert access.find_rule().group == "plugdev"


def _node(monkeypatch, device, mode, group):
    """A device file that this user may not open."""
    real_open, real_stat = os.open, os.stat

    def open_(path, *args, **options):
        if path == device:
            raise PermissionError(errno.EACCES, "Permission denied")
        return real_open(path, *args, **options)

    node = SimpleNamespace(st_gid=GROUPS[group], st_mode=mode)
    monkeypatch.setattr(os, "open", open_)
    monkeypatch.setattr(os, "stat", lambda path, **more: node if path == device else real_stat(path, **more))


@pytest.mark.parametrize("source", ["7", "/dev/video7"])
def test_a_camera_that_may_not_be_opened_is_not_called_unplugged(pi, monkeypatch, source):
    _node(monkeypatch, "/dev/video7", 0o660, "video")
    with pytest.raises(CameraError, match=r"this user may not open /dev/video7.*usermod -aG video pi"):
        open_camera(source)


@pytest.mark.parametrize(
    ("present", "remedy"),
    [
        ((), "Is it plugged in? This computer has no camera; a virtual machine or container must be given one."),
        (
            ("video2", "video10"),
            "Is it plugged in? There are 2, 10; of the two numbers of a webcam one gives no frames.",
        ),
        (("video0",), "Is it plugged in, and does no other program use it? Cameras are numbered 0, 1, 2..."),
    ],
)
def test_the_remedy_for_a_camera_that_is_not_there_names_those_that_are(tmp_path, mocker, present, remedy):
    mocker.patch("nxtdrive.vision.sources.DEVICES", tmp_path)
    mocker.patch("cv2.VideoCapture", side_effect=OSError("no such device"))
    for name in ("null", "videodev", *present):
        (tmp_path / name).touch()
    with pytest.raises(CameraError) as raised:
        open_camera("0")
    assert raised.value.remedy == remedy


def test_a_serial_port_that_may_not_be_opened_names_its_group(pi, monkeypatch, mocker):
    _node(monkeypatch, "/dev/rfcomm0", 0o660, "dialout")
    mocker.patch("serial.Serial", side_effect=serial.SerialException(errno.EACCES, "Permission denied"))
    with pytest.raises(PermissionDenied, match=r"may not open /dev/rfcomm0.*usermod -aG dialout pi"):
        open_transport("/dev/rfcomm0")


@pytest.mark.parametrize(("mode", "group"), [(0o600, "video"), (0o660, "root")])
def test_a_device_of_root_alone_must_be_given_to_the_group_first(pi, monkeypatch, mode, group):
    _node(monkeypatch, "/dev/video0", mode, group)
    assert re.search(
        "chgrp video /dev/video0.*chmod g[+]rw.*usermod -aG video", access.device_remedy("/dev/video0", "video")
    )


def test_a_member_who_is_denied_is_led_to_the_container(pi, monkeypatch):
    _node(monkeypatch, "/dev/video0", 0o660, "video")
    pi("video")
    assert "container" in access.device_remedy("/dev/video0", "video")
    assert access.is_denied("/dev/video0")
    assert not access.is_denied("/dev/no-such-camera")
    assert not access.is_denied("/dev/null")


def test_a_system_without_device_files_denies_none(monkeypatch):
    """As Windows, whose `os` lacks these flags."""
    monkeypatch.delattr(os, "O_NONBLOCK")
    monkeypatch.delattr(os, "O_NOCTTY")
    assert not access.is_denied("/dev/no-such-camera")
