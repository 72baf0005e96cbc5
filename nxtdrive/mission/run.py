"""A whole mission in one call."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import ExitStack, closing
from pathlib import Path

from behaviors.executive import Executive, Report
from behaviors.journal import Observer
from behaviors.observers import Observers
from nxtdrive.brick import Brick, open_brick
from nxtdrive.mission import setup
from nxtdrive.mission.body import MissionClock


def run_mission(
    mission: str | Path | None = None,
    *,
    nxt: str = "sim://",
    camera: str | None = None,
    observers: Iterable[Observer] = (),
) -> Report:
    """Run a mission and return what came of it; motors are off afterwards.

    ::

        report = nxtdrive.run_mission("cat.toml", nxt="usb://", camera="0")
        print(report.ending, [(each.target, each.outcome) for each in report.targets])

    Nothing is printed or recorded; `nxtdrive run` does both.

    Args:
        mission: The mission file; by default the built-in mission.
        nxt: The brick's address; by default a simulated one in the bundled world.
        camera: As for `nxtdrive.vision.sources.open_camera`; by default the simulated robot's own, else webcam 0.
        observers: Called with each record of the journal.

    Raises:
        ConfigError: The mission file has mistakes; the message lists all of them.
        BrickNotFound: No brick there.
        LinkError: A brick, but no link to it.
        CameraError: The camera cannot be opened.
    """
    loaded = setup.load(None if mission is None else Path(mission))
    with ExitStack() as stack:
        brick = stack.enter_context(open_brick(nxt))
        reconnect_in_background(brick)
        source = camera or setup.default_camera(brick)
        frames = stack.enter_context(closing(setup.open_mission_camera(source, brick)))
        eyes, body = setup.camera_eyes(frames, loaded), setup.build_body(brick, loaded)
        guarded = Observers()
        for number, observer in enumerate(observers, 1):
            guarded.add(f"observer {number}", observer)
        return Executive(loaded, body, eyes, MissionClock(brick), guarded).run()


def reconnect_in_background(brick: Brick) -> None:
    """Reopen a lost link in the background; requests fail at once, and the suspended mission does the waiting.

    A simulated link opened by its address is never lost, and probing it would shift the simulation by milliseconds.
    """
    brick.link.reconnect_timeout_s = 0.0
    brick.link.reconnecting = not brick.link.transport.simulated
