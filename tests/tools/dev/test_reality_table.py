"""The table of docs/reality.md: what each effect costs each profile, in pairs of missions in the same room."""

import pytest
from sweep_results import mission_result, target_result

from nxtdrive.tools.dev.reality_table import rows


def result(kind, seed, agent, *reached):
    targets = [target_result(9.0 if each else None, target=str(number)) for number, each in enumerate(reached)]
    return mission_result(*targets, kind=kind, seed=seed, agent=agent, contacts=2, duration_s=10.0)


def cells(results):
    head, _, *body = (row.strip("| ").split(" | ") for row in rows(results))
    return head, {cells[0]: cells for cells in body}


def test_an_effect_costs_what_the_same_rooms_lost():
    results = [result("plain", seed, "thesis", True, True) for seed in (1, 2, 3)]
    results += [result("lens", seed, "thesis", True, False) for seed in (1, 2)]
    head, body = cells(results)
    assert head == ["class", "seeds", "thesis", "wrong stops, contacts, seconds"]
    assert body["`lens`"] == ["`lens`", "2", "0.50, -0.50 [-0.50, -0.50]", "0.0, 2.0, 10"]
    assert body["`plain`"][1:3] == ["3", "1.00 [0.44, 1.00]"]


@pytest.mark.parametrize("kind", ["before", "plain"])
def test_a_class_with_rooms_of_its_own_has_no_cost(kind):
    _, body = cells([result("plain", 1, "thesis", True, True), result(kind, 1, "thesis", True, False)])
    assert ", -" not in body[f"`{kind}`"][2]


def test_a_profile_without_missions_leaves_its_cells_empty():
    _, body = cells(
        [result("plain", 1, "thesis", True), result("plain", 1, "oracle", True), result("lens", 1, "thesis", True)]
    )
    assert "oracle" not in body["`lens`"]


def test_without_the_same_rooms_in_plain_the_share_itself_has_the_interval():
    plain = result("plain", 3, "thesis", True)
    _, body = cells([plain, result("lens", 1, "thesis", True), result("lens", 2, "thesis", True)])
    assert body["`lens`"][2] == "1.00 [0.34, 1.00]"
    _, body = cells([plain, result("lens", 1, "thesis", True)])
    assert body["`lens`"][2] == "1.00", "a single mission has no interval"
