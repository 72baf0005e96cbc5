"""Serve the simulation in real time: simulation time follows the wall clock, and telegrams pass through doors.

On a computer that is too slow, simulation time falls behind and stays behind: catching up would delay the next turn
further. The achieved speed is reported instead.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from sim_backend.doors.switchboard import Switchboard

PASS_S = 0.001
"""The brick's pass, the finest time step of the simulation (docs/firmware.md section 10)."""

QUIET_PASS_S = 0.01
"""Length of turns without telegrams; arriving data ends them at once."""

REPLY_WINDOW_MS = 200
"""Time after a telegram during which the brick may still reply."""

EARLY_MS = 0.01
"""A pass may begin this much early; waiting for less would only spin."""

LONGEST_STEP_MS = 20
"""Maximum simulation time between two polls of the doors."""

LATE_LIMIT_MS = 100
"""Delay that is made up for; any further delay is lost."""

REPORT_EVERY_S = 1.0


log = logging.getLogger(__name__)


class Simulation(Protocol):
    """The part of the simulation that the server uses."""

    @property
    def now_ms(self) -> int:
        """Simulation time."""

    def advance(self, duration_ms: int) -> None:
        """Advance the simulation."""

    def camera_frame(self) -> NDArray[np.uint8] | None:
        """Return the latest frame of the robot's camera; None while it is unplugged."""


class CameraDoor(Protocol):
    """Publishes camera frames to other programs."""

    @property
    def watched(self) -> bool:
        """Whether there is a viewer."""

    def show(self, image: NDArray[np.uint8]) -> None:
        """Publish a frame."""


@dataclass(frozen=True, slots=True)
class Status:
    """Figures of the last second.

    Attributes:
        simulated_s: Simulation time.
        telegrams: Total number of received telegrams.
        telegrams_per_s: Current rate of telegrams.
        clients: Number of connected programs.
        frames_per_s: Current frame rate; 0 without a viewer.
        real_time_factor: Simulation time per wall time; below 1 the computer is too slow.
    """

    simulated_s: float
    telegrams: int
    telegrams_per_s: float
    clients: int
    frames_per_s: float
    real_time_factor: float


@dataclass(slots=True)
class _Counts:
    """Counters at a moment."""

    wall_s: float
    simulated_ms: int
    telegrams: int = 0
    frames: int = 0


class RealTimeServer:
    """Runs one simulation in real time behind its doors.

    A reply never leaves before the brick's next pass, on average one millisecond after the request. A program that
    polls an I2C sensor thirty times without a pause, as nxt-python does, therefore still gets its data, which takes
    the brick about 5 ms.

    A defect of the simulated brick does not end the server: it is logged once per telegram, the telegram is not
    answered, and the simulation continues.

    Attributes:
        failures: How often the brick failed.
    """

    def __init__(
        self,
        simulation: Simulation,
        switchboard: Switchboard,
        cameras: Sequence[CameraDoor] = (),
        *,
        fps: float = 15.0,
        now: Callable[[], float],
        wait: Callable[[list[int], float], object],
    ) -> None:
        """Make the server; `run` starts it.

        Args:
            simulation: The simulation.
            switchboard: The doors, and the links to the brick.
            cameras: Publish camera frames.
            fps: Camera frames per second of simulation time, while there is a viewer.
            now: Returns seconds of a monotonic clock.
            wait: Waits for the given seconds, or until one of the files is readable.
        """
        self._simulation, self._switchboard, self._cameras = simulation, switchboard, cameras
        self._frame_ms = 1000 / fps
        self._now, self._wait = now, wait
        start_ms = simulation.now_ms
        self._origin_s = now() - start_ms / 1000
        self._talk_until_ms = start_ms
        self._next_frame_ms = float(start_ms)
        self._counts = _Counts(now(), start_ms)
        self._reported = _Counts(now(), start_ms)
        self.failures = 0
        self._logged = -1

    def run(self, stopped: Callable[[], bool], report: Callable[[Status], None]) -> None:
        """Serve until `stopped` returns True; call `report` about once a second."""
        while not stopped():
            self.turn()
            if self._now() - self._reported.wall_s >= REPORT_EVERY_S:
                report(self.status())
            self._wait(self._switchboard.files(), self._until_next_turn_s())

    def turn(self) -> None:
        """Run one turn: advance the simulation, accept telegrams, send replies and frames."""
        self._advance()
        if self._switchboard.take():
            self._talk_until_ms = self._simulation.now_ms + REPLY_WINDOW_MS
        self._switchboard.send_replies()
        self._film()

    def status(self) -> Status:
        """Return the figures since the last call."""
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
        try:
            self._simulation.advance(min(max(0, int(behind_ms + EARLY_MS)), LONGEST_STEP_MS))
        except Exception:  # the other programs and the world need the server
            self.failures += 1
            if self._logged != self._switchboard.telegrams:
                self._logged = self._switchboard.telegrams
                log.exception("the simulated brick failed; its last telegram was %s", self._switchboard.last.hex())

    def _film(self) -> None:
        now_ms = self._simulation.now_ms
        watched = [camera for camera in self._cameras if camera.watched] if now_ms >= self._next_frame_ms else []
        if not watched:
            return
        # frames that were due without a viewer are skipped; the rhythm stays
        self._next_frame_ms += self._frame_ms * (1 + (now_ms - self._next_frame_ms) // self._frame_ms)
        if (image := self._simulation.camera_frame()) is not None:
            for camera in watched:
                camera.show(image)
            self._counts.frames += 1

    def _behind_ms(self) -> float:
        return (self._now() - self._origin_s) * 1000 - self._simulation.now_ms

    def _until_next_turn_s(self) -> float:
        pass_s = PASS_S if self._simulation.now_ms < self._talk_until_ms else QUIET_PASS_S
        return max(0.0, pass_s - self._behind_ms() / 1000)
