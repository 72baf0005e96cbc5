"""Paired bricks: what BlueZ's command says in its versions, and the real one on a bus with a simulated BlueZ."""

import os
import shutil
import subprocess
import sys
import threading

import pytest

from firmware_protocol.errors import LinkError
from nxtdrive.transports import pairing
from nxtdrive.transports.pairing import paired_bricks

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="bluetoothctl is Linux's")

WITHIN_S = 10
DBUSMOCK_PYTHONS = (sys.executable, "/usr/bin/python3")
TOOLS = ("bluetoothctl", "dbus-daemon", "dbus-send")
BRICK, STRANGER, HEADSET = "00:16:53:0A:1B:2C", "00:16:53:0A:1B:2D", "11:22:33:44:55:66"


def test_lego_s_addresses_count_with_or_without_a_name(bluetoothctl):
    bluetoothctl(
        "echo 'Device 00:16:53:0a:1b:2c my NXT '; echo Device 00:16:53:00:00:01; echo Device 00:17:53:00:00:01 NXT"
    )
    assert paired_bricks() == {BRICK: "my NXT", "00:16:53:00:00:01": ""}


def test_older_versions_are_asked_in_their_own_words(bluetoothctl):
    bluetoothctl('[ "$1" = paired-devices ] || { echo Too many arguments; exit 1; }; echo Device 00:16:53:0A:1B:2C NXT')
    assert paired_bricks() == {BRICK: "NXT"}


def test_it_is_asked_in_no_language_but_english(bluetoothctl, monkeypatch):
    monkeypatch.setenv("LC_ALL", "de_DE.UTF-8")
    bluetoothctl('[ "$LC_ALL" = C ] && echo Device 00:16:53:0A:1B:2C NXT')
    assert paired_bricks() == {BRICK: "NXT"}


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("echo No default controller available", "no Bluetooth adapter"),
        ("kill -ABRT $$", "service does not answer"),
        ("exec cat /dev/zero", "service does not answer"),
    ],
    ids=["no adapter", "no bus", "no service"],
)
def test_a_tool_that_cannot_be_run_is_an_error_with_a_remedy(bluetoothctl, monkeypatch, script, message):
    monkeypatch.setattr(pairing, "COMMAND_TIMEOUT_S", 0.1)
    bluetoothctl(script)
    with pytest.raises(LinkError, match=message) as raised:
        paired_bricks()
    assert raised.value.remedy


def test_other_systems_list_no_paired_bricks(bluetoothctl, monkeypatch):
    bluetoothctl("echo Device 00:16:53:0A:1B:2C NXT")
    monkeypatch.setattr(sys, "platform", "darwin")
    assert paired_bricks() == {}


def test_nothing_is_asked_without_an_adapter_or_the_command(bluetoothctl, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path / "programs"))
    with pytest.raises(LinkError, match="bluetoothctl is not installed"):
        paired_bricks()
    (tmp_path / "empty").mkdir()
    for without in ("none", "empty"):
        monkeypatch.setattr(pairing, "ADAPTERS", tmp_path / without)
        with pytest.raises(LinkError, match="no Bluetooth adapter"):
            paired_bricks()


# --- the real bluetoothctl ---


def _has_dbusmock(python):
    asked = subprocess.run([python, "-c", "import dbusmock"], capture_output=True, check=False)
    return asked.returncode == 0


@pytest.fixture
def bluez(monkeypatch, tmp_path):
    """Calls the simulated BlueZ (python-dbusmock's) on a system bus of its own."""
    if missing := [tool for tool in TOOLS if shutil.which(tool) is None]:
        pytest.skip(f"not installed: {', '.join(missing)}")
    pythons = [python for python in DBUSMOCK_PYTHONS if os.access(python, os.X_OK) and _has_dbusmock(python)]
    if not pythons:
        pytest.skip("python-dbusmock is not installed")
    (tmp_path / "hci0").mkdir()
    monkeypatch.setattr(pairing, "ADAPTERS", tmp_path)
    quiet = {"stdin": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "text": True}
    bus = subprocess.Popen(["dbus-daemon", "--session", "--nofork", "--print-address"], stdout=subprocess.PIPE, **quiet)
    service = None
    try:
        monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", bus.stdout.readline().strip())
        words = [pythons[0], "-m", "dbusmock", "--system", "--template", "bluez5"]
        service = subprocess.Popen(words, stdout=subprocess.DEVNULL, **quiet)

        def call(method, *arguments):
            words = ["dbus-send", "--system", "--print-reply", "--dest=org.bluez", "/", f"org.bluez.Mock.{method}"]
            return subprocess.run([*words, *arguments], capture_output=True, check=False).returncode == 0

        _until_on_the_bus(service)
        yield call
    finally:
        for process in (service, bus):
            if process is not None:
                process.terminate()
                process.communicate(timeout=WITHIN_S)


def _until_on_the_bus(service):
    words = ["dbus-send", "--system", "--print-reply", "--dest=org.freedesktop.DBus", "/"]
    words += ["org.freedesktop.DBus.NameHasOwner", "string:org.bluez"]
    for _ in range(100 * WITHIN_S):
        if b"true" in subprocess.run(words, capture_output=True, check=False).stdout:
            return
        if service.poll() is not None:
            pytest.skip("this python-dbusmock has no BlueZ")
        threading.Event().wait(0.01)
    pytest.fail("the simulated BlueZ does not come up")


def test_the_real_command_names_paired_bricks_only(bluez, printed):
    assert bluez("AddAdapter", "string:hci0", "string:desk")
    for mac, name in ((BRICK, "NXT"), (STRANGER, "not paired"), (HEADSET, "Headset")):
        assert bluez("AddDevice", "string:hci0", f"string:{mac}", f"string:{name}")
    for mac in (BRICK, HEADSET):
        assert bluez("PairDevice", "string:hci0", f"string:{mac}", "int32:2052")
    assert paired_bricks() == {BRICK: "NXT"}
    assert f"bt://{BRICK}  paired LEGO brick NXT\n" in printed("list")


def test_the_real_command_without_an_adapter(bluez):
    with pytest.raises(LinkError, match="no Bluetooth adapter"):
        paired_bricks()


def test_the_real_command_without_a_bus(bluez, monkeypatch):
    monkeypatch.setenv("DBUS_SYSTEM_BUS_ADDRESS", "unix:path=/nowhere")
    with pytest.raises(LinkError, match="service does not answer"):
        paired_bricks()
