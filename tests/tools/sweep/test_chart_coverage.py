"""How much of the chart the missions of a sweep took."""

from random_ports import RandomPorts, two_targets
from sweep_results import broken_result, mission_result

from behaviors.diagram import arrows
from behaviors.executive import Executive
from behaviors.journal import Record, RecordKind
from behaviors.ports import Ports
from nxtdrive.tools.sweep.chart_coverage import coverage_words, never, taken
from nxtdrive.tools.sweep.mission_result import MissionResult


def _result(seed: int) -> MissionResult:
    records: list[Record] = []
    ports = RandomPorts(seed)
    Executive(two_targets(time_limit_s=10.0), Ports(ports, ports, ports), [records.append]).run()
    return mission_result(transitions=taken(records))


def test_transitions_of_all_missions_count_and_the_others_are_named():
    first, second = _result(2), _result(4)
    missing, number = never([first, second])
    assert number == len({(each.source, each.event or each.target) for each in arrows()})
    assert "idle: start" in first.transitions
    assert not {*missing} & {*first.transitions, *second.transitions}
    assert number == len(missing) + len({*first.transitions, *second.transitions})
    assert coverage_words([first, second]).startswith(f"chart: {number - len(missing)} of {number} transitions taken")
    assert "clear: trip" in coverage_words([first, second])


def test_a_journal_that_the_chart_did_not_write_is_left_out():
    baseline = Record(
        1.0, RecordKind.TRANSITION, "search", "a", {"source": "arrive", "to": "reached", "event": "arrived"}
    )
    assert taken([baseline]) == []
    assert coverage_words([mission_result(transitions=[]), broken_result()]) == ""
