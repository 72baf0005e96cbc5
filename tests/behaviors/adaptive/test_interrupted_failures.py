"""A failure that waits for new evidence outlasts an outage."""

from __future__ import annotations

import pytest
from staged_ports import Stage, adaptive_profile

from behaviors.events import Event, Reason
from behaviors.evidence import Evidence
from behaviors.ports import CameraLost
from behaviors.profiles.adaptive import MIN_INTERVAL_S
from behaviors.recoveries import WAIT, Choice

WAIT_S = 0.3


def test_a_failure_is_reported_after_an_outage_as_it_was():
    stage = Stage([(60.0, 0.0, None, 300.0)], blind_s=(WAIT_S + 0.2, WAIT_S + 0.3))
    profile = adaptive_profile(stage)
    profile.select(Evidence("a", Reason.NEVER_SEEN, seen_since_search=False, researches=0))
    skill = profile.skill("wait", Choice(WAIT, "something blocks the path", wait_s=WAIT_S))
    with pytest.raises(CameraLost):
        skill.call()
    fact = skill.call()
    assert fact.event is Event.RECOVERY_FAILED
    assert fact.measured["waited_s"] == pytest.approx(WAIT_S, abs=0.05)
    assert stage.now() >= MIN_INTERVAL_S, "it has gone on waiting for new evidence"
