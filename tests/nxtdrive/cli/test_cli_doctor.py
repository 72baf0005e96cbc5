"""``doctor``: what it finds on this computer, on the simulated brick, and on computers that lack something."""

import json
import re
import sys
from types import SimpleNamespace

import cv2
import numpy as np
import pytest
import usb.backend.libusb1
import usb.core

from nxtdrive.cli.main import DONE, NO_BRICK, NOT_ACHIEVED, USAGE, main
from nxtdrive.host import access
from nxtdrive.host.access import UDEV_RULE
from nxtdrive.mission.files import read_mission_file
from nxtdrive.tools.doctor import brick as patient
from nxtdrive.tools.doctor import computer, finding, udev
from nxtdrive.transports.sim import SimTransport, shared
from sim_backend.devices.digital import Compass
from sim_backend.firmware.motors.bench_motor import BenchMotor
from sim_backend.simulation import Simulation
from tests.small_mission import with_table

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="udev and bluetoothctl are Linux's")


@pytest.fixture
def rules(monkeypatch, tmp_path):
    """The only file of udev rules on this computer; empty at first."""
    monkeypatch.setattr(access, "RULE_FOLDERS", (str(tmp_path),))
    return tmp_path / "60-nxtdrive.rules"


def _examine(capsys, *words):
    code = main(["doctor", *words, "--json"])
    report = json.loads(capsys.readouterr().out)
    return code, report, {finding["topic"]: finding for finding in report["findings"]}


@pytest.mark.parametrize(
    ("words", "options"),
    [
        (("sim://",), ""),
        (("usb://", "--camera", "2"), " --nxt usb:// --camera 2"),
        (("usb://", "--camera", "my film.mp4"), " --nxt usb:// --camera 'my film.mp4'"),
    ],
)
def test_the_advice_calibrates_the_robot_that_was_examined(capsys, words, options):
    _, _, findings = _examine(capsys, "--nxt", *words)
    assert findings["calibration"]["remedy"] == f"Measure the robot: nxtdrive calibrate{options}"


def test_a_wrong_robot_file_is_reported_before_the_motors_turn(capsys, refused, monkeypatch, tmp_path):
    monkeypatch.setenv("NXT_ROBOT", str(tmp_path / "none.toml"))
    _, report, findings = _examine(capsys, "--nxt", "sim://")
    assert report["problems"] == 1
    assert findings["calibration"]["verdict"] == "problem"
    assert "NXT_ROBOT" in refused("doctor", "--nxt", "sim://", "--wiggle", "--yes")


def test_the_simulated_brick_is_examined_from_libusb_to_the_sensors(capsys):
    code, report, findings = _examine(capsys, "--nxt", "sim://", "--wiggle", "--yes")
    assert code == DONE
    assert report["brick"]
    assert report["problems"] == 0
    for topic in ("libusb", "udev", "pairing", "serial ports"):
        assert topic in findings
    for topic in ("camera", "firmware", "battery", "sleep timer", "motor B", "motor C", "sensor 4"):
        assert findings[topic]["verdict"] == "ok", findings[topic]


def test_recording_the_traffic_does_not_change_what_is_found(capsys, tmp_path):
    _, plain, _ = _examine(capsys, "--nxt", "sim://")
    _, recorded, _ = _examine(capsys, "--nxt", "sim://", "--trace", str(tmp_path / "doctor.nxttrace"))
    assert recorded == plain


def test_whatever_is_not_ok_has_a_remedy(capsys):
    _, report, _ = _examine(capsys, "--nxt", "sim://")
    assert all(finding["remedy"] for finding in report["findings"] if finding["verdict"] != "ok")


def test_nothing_moves_without_consent(capsys, monkeypatch):
    code, _, findings = _examine(capsys, "--nxt", "sim://", "--wiggle")
    assert code == DONE
    assert findings["wiggle"]["verdict"] == "warning"
    assert "motor B" not in findings


def test_a_weak_simulated_battery_and_an_old_firmware_are_seen(capsys, tmp_path):
    world = tmp_path / "flat.toml"
    world.write_text("[floor]\nsize_mm = [2000, 2000]\n[robot]\nstart_mm = [1000, 1000]\nbattery_mv = 5800\n")
    code, _, findings = _examine(capsys, "--nxt", f"sim://{world}?firmware=1.05")
    assert code == 1
    assert findings["battery"]["verdict"] == "problem"
    assert findings["firmware"]["verdict"] == "warning"


def test_without_a_brick_the_exit_code_says_so(capsys, monkeypatch):
    monkeypatch.setattr(usb.core, "find", lambda **_: iter(()))
    code, report, findings = _examine(capsys, "--nxt", "usb://", "--camera", "nowhere.png")
    assert code == NO_BRICK
    assert not report["brick"]
    assert findings["USB"]["verdict"] == "problem"
    assert findings["camera"]["verdict"] == "warning"
    assert report["problems"] == 1, "one that is missing is one problem"


@pytest.mark.slow
@pytest.mark.parametrize(("grey", "verdict"), [(0, "warning"), (20, "warning"), (90, "ok")])
def test_a_camera_with_a_closed_shutter_is_seen(capsys, tmp_path, grey, verdict):
    cv2.imwrite(str(tmp_path / "view.png"), np.full((24, 32, 3), grey, np.uint8))
    _, _, findings = _examine(capsys, "--nxt", "sim://", "--camera", str(tmp_path / "view.png"))
    assert findings["camera"]["verdict"] == verdict
    assert ("shutter" in findings["camera"]["remedy"]) == (verdict == "warning")


def test_a_camera_whose_first_frames_are_dark_is_not_called_covered(capsys, tmp_path):
    for number, grey in enumerate((0, 0, 0, 90)):
        cv2.imwrite(str(tmp_path / f"{number}.png"), np.full((24, 32, 3), grey, np.uint8))
    _, _, findings = _examine(capsys, "--nxt", "sim://", "--camera", str(tmp_path))
    assert findings["camera"]["verdict"] == "ok"


def test_an_unknown_address_is_a_usage_error(capsys):
    assert main(["doctor", "--nxt", "warp://9", "--camera", "nowhere.png"]) == USAGE


def test_the_report_for_people_has_one_line_each_and_the_remedy_below(printed):
    out = printed("doctor", "--nxt", "sim://")
    assert "\nok       battery" in out
    assert out.rstrip().endswith("No problems found.")


def test_no_libusb_is_a_problem_only_for_a_brick_on_usb(monkeypatch):
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda *_, **__: None)
    assert [finding.verdict for finding in computer.usb(needed=True)] == ["problem"]
    (finding,) = computer.usb(needed=False)
    assert finding.verdict == "warning"
    assert "libusb" in finding.remedy


def test_a_brick_this_user_may_not_open(monkeypatch, rules):
    monkeypatch.setattr("os.geteuid", lambda: 65534)

    class Locked:
        idVendor, idProduct, product = 0x0694, 0x0002, None

        @property
        def serial_number(self):
            raise ValueError("The device has no langid")

    monkeypatch.setattr(usb.core, "find", lambda **_: iter([Locked()]))
    findings = {finding.topic: finding for finding in computer.usb(needed=True)}
    assert findings["permissions"].verdict == "problem"
    assert "--fix-udev" in findings["permissions"].remedy
    assert [each.verdict for each in computer.usb(needed=False) if each.topic == "permissions"] == ["warning"]


def test_without_a_rule_it_is_a_problem_for_those_who_need_it(rules):
    assert udev.udev(needed=True, opened=False).verdict == "problem"
    assert udev.udev(needed=False, opened=False).verdict == "warning"


def test_a_rule_without_a_group_is_renewed_unless_the_brick_could_be_opened(rules):
    rules.write_text(UDEV_RULE.replace(' GROUP="plugdev",', ""))
    found = udev.udev(needed=True, opened=False)
    assert (found.verdict, "--fix-udev" in found.remedy) == ("warning", True)
    assert udev.udev(needed=True, opened=True).verdict == "ok"


def test_a_rule_with_a_group_needs_its_members(rules, monkeypatch):
    rules.write_text(UDEV_RULE)
    monkeypatch.setattr("os.geteuid", lambda: 65534)
    monkeypatch.setattr("os.getgroups", list)
    found = udev.udev(needed=True, opened=False)
    assert (found.verdict, "usermod -aG plugdev" in found.remedy) == ("warning", True)
    rules.write_text(UDEV_RULE.replace("0660", "0666"))
    assert udev.udev(needed=True, opened=False).verdict == "ok"


def test_installing_the_rule_makes_the_doctor_content(rules):
    said = udev.install(rules, [("true",), ("no-such-program-here",)], "pi")
    assert "ran true" in said
    assert "no-such-program" not in said
    assert "sudo usermod -aG plugdev pi" in said
    assert udev.udev(needed=True, opened=True).verdict == "ok"


def test_the_udev_instructions_hold_rule_and_commands(printed):
    out = printed("doctor", "--fix-udev")
    assert UDEV_RULE in out
    assert "udevadm control --reload" in out
    assert "groupadd --system --force plugdev" in out
    assert "usermod -aG plugdev $USER" in out


@pytest.mark.parametrize("installed", [True, False])
def test_installing_needs_root_and_says_how_from_any_environment(capsys, monkeypatch, tmp_path, installed):
    program = tmp_path / "my env" / "nxtdrive"
    program.parent.mkdir()
    if installed:
        program.write_text("#!/bin/sh\n")
        program.chmod(0o755)
    monkeypatch.setenv("PATH", str(program.parent))
    monkeypatch.setattr("os.geteuid", lambda: 1000)
    assert main(["doctor", "--fix-udev", "--install"]) == USAGE
    words = f"'{program}'" if installed else f"{sys.executable} -m nxtdrive"
    assert f"Run: sudo {words} doctor --fix-udev --install\n" in capsys.readouterr().err


def test_install_belongs_to_fix_udev(capsys):
    assert main(["doctor", "--install"]) == USAGE


def test_a_rule_that_root_cannot_write_is_an_error_with_a_way_out(refused, monkeypatch, tmp_path):
    monkeypatch.setattr("os.geteuid", lambda: 0)
    monkeypatch.setattr("nxtdrive.host.access.UDEV_FILE", str(tmp_path / "nowhere" / "60-nxtdrive.rules"))
    assert "60-nxtdrive.rules: No such file or directory." in (err := refused("doctor", "--fix-udev", "--install"))
    assert "doctor --fix-udev" in err


def test_a_udev_that_does_not_listen_does_not_undo_the_rule(tmp_path, monkeypatch):
    monkeypatch.setattr(udev, "COMMAND_TIMEOUT_S", 0.05)
    file = tmp_path / "60-nxtdrive.rules"
    said = udev.install(file, [("sh", "-c", "echo deaf >&2; exit 3"), ("cat", "/dev/zero"), ("true",)])
    assert file.exists()
    assert "failed (deaf)" in said
    assert "cat /dev/zero does not end" in said
    assert "ran true" in said


@pytest.fixture(autouse=True)
def some_libusb(monkeypatch):
    """Computers without libusb and without a brick give the same findings here."""
    monkeypatch.setattr(usb.backend.libusb1, "get_backend", lambda *_, **__: object())
    monkeypatch.setattr(usb.core, "find", lambda **_: iter(()))


@pytest.mark.parametrize(
    ("listing", "verdict"),
    [("Device 00:16:53:0a:1b:2c NXT", "ok"), ("Device 11:22:33:44:55:66 Headset", "problem"), ("", "problem")],
)
def test_a_paired_brick_is_named_by_its_address(bluetoothctl, listing, verdict):
    bluetoothctl(f"echo '{listing}'")
    finding = computer.bluetooth(needed=True)
    assert finding.verdict == verdict
    if verdict == "ok":
        assert finding.text == "bt://00:16:53:0A:1B:2C NXT"


def test_what_bluetooth_lacks_is_a_problem_only_if_it_is_needed(bluetoothctl):
    bluetoothctl("echo No default controller available")
    finding = computer.bluetooth(needed=True)
    assert (finding.verdict, finding.text) == ("problem", "this computer has no Bluetooth adapter.")
    assert finding.remedy
    assert computer.bluetooth(needed=False).verdict == "warning"


@pytest.mark.parametrize(
    ("millivolts", "verdict"), [(9000, "ok"), (7100, "ok"), (7099, "warning"), (6100, "warning"), (6099, "problem")]
)
def test_the_battery_is_rated_as_the_brick_rates_it(millivolts, verdict):
    assert patient.battery(millivolts).verdict == verdict


def test_sleep_timer_and_firmware():
    assert patient.sleep_timer(0).verdict == "ok"
    assert patient.sleep_timer(600_000).verdict == "ok"
    assert patient.sleep_timer(120_000).verdict == "warning"
    assert patient.firmware("1.29").verdict == "ok"
    assert patient.firmware("1.31").verdict == "warning"


def test_what_the_mission_needs_and_is_not_there_is_a_problem(lab):
    room = lab()
    room.attach(4, None)
    findings = {finding.topic: finding for finding in patient.wiggle(room.brick, read_mission_file(None))}
    assert findings["sensor 4"].verdict == "problem"
    assert findings["motor B"].verdict == "ok"
    assert findings["motor A"].verdict == "ok"


@pytest.mark.parametrize(("heading_deg", "verdict"), [(None, "problem"), (123, "ok")])
def test_a_compass_that_the_mission_needs_is_examined(lab, heading_deg, verdict):
    room, mission = lab(), with_table(read_mission_file(None), "robot", compass=2)
    if heading_deg is not None:
        room.attach(2, Compass(lambda: heading_deg))
    findings = {finding.topic: finding for finding in patient.wiggle(room.brick, mission)}
    assert findings["sensor 2"].verdict == verdict
    assert ("123°" in findings["sensor 2"].text) is (heading_deg is not None)
    assert findings["sensor 4"].verdict == "ok"


def test_a_motor_that_is_not_there(lab):
    room = lab()
    room.attach("B", BenchMotor(locked=True))
    room.attach("A", BenchMotor(locked=True))
    findings = {finding.topic: finding for finding in patient.wiggle(room.brick, read_mission_file(None))}
    assert findings["motor B"].verdict == "problem"
    assert findings["motor A"].verdict == "ok"
    assert findings["motor C"].verdict == "ok"


@pytest.mark.parametrize(
    ("vendor", "product", "name", "says"),
    [
        (0x0694, 0x0002, "LEGO MINDSTORMS NXT + Pybricks", "runs Pybricks"),
        (0x0694, 0x0005, "EV3", "an EV3"),
        (0x0694, 0xFF00, "", "leJOS"),
        (0x0694, 0x0009, "LEGO Technic Large Hub", "LEGO Technic Large Hub (0694:0009)"),
        (0x03EB, 0x6124, "", "firmware update mode"),
        (0x0694, 0x0002, None, None),
    ],
)
def test_a_device_that_is_not_an_nxt_with_lego_s_firmware_is_named(monkeypatch, vendor, product, name, says):
    device = SimpleNamespace(idVendor=vendor, idProduct=product, product=name, serial_number="0016530A1B2C")

    def find(*, custom_match=lambda _: True, **_):
        return iter([device] if custom_match(device) else [])

    monkeypatch.setattr(usb.core, "find", find)
    others = [each for each in computer.usb(needed=True) if each.topic == "USB device"]
    assert [says in each.text and bool(each.remedy) for each in others] == ([True] if says else [])


def test_two_opencvs_in_one_environment_are_a_conflict(tmp_path, monkeypatch):
    assert not list(computer.opencv())
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in ("opencv_python", "opencv_contrib_python_headless"):
        folder = tmp_path / f"{name}-4.11.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 4.11.0\n")
    (found,) = computer.opencv()
    assert "opencv-contrib-python-headless and opencv-python and opencv-python-headless are" in found.text
    assert "uninstall opencv-contrib-python-headless opencv-python opencv-python-headless" in found.remedy
    assert re.search(r"install '?opencv-python-headless<5,>=4\.\d+", found.remedy)


@pytest.mark.parametrize("backport", [False, True])
def test_what_an_interrupted_installation_has_left_is_no_opencv(tmp_path, monkeypatch, backport):
    if backport:  # once this is imported, it finds distributions as well
        pytest.importorskip("importlib_metadata", reason="importlib_metadata is not installed")
    monkeypatch.syspath_prepend(str(tmp_path))
    (tmp_path / "~umpy-2.0.0.dist-info").mkdir()
    assert not list(computer.opencv())


@pytest.mark.parametrize(
    ("states", "says"),
    [([("1", "0")], "rfkill unblock"), ([("0", "1")], "switch"), ([("0", "0")], ""), ([("1", "0"), ("0", "0")], "")],
)
def test_a_radio_that_is_switched_off_is_reported_as_off(tmp_path, monkeypatch, states, says):
    monkeypatch.setattr(computer, "RADIOS", tmp_path)
    for number, (soft, hard) in enumerate([*states, ("1", "1")]):
        folder = tmp_path / f"rfkill{number}"
        folder.mkdir()
        (folder / "type").write_text("bluetooth\n" if number < len(states) else "wlan\n")
        (folder / "soft").write_text(f"{soft}\n")
        (folder / "hard").write_text(f"{hard}\n")
    found = list(computer.radio(needed=True))
    assert [says in each.remedy for each in found] == ([True] if says else [])


def test_long_findings_are_wrapped_below_each_other_and_commands_stay_whole():
    command = "`sudo usermod -aG plugdev user-with-a-long-name`"
    made = finding.problem(
        "permissions", "this user may not open the brick on USB.", f"First line:\n{command}, then {command}"
    )
    shown = finding.lines(made, 72)
    assert shown[0].startswith("problem  permissions   this user")
    assert shown[1] == f"{finding.INDENT}-> First line:"
    assert all(line.startswith(f"{finding.INDENT}   ") for line in shown[2:])
    assert sum(command in line for line in shown) == 2
    assert len(finding.lines(made, None)) == 3


def test_each_motor_that_does_not_turn_is_a_problem_of_its_own(capsys):
    simulation = Simulation("open")
    for port in "BC":
        simulation.brick.attach_motor(port, BenchMotor(locked=True))
    with shared("stuck", lambda: SimTransport(simulation)) as address:
        code, report, findings = _examine(capsys, "--nxt", address, "--wiggle", "--yes")
    assert (code, report["problems"]) == (NOT_ACHIEVED, 2)
    assert [findings[f"motor {port}"]["text"] for port in "BC"] == ["does not turn."] * 2
    assert {f"sensor {port}" for port in range(1, 5)} <= findings.keys()


@pytest.mark.parametrize(("brick", "warns"), [("0016530A1B2C", True), ("001653010203", False), ("", False)])
def test_a_robot_file_of_another_brick_is_a_warning(capsys, tmp_path, brick, warns):
    path = tmp_path / "robot.toml"
    path.write_text(f'[calibration]\nformat = 1\nbrick_id = "{brick}"\n', encoding="utf-8")
    _, report, findings = _examine(capsys, "--nxt", "sim://", "--robot", str(path))
    assert report["problems"] == 0
    assert ("robot file" in findings) is warns
    if warns:
        assert findings["robot file"]["verdict"] == "warning"
        assert "0016530A1B2C, and this one is 001653010203" in findings["robot file"]["text"]
