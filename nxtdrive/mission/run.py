"""A whole mission in one call."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from behaviors.executive import Report
from behaviors.journal import Observer
from behaviors.observers import Observers
from nxtdrive.mission.assembly import MissionRun, open_robot
from nxtdrive.mission.files import in_own_room, read_mission_file, with_profile
from nxtdrive.transports.address import Address


def run_mission(
    mission: str | Path | None = None,
    *,
    nxt: str = "sim://",
    camera: str | None = None,
    profile: str | None = None,
    observers: Iterable[Observer] = (),
) -> Report:
    """Run a mission and return its report; motors are off afterwards.

    ::

        report = nxtdrive.run_mission("cat.toml", nxt="usb://", camera="0")
        print(report.ending, [(each.target, each.outcome) for each in report.targets])

    Nothing is printed or recorded; `nxtdrive run` does both.

    Args:
        mission: The mission file; by default the built-in mission.
        nxt: The brick's address; by default a simulated one. A simulated one that names no room is in the room that
            `nxtdrive mission new` wrote with the mission, else in the bundled one.
        camera: As for `nxtdrive.vision.sources.open_camera`; by default the simulated robot's own, else webcam 0.
        profile: How the robot behaves, as ``--profile`` of `nxtdrive run`; by default as the mission says.
        observers: Called with each record of the journal.

    Raises:
        ConfigError: The mission file has mistakes; the message lists all of them. The profile cannot be loaded.
        BrickNotFound: No brick there.
        LinkError: A brick, but no link to it.
        CameraError: The camera cannot be opened.
    """
    file = None if mission is None else Path(mission)
    loaded = read_mission_file(file)
    if profile is not None:
        loaded = with_profile(loaded, profile)
    guarded = Observers()
    for number, observer in enumerate(observers, 1):
        guarded.add(f"observer {number}", observer)
    with open_robot(in_own_room(Address.parse(nxt), file), camera) as robot:
        return MissionRun(loaded, robot, guarded, file=file).pursue()
