"""Waiting out an outage of brick, camera or sensors, or an operator's pause, in the same way for every profile.

The robot stands still, the outage is reported, and the failed part is retried until it works or the mission's
``reconnect_timeout_s`` is over. A pause has no limit, and its time counts towards no other limit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TypeVar

from behaviors.events import Event, Fact, Reason
from behaviors.journal import RecordKind
from behaviors.pause import Paused
from behaviors.ports import CameraLost, Outage, RobotUnreachable, SensorLost
from behaviors.skills import SkillContext

T = TypeVar("T")

RETRY_S = 0.5
"""Interval between retries of the failed part."""

NOTE_S = 5.0
"""How often the journal says how much longer an outage may last."""

PARTS: dict[type[Outage], str] = {RobotUnreachable: "link", CameraLost: "camera", SensorLost: "sensor"}
"""What has failed, as the names of events, reasons and endings begin."""


def part_of(outage: Outage) -> str:
    """Return what has failed: ``link``, ``camera`` or ``sensor``."""
    return next(part for kind, part in PARTS.items() if isinstance(outage, kind))


class OutageSupervisor:
    """Waits out outages, and records which sensors fail and return.

    Args:
        context: The robot, its camera, the mission's clock, journal, chart, time limit and pause.
        timeout_s: An outage that lasts longer ends the mission.
    """

    def __init__(self, context: SkillContext, timeout_s: float) -> None:
        self._context = context
        self._body, self._vision, self._clock = context.body, context.vision, context.clock
        self._timeout_s = timeout_s
        self._pause = context.pause
        self._part = ""
        self._begun_s = self._back_s = -math.inf

    @contextmanager
    def recording_sensors(self) -> Iterator[None]:
        """Record which sensors fail and return in the block."""
        unsubscribe = self._body.on_sensor_change(self._sensor_changed)
        try:
            yield
        finally:
            unsubscribe()

    def run(self, work: Callable[[], T]) -> T:
        """Call `work`, and call it again after each outage; it must be able to resume or to start over.

        Raises:
            Outage: It lasted too long.
        """
        while True:
            try:
                return work()
            except Outage as outage:
                self.wait_out(outage)

    def wait_out(self, outage: Outage) -> None:
        """Wait until the failed part works again, or until the pause ends.

        The robot stands still, by its leases if it cannot be reached. A part that fails again within `RETRY_S` of its
        return, such as a brick that refuses one telegram and answers the others, has failed all the time.

        Raises:
            Outage: `outage` itself, since it is the first cause: it lasted too long, or is permanent.
        """
        if isinstance(outage, Paused):
            self._context.report(Fact(Event.SUSPEND, Reason.OPERATOR_PAUSE))
            self._context.report(Fact(Event.RESUME, Reason.OPERATOR_RESUME, {"paused_s": self._hold_still()}))
            return
        part, now_s = part_of(outage), self._clock.now()
        fails_in_use = part == self._part and now_s < self._back_s + RETRY_S
        if not fails_in_use:
            self._part, self._begun_s = part, now_s
        self._context.report(Fact(Event(f"{part}_lost"), Reason(f"{part}_lost"), {"error": str(outage)}))
        slept, noted_s = True, -math.inf
        while not self._works_again(part) or fails_in_use:
            fails_in_use = False
            if self._pause.wanted:
                self._begun_s += self._hold_still()
            self._pause.check_end()
            self._context.check_time()
            now_s = self._clock.now()
            left_s = self._begun_s + self._timeout_s - now_s
            if outage.permanent or left_s <= 0:
                raise outage from None
            if now_s - noted_s >= NOTE_S:
                self._context.note(RecordKind.OUTAGE, part=part, left_s=left_s)
                noted_s = now_s
            try:
                self._clock.sleep(RETRY_S)
                slept = True
            except Outage:
                # the first error may be the notice of the loss; a clock that keeps failing has a link that stays closed
                if not slept:
                    raise outage from None
                slept = False
        self._back_s = self._clock.now()
        silent_s = self._back_s - self._begun_s
        self._context.report(Fact(Event(f"{part}_back"), Reason(f"{part}_back"), {"silent_s": silent_s}))

    def _hold_still(self) -> float:
        """Keep the robot at rest and switched on until the pause ends; return how long that took.

        Raises:
            KeyboardInterrupt: The operator ends the mission instead.
        """
        begun_s = self._clock.now()
        while True:
            with suppress(Outage):  # the leases stop a robot that cannot be reached
                self._body.stop()
                self._body.keep_alive()
            over = self._pause.wait(RETRY_S)
            self._pause.check_end()
            if over:
                paused_s = self._clock.now() - begun_s
                self._context.add_pause(paused_s)
                return paused_s

    def _works_again(self, part: str) -> bool:
        """Stop the robot and retry the failed part."""
        try:
            self._body.stop()
            self._body.battery_mv()  # stopping needs no reply, so a missing one is not its failure
            if part == "camera":
                self._vision.glance(())
            elif part == "sensor":
                self._body.range_mm()
                self._body.touching()
                return self._body.can_drive_forward()
        except Outage:
            return False
        return True

    def _sensor_changed(self, sensor: str, error: str) -> None:
        self._context.note(RecordKind.SENSOR, sensor=sensor, answers=not error, error=error)
