"""Short programs for the campaign of link faults; each is a list of actions with checks of their values."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from behaviors.ports import StopReason
from firmware_protocol.direct import GetCurrentProgramName, GetInputValues, MessageRead
from firmware_protocol.enums import InputPort
from firmware_protocol.status import Status
from nxtdrive.brick import Brick
from nxtdrive.motion.motor import Then
from nxtdrive.motion.rover import Rover
from nxtdrive.sensors.identity import identify
from sim_backend.simulation import Simulation

ANGLE_DEG, ANGLE_TOLERANCE_DEG = 80.0, 20.0
PROGRAM = bytes.fromhex(
    "4d696e6473746f726d734e585400000500000a0000000a0000000a000000000000000100020000000a000100ffffffff0000000025400000"
)
"""A program that runs forever."""
STORED = {"stored.txt": bytes(range(256)) + bytes(range(45)), "loop.rxe": PROGRAM}
"""Files on the brick before the program begins."""
WRITTEN = bytes(255 - i % 251 for i in range(150))
SETTINGS = "NVConfig.sys"
BATTERY_MV = (7500, 8100)
PICTURE_MM, ECHO_MM = 2300.0, 120.0
"""Position of the axle when the sonar touches the picture ahead, and how old and how inaccurate an echo may be."""
POSE_MM, POSE_DEG = 60.0, 10.0
"""Largest error of odometry."""
UNSEEN_SHARE = 2.0
"""Larger by this factor after a restart of the brick, whose wheels turned unobserved until their lease ended."""


@dataclass
class Trial:
    """A program's brick, and the wrong values that the program read.

    Attributes:
        simulation: The ground truth.
        brick: The driver.
        rover: The same as a vehicle.
        wrong: Values that do not fit their request, in words.
    """

    simulation: Simulation
    brick: Brick
    rover: Rover
    wrong: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        self._first = self.simulation.brick

    @property
    def restarted(self) -> bool:
        """Whether the brick was restarted."""
        return self.simulation.brick is not self._first

    def expect(self, right: bool, what: str, value: object) -> None:
        """Record a wrong value."""
        if not right:
            self.wrong.append(f"{what} is {value!r}")

    def rotation(self, port: int) -> int:
        """Return the brick's own counter of a motor."""
        return self.simulation.brick.output.outputs[port].control.rotation


Action = Callable[[Trial], object]


# --- motors ---


def _turn_by_angle(trial: Trial) -> None:
    begin, brick = trial.rotation(0), trial.simulation.brick
    if (
        trial.brick.motor("A").run_angle(500, ANGLE_DEG, Then.BRAKE) is StopReason.DONE
        and brick is trial.simulation.brick
    ):
        turned = trial.rotation(0) - begin
        trial.expect(abs(turned - ANGLE_DEG) <= ANGLE_TOLERANCE_DEG, "the angle of a motion that is done", turned)


def _read_angle(trial: Trial) -> None:
    before, brick = trial.rotation(0), trial.simulation.brick
    value = trial.brick.motor("A").angle
    low, high = sorted((before, trial.rotation(0)))
    right = low - ANGLE_TOLERANCE_DEG <= value <= high + ANGLE_TOLERANCE_DEG or brick is not trial.simulation.brick
    trial.expect(right, f"the angle of motor A ({before})", value)


def _keep_turning(trial: Trial) -> None:
    motor = trial.brick.motor("A")
    motor.run(400)
    trial.brick.sleep(0.2)
    motor.dc(-50)
    trial.brick.sleep(0.2)
    motor.brake()


# --- the rover ---


def _polled_motion(trial: Trial) -> None:
    """Poll the sonar during a motion."""
    motion = trial.rover.straight(70, wait=False)
    while not motion.done:
        _distance(trial)
        trial.brick.sleep(0.05)
    motion.join()


def _pose(trial: Trial) -> None:
    """Compare odometry with the truth; the robot starts at (400, 1200) and looks along x."""
    pose, truth = trial.rover.pose(), trial.simulation.truth.pose
    off_mm = math.hypot(pose.x_mm - truth.x_mm + 400, pose.y_mm - truth.y_mm + 1200)
    unseen = UNSEEN_SHARE if trial.restarted else 1.0
    trial.expect(off_mm < POSE_MM * unseen, f"the pose, {off_mm:.0f} mm off {truth},", pose)
    trial.expect(abs(pose.heading_deg - truth.heading_deg) < POSE_DEG * unseen, f"the heading, really {truth},", pose)


def _drive(trial: Trial) -> None:
    for _ in range(3):
        trial.rover.drive(150, 20)
        trial.brick.sleep(0.1)
    trial.rover.stop()


# --- sensors ---


def _distance(trial: Trial) -> None:
    """Compare the sonar with the truth; the robot may drive, and the sensor measures every 0.1 s or so."""
    before = trial.simulation.truth.pose
    value = trial.brick.ultrasonic(4).distance_mm
    ahead_mm = PICTURE_MM - before.x_mm
    if abs(before.heading_deg) < 5 and value is not None:
        trial.expect(abs(value - ahead_mm) < ECHO_MM, f"the distance ahead, {ahead_mm:.0f} mm,", value)


def _touch(trial: Trial) -> None:
    trial.expect(trial.brick.touch(1).pressed is False, "the bumper", True)


def _battery(trial: Trial) -> None:
    value = trial.brick.battery_v * 1000
    trial.expect(BATTERY_MV[0] <= value <= BATTERY_MV[1], "the battery", value)


def _registers(trial: Trial) -> None:
    """Read registers of several sizes in turn: a byte that is left over would shift the next ones."""
    sonar = trial.brick.ultrasonic(4)
    for register, size, content in ((0x08, 8, b"LEGO\0\0\0\0"), (0x10, 8, b"Sonar\0\0\0"), (0x00, 5, b"V1.0\0")):
        value = sonar.read(register, size)
        trial.expect(value == content, f"register {register}", value)


def _identity(trial: Trial) -> None:
    found = identify(trial.brick.link, 4)
    trial.expect(found is None or found.product == "Sonar", "the product", found)


def _ports(trial: Trial) -> None:
    for port in InputPort:
        values = trial.brick.request(GetInputValues(port))
        trial.expect(values.port == port, f"the requested port {port}", values.port)


# --- files, programs, messages ---


def _list(trial: Trial) -> None:
    names = {entry.name: entry.size for entry in trial.brick.files.ls("*") if entry.name not in (SETTINGS, "new.txt")}
    trial.expect(names == {name: len(data) for name, data in STORED.items()}, "the list of files", names)


def _read_file(trial: Trial) -> None:
    content = trial.brick.files.read("stored.txt")
    trial.expect(content == STORED["stored.txt"], "a file", content.hex())


def _write_file(trial: Trial) -> None:
    trial.brick.files.write("new.txt", WRITTEN, replace=True)
    trial.expect(_content(trial, "new.txt") == WRITTEN, "a file that was written", _content(trial, "new.txt"))


def _delete_file(trial: Trial) -> None:
    trial.brick.files.delete("new.txt")
    trial.expect(_content(trial, "new.txt") is None, "a file that was deleted", _content(trial, "new.txt"))


def _content(trial: Trial, name: str) -> bytes | None:
    files = {file.name: bytes(file.content) for file in trial.simulation.brick.loader.flash.files}
    return files.get(name)


def _start(trial: Trial) -> None:
    trial.brick.programs.start("loop.rxe")


def _running(trial: Trial) -> None:
    name = trial.brick.request(GetCurrentProgramName()).name
    trial.expect(name == "loop.rxe", "the running program", name)


def _messages(trial: Trial) -> None:
    """Put numbered messages into two boxes and take them out again, in order and each once."""
    for number in range(3):
        for box, letter in ((3, "a"), (4, "b")):
            trial.brick.programs.write_message(box, f"{letter}{number}")
            text = trial.brick.request(MessageRead(box - 1, box - 1, True)).text
            trial.expect(text[:1] == letter, f"a message of box {box}", text)


def _stop_program(trial: Trial) -> None:
    if not trial.brick.programs.stop():
        return
    status = (trial.simulation.brick.receive(GetCurrentProgramName().encode()) or b"")[2:3]
    trial.expect(status == bytes((Status.NO_ACTIVE_PROGRAM,)), "the status of a program that was stopped", status)


def _info(trial: Trial) -> None:
    info = trial.brick.info()
    right = (info.name, info.bluetooth_address, info.firmware) == ("NXT", "00:16:53:01:02:03", "1.29")
    trial.expect(right, "the brick's description", info)


PROGRAMS: dict[str, Sequence[Action]] = {
    "motor": (_turn_by_angle, _read_angle, _keep_turning, _battery),
    "straight": (lambda trial: trial.rover.straight(60), _drive, _pose, _touch),
    "turn": (lambda trial: trial.rover.turn(30), lambda trial: trial.rover.turn(-15), _distance, _pose),
    "curve": (lambda trial: trial.rover.curve(120, 20), lambda trial: trial.rover.straight(-30), _pose),
    "polled motion": (_polled_motion, _pose, _battery),
    "sensors": (_touch, _distance, _battery, _distance, _ports, _touch, _distance, _registers, _distance, _info),
    "registers": (_identity, _registers, _touch, _registers, _distance, _ports, _battery),
    "reading files": (_list, _read_file, _battery, _list),
    "writing files": (_write_file, _list, _delete_file, _read_file),
    "programs": (_start, _running, _messages, _stop_program, _battery),
}
"""The programs by name."""
