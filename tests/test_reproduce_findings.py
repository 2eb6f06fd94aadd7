"""The reproduction's findings follow the outcomes beside them, whatever these are."""

from __future__ import annotations

import re

import numpy as np
import pytest

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce import lemma_2, literal, sensitivity
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.stability import VARIANTS, Attempt
from pdhocbf_drake.studies.reproduce.unsafe_findings import acts_first, conclusions, finding
from pdhocbf_drake.studies.shared.cases import DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.measures import Outcome, Record

NOMINAL = np.array([0.3, 0.4, 0.5, 0.4])
NEVER = float("nan")


def _outcome(notices: float, acts: float, recovers: float = 0.0, excess: float = 0.02, bound: float = 0.45) -> Outcome:
    """Four ticks of a made-up walk that stands still under a constant bound."""
    record = Record(
        0, np.zeros((4, 2, 3)), np.zeros((4, 2)), np.full((4, 1), bound), np.zeros(4), np.ones(4, dtype=bool)
    )
    return Outcome(record, notices, acts, excess, recovers)


def _kicks(constant: Outcome, periodic: Outcome, free: Outcome) -> dict[float, dict[str, list[Outcome]]]:
    return {0.02: {DCBF: 2 * [constant], PERIODIC: 2 * [periodic], NONE: 2 * [free]}}


def _event(constant: Outcome, periodic: Outcome, free: Outcome) -> dict[float, dict[str, Outcome]]:
    return {0.2: {DCBF: constant, PERIODIC: periodic, NONE: free}}


def test_who_acts_before_the_bound_is_crossed():
    assert acts_first(_outcome(3, 2))
    assert acts_first(_outcome(NEVER, 0))
    assert not acts_first(_outcome(2, 2))
    assert not acts_first(_outcome(2, 3))
    assert not acts_first(_outcome(2, NEVER))
    assert not acts_first(_outcome(NEVER, NEVER))


def test_fig_7_says_which_barrier_was_better_by_the_outcomes():
    better, worse, free = _outcome(0, NEVER, 1.0, 0.02), _outcome(5, 3, 9.0, 0.03), _outcome(NEVER, NEVER, 5.0, 0.04)
    for constant, periodic in ((better, worse), (worse, better)):
        kicks, event = _kicks(constant, periodic, free), _event(constant, periodic, free)
        noticed = {case: 2 * (o is better) for case, o in (("c", constant), ("p", periodic))}
        acts = {case: int(o is worse) for case, o in (("c", constant), ("p", periodic))}
        said = finding(kicks, event, event)
        assert f"notices {noticed['p']} of 2 kicks at once, the constant one {noticed['c']}." in said
        assert f"crossed in {acts['p']}, the constant one in {acts['c']}." in said
        text = "\n".join(conclusions(kicks, event, NOMINAL))
        assert ("it can brake hard" in text) == (constant is worse)
        assert f"at {2 * (constant is worse)} of 2 phases" in text
        assert f"{periodic.recovers:.0f} ticks against {constant.recovers:.0f} (DCBF) and 5 (none)" in text


def test_how_tight_a_constant_bound_can_be_is_read_off_the_walk():
    for bound, words in ((0.45, "below the walk's own peak of 0.500 m/s: a constant bound cannot"),
                         (0.55, "not below the walk's own peak of 0.500 m/s: a constant bound could")):  # fmt: skip
        one = _outcome(0, 0, bound=bound)
        assert words in "\n".join(conclusions(_kicks(one, one, one), _event(one, one, one), NOMINAL))


def test_lemma_2_states_the_effect_of_the_rows():
    walks = Attempt(3, Reason.SOLVED, np.zeros(3))
    other = Attempt(3, Reason.SOLVED, np.full(3, 0.004))
    stuck = Attempt(1, Reason.INFEASIBLE, np.zeros(1))
    same = {name: walks for name in VARIANTS}
    assert "walks, with a velocity that differs by 0 mm/s" in lemma_2.finding(same, same)
    changed = same | {"(33) and (34), matching": other}
    lost = same | {"(33) and (34), literal": stuck}
    said = lemma_2.finding(lost, changed)
    assert "differs by 4 mm/s" in said
    assert said.endswith("with fixed footholds: no solution after 1 tick.")


def test_the_slips_that_left_no_solution_are_those_that_did():
    said = literal.finding({"one": True, "another": False, "a third": True})
    assert said == "Slips that leave the QP without a solution: one, a third (of one, another, a third)."
    assert "solution: none (" in literal.finding({"one": False})
    assert literal.refusal_of("mpc: {horizon: 60}").startswith("refused: ")
    assert literal.refusal_of("") == "accepted"


@pytest.mark.parametrize(("key", "value", "margin"), [("margin", 0.003, 0.003), ("ticks_per_step", 36, 0.0073)])
def test_settled_walks_lie_on_the_law_of_m(key, value, margin):
    ripple, ratio = sensitivity.measured(load_scenario("paper_vhip").to_dict(), key, value, {})
    assert ratio == pytest.approx(100.0 * margin / (margin + ripple), abs=0.01)


def test_a_compared_walk_says_how_far_and_how_fast_it_went():
    runs = Runs()
    said = literal.walked(runs.run(("walking", "{duration: 5.0}")))
    assert re.match(r"robot, 5 s: 1\.\d\d m of 1\.50 m commanded, 0\.37\d m/s from 2 s on; ", said)
