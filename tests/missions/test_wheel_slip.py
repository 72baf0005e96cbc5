"""Missions while a wheel slips: it is noticed and named, and the robot still knows where it is."""

from __future__ import annotations

import pytest

from behaviors.executive import Ending
from behaviors.journal import RecordKind
from sim_backend.world.event_tables import Event
from sim_backend.world.loading import load_world
from sim_backend.world.world_file import WorldFile


def slipping(wheel: str, slip_percent: float, world: str = "arena") -> WorldFile:
    """A world in which a wheel slips from the seventh second to the end of the mission's first minute."""
    event = {"name": "it", "when": {"at_s": 7}, "stays_s": 50, "wheel": wheel, "slip_percent": slip_percent}
    return load_world(world).model_copy(update={"events": (Event.model_validate(event),)})


@pytest.mark.parametrize("wheel", ["left", "right"])
@pytest.mark.parametrize(
    ("slip_percent", "geometric"),
    [(25, True), (60, True), pytest.param(60, False, marks=pytest.mark.nightly)],
)
def test_a_wheel_that_slips_is_named_and_the_mission_succeeds(perform, mission_for, wheel, slip_percent, geometric):
    mission = mission_for("lena", "rilakkuma", profile="adaptive")
    done = perform(slipping(wheel, slip_percent), mission, geometric=geometric)
    slips = done.of(RecordKind.TRANSITION, event="wheel_slips")
    assert slips
    assert {record.data["evidence"]["wheel"] for record in slips} == {wheel}
    assert slips[0].time_s > 7.0
    assert done.report.ending is Ending.ACHIEVED
