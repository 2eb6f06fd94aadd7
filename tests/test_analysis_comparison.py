"""Comparison of runs: the margins (5), their ratio (6), refused runs, and figures."""

from __future__ import annotations

import pytest
import synthetic

from pdhocbf_drake.analysis.comparison import compare, comparison_figures
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.run_folder import Run


def run(margin: float, name: str = "forward_speed") -> Run:
    run = synthetic.run("vhip")
    run.log["h"][:] = margin
    run.log["h"][:200] = 100.0  # the start, which does not count
    barriers = {name: next(iter(run.scenario.barriers.values()))}
    return run._replace(scenario=run.scenario.model_copy(update={"barriers": barriers}))


def test_the_ratio_is_first_over_second():
    # The paper's own margins, eqs. (38) and (39).
    (found,) = compare(run(0.0073), run(0.0226), from_time=2.0)
    assert found.margins == pytest.approx((0.0073, 0.0226))
    assert found.ratio == pytest.approx(0.323, abs=5e-4)


def test_the_start_counts_if_it_is_asked_for():
    (found,) = compare(run(0.01), run(0.02), from_time=0.0)
    assert found.margins[0] > 1.0


def test_single_barriers_are_compared_under_any_names():
    (found,) = compare(run(0.01, "periodic"), run(0.02, "constant"), from_time=2.0)
    assert found.names == ("periodic", "constant")
    assert found.ratio == pytest.approx(0.5)


def test_runs_that_cannot_be_compared_are_refused():
    bare = synthetic.run("vhip")
    bare = bare._replace(scenario=bare.scenario.model_copy(update={"barriers": {}}))
    with pytest.raises(InputError, match="share no barrier to compare; they have forward_speed and none"):
        compare(run(0.01), bare, 2.0)
    with pytest.raises(InputError, match=r"the first run has less than a period of 0\.4 s from 9 s on: it ended at 4"):
        compare(run(0.01), run(0.02), 9.0)
    broken = run(0.02)
    broken.log["h"][300] = float("nan")
    with pytest.raises(InputError, match="there can't be compared: h of its barrier forward_speed is no number"):
        compare(run(0.01), broken, 2.0, ("here", "there"))


def test_a_barrier_on_the_lateral_speed_needs_a_whole_gait():
    def lateral(margin: float) -> Run:
        one = run(margin)
        barriers = {name: config.model_copy(update={"axis": "y"}) for name, config in one.scenario.barriers.items()}
        return one._replace(scenario=one.scenario.model_copy(update={"barriers": barriers}))

    assert compare(run(0.01), run(0.02), 3.5)
    assert compare(lateral(0.01), lateral(0.02), 3.2)
    with pytest.raises(InputError, match=r"the first run has less than a period of 0\.8 s from 3\.5 s on"):
        compare(lateral(0.01), lateral(0.02), 3.5)


def test_comparison_figures_are_for_several_walks():
    assert [drawn.name for drawn in comparison_figures([run(0.01), run(0.02)])] == ["velocities", "margins"]
    assert comparison_figures([run(0.01)]) == []
