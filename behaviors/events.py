"""The facts that drive the chart, and their reasons.

Events are facts about the world ("the target was seen"), never commands. The chart's library silently ignores events
that it does not know, so they are sent only as members of `Event`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum


class Event(StrEnum):
    """Everything the chart reacts to."""

    START = "start"
    TARGET_SEEN = "target_seen"
    SEARCH_FAILED = "search_failed"
    CONTINUED = "continued"
    DOUBTED = "doubted"
    MOVED_OFF = "moved_off"
    ARRIVED = "arrived"
    ARRIVE_FAILED = "arrive_failed"
    MISTAKEN = "mistaken"
    BACKING_OFF = "backing_off"
    RETREATED = "retreated"
    REPLANNED = "replanned"
    RECOVERY_DONE = "recovery_done"
    RECOVERY_FAILED = "recovery_failed"
    OBSTACLE = "obstacle"
    CONTACT = "contact"
    OBSTACLE_GONE = "obstacle_gone"
    LINK_LOST = "link_lost"
    LINK_BACK = "link_back"
    CAMERA_LOST = "camera_lost"
    CAMERA_BACK = "camera_back"
    SENSOR_LOST = "sensor_lost"
    SENSOR_BACK = "sensor_back"
    MAP_DISTRUSTED = "map_distrusted"
    MAP_TRUSTED = "map_trusted"
    MAP_CLEARED = "map_cleared"
    TURNS_CORRECTED = "turns_corrected"
    WHEEL_SLIPS = "wheel_slips"
    WHEEL_GRIPS = "wheel_grips"
    TRIP = "trip"
    SUSPEND = "suspend"
    RESUME = "resume"
    ABORT = "abort"


FAILURES = (Event.SEARCH_FAILED, Event.ARRIVE_FAILED, Event.MISTAKEN, Event.RECOVERY_FAILED)
"""Events with which a skill fails, so that a recovery is chosen."""
RESULTS = (Event.TARGET_SEEN, Event.ARRIVED, Event.RECOVERY_DONE, *FAILURES)
"""Events with which a skill ends."""


class Reason(StrEnum):
    """Why something happened: every failure has a name."""

    MISSION_STARTED = "mission_started"
    SIGHTED = "sighted"
    FULL_TURN_WITHOUT_SIGHTING = "full_turn_without_sighting"
    DRIVING_ON = "driving_on"
    DOUBTFUL = "doubtful"
    OUT_OF_REACH = "out_of_reach"
    WITHIN_REACH = "within_reach"
    TARGET_LOST = "target_lost"
    APPROACH_TIMEOUT = "approach_timeout"
    WAITED = "waited"
    MOVED = "moved"
    OBSTACLE_AHEAD = "obstacle_ahead"
    WAY_CLEAR = "way_clear"
    CONTACT = "contact"
    STALLED = "stalled"
    RETREATED = "retreated"
    PATH_RENEWED = "path_renewed"
    WALLED_IN = "walled_in"
    HEARD_TWICE = "heard_twice"
    FRAMES_TURNED = "frames_turned"
    DISTRUST_OVER = "distrust_over"
    LINK_LOST = "link_lost"
    LINK_BACK = "link_back"
    CAMERA_LOST = "camera_lost"
    CAMERA_BACK = "camera_back"
    SENSOR_LOST = "sensor_lost"
    SENSOR_BACK = "sensor_back"
    OPERATOR_STOP = "operator_stop"
    OPERATOR_PAUSE = "operator_pause"
    OPERATOR_RESUME = "operator_resume"
    TIME_UP = "time_up"
    WRONG_WIRING = "wrong_wiring"
    NEVER_SEEN = "never_seen"
    LOST_BEHIND = "lost_behind"
    BLOCKED_SHORT = "blocked_short"
    BLOCKED_LONG = "blocked_long"
    NO_PROGRESS = "no_progress"
    SLIPPED = "slipped"
    WRONG_TARGET = "wrong_target"
    RANGE_MISMATCH = "range_mismatch"
    UNCERTAIN = "uncertain"
    NO_WAY = "no_way"
    THERE = "there"


Measured = Mapping[str, object]
"""What was measured, as plain values for the journal, where they stand as a transition's `evidence`."""


@dataclass(frozen=True, slots=True)
class Fact:
    """What is reported to the chart: an event with its reason and what was measured.

    Attributes:
        event: What happened.
        reason: Why.
        measured: The measurements behind it; they go to the journal and nowhere else.
    """

    event: Event
    reason: Reason
    measured: Measured = field(default_factory=dict)
