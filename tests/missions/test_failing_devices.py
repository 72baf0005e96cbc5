"""Devices that fail in the middle of a mission, by events of the world: what the mission does, and says."""

from __future__ import annotations

from behaviors.executive import Ending
from behaviors.journal import RecordKind
from sim_backend.world.event_tables import Event
from sim_backend.world.loading import load_world
from sim_backend.world.world_file import WorldFile

AT_S = 4.0


def failing(**disturbance: object) -> WorldFile:
    """The world "open" with an event in which something fails for good."""
    event = Event.model_validate({"name": "it", "when": {"at_s": AT_S}, **disturbance})
    return load_world("open").model_copy(update={"events": (event,)})


def test_a_bumper_that_sticks_pressed_is_left_out_and_named(perform, mission_for):
    done = perform(failing(sensor=1, fault="pressed"), mission_for("lena", profile="adaptive"), geometric=True)
    [failed] = done.of(RecordKind.SENSOR, sensor="bumper", answers=False)
    assert "Does something jam it" in failed.data["error"]
    assert AT_S < failed.time_s < 30.0
    assert done.report.ending is Ending.ACHIEVED


def test_a_camera_that_a_bump_has_turned_still_finds_the_target(perform, mission_for):
    done = perform(failing(camera=True, yaw_deg=15), mission_for("lena", profile="adaptive"), geometric=True)
    assert done.report.ending is Ending.ACHIEVED
