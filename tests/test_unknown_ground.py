"""The rows of the study of ground that is on no map: their walks, and what falls are put down to."""

from __future__ import annotations

import pytest

from pdhocbf_drake.simulation.checks import check_scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.ground.command import STUDY
from pdhocbf_drake.studies.ground.table import TABLE
from pdhocbf_drake.studies.ground.unknown import ROWS, scenario_of

WALKING = load_scenario("walking")


@pytest.mark.parametrize("row", ROWS)
def test_the_walks_of_a_row_differ_and_none_is_on_the_map(row: str) -> None:
    assert row in TABLE.kinds
    works = STUDY.plan(WALKING, [row])
    assert len(works) == (30 if ROWS[row].walks == "draws" else 8)
    scenarios = [scenario_of(work) for work in works]
    assert len({scenario.ground for scenario in scenarios}) == len(works)
    for scenario in scenarios:
        check_scenario(scenario)
        (piece,) = scenario.ground
        assert not piece.known
        speed = scenario.gait.stride / (scenario.gait.ticks_per_step * scenario.gait.tick)
        assert scenario.duration * speed > piece.span()[0] + ROWS[row].length
        assert (scenario.measurement.source == "sensors") == ROWS[row].sensed


def test_the_same_seed_draws_the_same_ground_and_another_one_another() -> None:
    one, again, other = (scenario_of(STUDY.plan(WALKING, ["tiles 0.01"], seed=seed)[3]).ground for seed in (1, 1, 2))
    assert one == again
    assert one != other
