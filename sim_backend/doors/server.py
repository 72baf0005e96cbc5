"""The simulation in real time: simulated time follows the wall clock, and telegrams pass through doors.

When the computer is too slow, simulated time falls behind and stays behind: catching up would only make the next turn
later still. How fast it went is reported instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim_backend.doors.switchboard import Switchboard

PASS_S = 0.001
"""The brick's own pass: nothing in the simulation is finer (docs/firmware.md section 10)."""

QUIET_PASS_S = 0.01
"""Turns are this long while nobody talks to the brick; whatever arrives ends them at once."""

TALK_MS = 200
"""For so long after a telegram the brick may still have to answer."""

EARLY_MS = 0.01
"""A pass may begin this much too early; waiting for so little would only spin."""

LONGEST_STEP_MS = 20
"""Most simulated time between two looks at the door."""

LATE_LIMIT_MS = 100
"""Delay that is made up for; what goes beyond it is lost."""

REPORT_EVERY_S = 1.0


class Simulation(Protocol):
    """What the loop needs of the simulation."""

    @property
    def now_ms(self) -> int:
        """Simulated time."""

    def advance(self, duration_ms: int) -> None:
        """Let simulated time pass."""

    def camera_frame(self) -> NDArray[np.uint8] | None:
        """What the robot's camera sees now; None while it is unplugged."""


class CameraDoor(Protocol):
    """Where other programs see what the robot sees."""

    @property
    def watched(self) -> bool:
        """Whether somebody looks."""

    def show(self, image: NDArray[np.uint8]) -> None:
        """Show the next picture."""


@dataclass(frozen=True, slots=True)
class Status:
    """How the last second of serving went.

    Attributes:
        simulated_s: Simulated time.
        telegrams: Telegrams received, in all.
        telegrams_per_s: Of late.
        clients: Programs that are connected.
        frames_per_s: Camera frames of late; 0 while nobody watches.
        real_time_factor: Simulated time per wall time of late; below 1 the computer is too slow.
    """

    simulated_s: float
    telegrams: int
    telegrams_per_s: float
    clients: int
    frames_per_s: float
    real_time_factor: float


@dataclass(slots=True)
class _Counts:
    """What has been counted up to a moment."""

    wall_s: float
    simulated_ms: int
    telegrams: int = 0
    frames: int = 0


class RealTimeServer:
    """Lets one simulation run in real time behind its doors.

    A door never answers sooner than the next pass of the brick, one millisecond after the question, on average: a
    program that polls an I2C sensor thirty times without a pause, as nxt-python does, then still finds its answer,
    which takes the brick some 5 ms.
    """

    def __init__(
        self,
        simulation: Simulation,
        switchboard: Switchboard,
        camera: CameraDoor | None = None,
        *,
        fps: float = 15.0,
        now: Callable[[], float],
        wait: Callable[[list[int], float], object],
    ) -> None:
        """Make the server; `run` starts it.

        Args:
            simulation: What is served.
            switchboard: The doors, and the links to its brick.
            camera: Where programs watch.
            fps: Camera frames per simulated second, while somebody watches.
            now: Seconds of a clock that never goes back.
            wait: Rests so many seconds, or until one of the files can be read.
        """
        self._simulation, self._switchboard, self._camera = simulation, switchboard, camera
        self._frame_ms = 1000 / fps
        self._now, self._wait = now, wait
        start_ms = simulation.now_ms
        self._origin_s = now() - start_ms / 1000
        self._talk_until_ms = start_ms
        self._next_frame_ms = float(start_ms)
        self._counts = _Counts(now(), start_ms)
        self._reported = _Counts(now(), start_ms)

    def run(self, stopped: Callable[[], bool], report: Callable[[Status], None]) -> None:
        """Serve until `stopped` says so; `report` hears of it about once a second."""
        while not stopped():
            self.turn()
            if self._now() - self._reported.wall_s >= REPORT_EVERY_S:
                report(self.status())
            self._wait(self._switchboard.files(), self._until_next_turn_s())

    def turn(self) -> None:
        """Let the time pass that has passed, take what has arrived, hand out what is ready."""
        self._advance()
        if self._switchboard.take():
            self._talk_until_ms = self._simulation.now_ms + TALK_MS
        self._switchboard.hand_out()
        self._film()

    def status(self) -> Status:
        """How it went since the last call."""
        counts, last = self._counts, self._reported
        counts.wall_s, counts.simulated_ms = self._now(), self._simulation.now_ms
        counts.telegrams = self._switchboard.telegrams
        passed_s = max(counts.wall_s - last.wall_s, PASS_S)
        self._reported = replace(counts)
        return Status(
            simulated_s=counts.simulated_ms / 1000,
            telegrams=counts.telegrams,
            telegrams_per_s=(counts.telegrams - last.telegrams) / passed_s,
            clients=self._switchboard.clients,
            frames_per_s=(counts.frames - last.frames) / passed_s,
            real_time_factor=(counts.simulated_ms - last.simulated_ms) / 1000 / passed_s,
        )

    def _advance(self) -> None:
        behind_ms = self._behind_ms()
        if behind_ms > LATE_LIMIT_MS:
            self._origin_s += (behind_ms - LATE_LIMIT_MS) / 1000
        self._simulation.advance(min(max(0, int(behind_ms + EARLY_MS)), LONGEST_STEP_MS))

    def _film(self) -> None:
        now_ms = self._simulation.now_ms
        if self._camera is None or now_ms < self._next_frame_ms or not self._camera.watched:
            return
        # frames that came due unseen are skipped, the rhythm stays
        self._next_frame_ms += self._frame_ms * (1 + (now_ms - self._next_frame_ms) // self._frame_ms)
        if (image := self._simulation.camera_frame()) is not None:
            self._camera.show(image)
            self._counts.frames += 1

    def _behind_ms(self) -> float:
        return (self._now() - self._origin_s) * 1000 - self._simulation.now_ms

    def _until_next_turn_s(self) -> float:
        pass_s = PASS_S if self._simulation.now_ms < self._talk_until_ms else QUIET_PASS_S
        return max(0.0, pass_s - self._behind_ms() / 1000)
