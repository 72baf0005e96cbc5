"""The table of docs/reality.md: what each effect costs each profile, in pairs of missions in the same room."""

import pytest

from nxtdrive.tools.dev.reality_table import rows


def line(kind, seed, agent, *reached):
    targets = [
        {"reachable": True, "success": each, "wrong_stops": 0, "spl": 0, "soft_spl": 0, "sct": 0} for each in reached
    ]
    return {
        "class": kind,
        "seed": seed,
        "policy": agent,
        "ending": "achieved",
        "success": all(reached),
        "contacts": 2,
        "duration_s": 10.0,
        "targets": targets,
    }


def cells(lines):
    head, _, *body = (row.strip("| ").split(" | ") for row in rows(lines))
    return head, {cells[0]: cells for cells in body}


def test_an_effect_costs_what_the_same_rooms_lost():
    lines = [line("plain", seed, "thesis", True, True) for seed in (1, 2, 3)]
    lines += [line("lens", seed, "thesis", True, False) for seed in (1, 2)]
    head, body = cells(lines)
    assert head == ["class", "seeds", "thesis", "wrong stops, contacts, seconds"]
    assert body["`lens`"] == ["`lens`", "2", "0.50, -0.50 [-0.50, -0.50]", "0.0, 2.0, 10"]
    assert body["`plain`"][1:3] == ["3", "1.00 [0.44, 1.00]"]


@pytest.mark.parametrize("kind", ["before", "plain"])
def test_a_class_with_rooms_of_its_own_has_no_cost(kind):
    _, body = cells([line("plain", 1, "thesis", True, True), line(kind, 1, "thesis", True, False)])
    assert ", -" not in body[f"`{kind}`"][2]


def test_a_profile_without_missions_leaves_its_cells_empty():
    _, body = cells(
        [line("plain", 1, "thesis", True), line("plain", 1, "oracle", True), line("lens", 1, "thesis", True)]
    )
    assert "oracle" not in body["`lens`"]
