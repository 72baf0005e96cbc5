"""The driver: bricks, motors, sensors and the rover, over any transport; and missions in one line.

::

    from nxtdrive import open_brick

    with open_brick("sim://") as brick:
        brick.motor("A").run_angle(360, 720)
        print(brick.touch(1).pressed, brick.ultrasonic(4).distance_mm, brick.battery_v)
        brick.rover().straight(300)

    report = nxtdrive.run_mission("cat.toml", nxt="usb://", camera="0")

Sensors' classes are in `nxtdrive.sensors`, errors in `nxtdrive.errors`. The names exported here are loaded on first
use.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from behaviors.ports import MotionResult, Pose, StopReason
    from firmware_protocol.errors import NXTError
    from nxtdrive.brick import Brick, BrickInfo, open_brick
    from nxtdrive.mission.run import run_mission
    from nxtdrive.motion.motor import Motor, MotorSettings, Then
    from nxtdrive.motion.rover import DriveSettings, Rover, SafetyLimits
    from nxtdrive.transports import open_transport

__all__ = [
    "Brick",
    "BrickInfo",
    "DriveSettings",
    "MotionResult",
    "Motor",
    "MotorSettings",
    "NXTError",
    "Pose",
    "Rover",
    "SafetyLimits",
    "StopReason",
    "Then",
    "open_brick",
    "open_transport",
    "run_mission",
]

_HOMES = {
    "behaviors.ports": ("MotionResult", "Pose", "StopReason"),
    "firmware_protocol.errors": ("NXTError",),
    "nxtdrive.brick": ("Brick", "BrickInfo", "open_brick"),
    "nxtdrive.mission.run": ("run_mission",),
    "nxtdrive.motion.motor": ("Motor", "MotorSettings", "Then"),
    "nxtdrive.motion.rover": ("DriveSettings", "Rover", "SafetyLimits"),
    "nxtdrive.transports": ("open_transport",),
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 - whatever has that name
    if name == "__version__":
        from nxtdrive.version import installed_version

        return installed_version()
    for module, names in _HOMES.items():
        if name in names:
            value = globals()[name] = getattr(import_module(module), name)
            return value
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
