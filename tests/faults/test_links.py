"""The campaign of link faults: a sample of it, and proof that it finds violations."""

from __future__ import annotations

import pytest

from behaviors.executive import Ending
from firmware_protocol.direct import GetInputValues, SetOutputState
from firmware_protocol.enums import InputPort, OutputMode, OutputPort, RegulationMode, RunState
from nxtdrive.tools.dev.faults import links
from nxtdrive.tools.dev.faults.link_missions import run_mission
from nxtdrive.tools.dev.faults.wire import FOR_GOOD, REFUSED, STREAM, TRANSPORTS, USB, Exchange, Fault, Wire

TRIALS = range(0, links.CAMPAIGN.count, 997)
MISSION = links.MISSION_EVERY - 1


@pytest.mark.parametrize("numbers", [TRIALS, range(MISSION, MISSION + 1)], ids=["programs", "a mission"])
def test_a_sample(numbers):
    tally = links.CAMPAIGN.run(1, numbers)
    assert tally.violations == []


def test_equal_seeds_give_equal_trials_and_others_do_not():
    one, again, other = (links.CAMPAIGN.run(seed, range(41, 56)).outcomes for seed in (1, 1, 2))
    assert one == again
    assert one != other


@pytest.mark.parametrize("transport", TRANSPORTS)
def test_without_a_fault_nothing_is_wrong(transport):
    outcome, wrong = links.run_program(links.PROGRAMS["sensors"], Wire(links.new_simulation(), transport, None))
    assert (outcome, wrong) == ("no error", [])


def _run_without_lease(trial):
    trial.brick.request(
        SetOutputState(OutputPort.A, 60, OutputMode.MOTOR_ON, RegulationMode.IDLE, 0, RunState.RUNNING, 0)
    )
    trial.brick.sleep(1)


def test_a_motor_that_turns_on_after_a_loss_is_found():
    wire = Wire(links.new_simulation(), USB, Fault(FOR_GOOD, 1))
    _, wrong = links.run_program([_run_without_lease, lambda trial: trial.brick.battery_v], wire)
    assert any("motor A turned by" in each for each in wrong)
    assert any("motor A turns" in each for each in wrong)


def test_a_value_that_answers_another_question_is_found():
    wire = Wire(links.new_simulation(), STREAM, None)

    def swap(trial):
        wire.exchanges = _Forgetful()
        trial.brick.request(GetInputValues(InputPort.IN_1))

    _, wrong = links.run_program([swap], wire)
    assert any("which the brick did not send for it" in each for each in wrong)


class _Forgetful(list):
    """Exchanges of another question than was asked."""

    def append(self, exchange):
        super().append(Exchange(exchange.time_ms, GetInputValues(InputPort.IN_2).encode(), exchange.reply))


@pytest.mark.parametrize("profile", ["thesis", "adaptive"])
def test_a_mission_outlasts_a_brick_that_refuses_a_request(profile):
    assert run_mission(profile, USB, Fault(REFUSED, 400)) == (Ending.ACHIEVED, [])
