"""What the strip under a replay plots: every violation, however long the run, and each quantity beside its bound."""

from __future__ import annotations

import numpy as np
import pytest
import synthetic

from pdhocbf_drake.analysis.replay_strip import plots_of, strip
from pdhocbf_drake.simulation.run_folder import Run


@pytest.mark.parametrize("row", [7, 1234, 5999])
def test_a_long_run_keeps_its_worst_tick(row: int) -> None:
    run = synthetic.run("vhip", 60.0)
    run.log["h"][row] = -0.5
    (plot,) = plots_of(run).values()
    values = plot["parts"][-1]["curves"][0]["values"]
    assert len(values) <= 1500
    assert min(values) == -0.5
    assert plot["time"][int(np.argmin(values))] == pytest.approx(run.log.time[row])
    assert np.all(np.diff(plot["time"]) > 0)


def test_h_is_the_bound_less_the_quantity() -> None:
    run = synthetic.run("biped", 3.0)
    (plot,) = plots_of(run).values()
    (bound, value), (h,) = ([np.array(c["values"]) for c in part["curves"]] for part in plot["parts"])
    assert len(h) == len(run.log.time)
    assert h == pytest.approx(bound - value, abs=1e-4)


def test_without_a_barrier_the_speed_is_plotted() -> None:
    run = synthetic.run("vhip", 3.0)
    bare = run.scenario.model_copy(update={"barriers": {}})
    (plot,) = plots_of(Run(bare, run.log, run.provenance)).values()
    assert plot["parts"][0]["curves"][0]["values"] == pytest.approx(run.log.element("lip_state", "vx"), abs=1e-4)


def test_the_oscillator_has_one_plot_a_barrier() -> None:
    assert list(plots_of(synthetic.run("van_der_pol", 3.0))) == ["x1_upper", "x1_lower", "x2_upper", "x2_lower"]


def test_pushes_are_marked_only_where_there_are_some() -> None:
    run = synthetic.run("vhip", 3.0)
    pushed = synthetic.pushed(run, {"time": 2.5, "force": [40, 0, 0]})
    assert '"pushes"' not in strip(run)
    assert '"pushes": [[2.5, 2.6]]' in strip(pushed)


def test_names_are_text() -> None:
    run = synthetic.run("vhip", 3.0)
    (config,) = run.scenario.barriers.values()
    named = run.scenario.model_copy(update={"barriers": {"</script><b>": config}})
    assert "</script><b>" not in strip(Run(named, run.log, run.provenance))
