"""The reproduction's statements on the theorem, on Lemma 2 and on unsafe events, in small cases."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce.lemma_2 import FIXED, FREE
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.reproduce.stability import (
    VARIANTS,
    attempt,
    literal,
    literal_terminal,
    matching,
    matching_terminal,
)
from pdhocbf_drake.studies.reproduce.theorem import counterexample, least_of_lemma, least_of_theorem, refusal
from pdhocbf_drake.studies.reproduce.unsafe import SCENARIO
from pdhocbf_drake.studies.reproduce.unsafe_findings import bound, speed
from pdhocbf_drake.studies.shared.cases import CASES, DCBF, NONE, PERIODIC
from pdhocbf_drake.studies.shared.template import Laboratory, settled


@pytest.fixture(scope="module")
def runs():
    return Runs()


@pytest.fixture(scope="module")
def laboratory():
    return Laboratory(load_scenario(*SCENARIO))


def test_lemma_1_fails_for_twice_s_and_says_so():
    b = counterexample(2.0)
    assert b[1] == -b[0]
    assert np.all(np.diff(b) >= -2.0 * b[:-1])
    assert "alpha(s) <= s is needed" in refusal()


@pytest.mark.parametrize("gamma", [0.05, 0.5, 1.0])
def test_the_corrected_statements_hold_on_random_sequences(gamma):
    assert least_of_lemma(gamma) >= 0.0
    assert least_of_theorem(gamma) >= -1e-12


@pytest.mark.parametrize("gamma", [1.2, 2.0])
def test_beyond_the_corrected_hypothesis_they_fail(gamma):
    assert least_of_lemma(gamma) < 0.0
    assert least_of_theorem(gamma) < 0.0


def _angle(first, second):
    one, two = (np.concatenate(row) for row in (first, second))
    cosine = abs(one @ two) / np.linalg.norm(one) / np.linalg.norm(two)
    return float(np.sqrt(max(0.0, 1.0 - cosine**2)))


def test_the_two_rows_of_lemma_2_are_one_when_discretised_to_match_and_two_as_printed(runs):
    setting = runs.walk(FREE).mpc.problems[0].setting
    for phase in (0, 13, 39):
        assert _angle(matching(setting, phase), matching_terminal(setting, phase)) < 1e-7
        assert _angle(literal(setting, phase), literal_terminal(setting, phase)) > 1e-3


def test_printed_together_they_contradict_each_other_where_the_footholds_are_fixed(runs):
    mpc = runs.walk(FIXED).mpc
    memory = settled(mpc, 400)
    assert attempt(mpc, memory, 400, 5, VARIANTS["(33) and (34), matching"]).reason == Reason.SOLVED
    assert attempt(mpc, memory, 400, 5, VARIANTS["(33) and (34), literal"]).planned < 5


def test_without_an_event_nothing_is_noticed_and_nothing_done(laboratory):
    for case in CASES:
        outcome = laboratory.kicked(case, 7, np.zeros((1, 2)), 45)
        assert np.isnan(outcome.notices), case
        assert np.isnan(outcome.acts), case
        assert outcome.recovers == 0.0, case


def test_an_event_leaves_the_settled_walk_as_it_was(laboratory):
    first, second = (laboratory.kicked(NONE, 3, np.array([[0.02, 0.0]]), 5).record for _ in range(2))
    np.testing.assert_array_equal(first.states, second.states)


def test_the_periodic_barrier_notices_a_kick_in_mid_step_that_the_constant_one_misses(laboratory):
    kick = np.array([[0.02, 0.0]])
    constant, periodic, free = (laboratory.kicked(case, 15, kick, 60) for case in (DCBF, PERIODIC, NONE))
    assert periodic.notices == 0.0
    assert np.isnan(constant.notices)
    assert periodic.recovers < constant.recovers <= free.recovers
    assert periodic.excess == pytest.approx(free.excess, abs=1e-3), "no barrier undoes a kick"


def test_a_wrong_speed_command_is_held_at_the_periodic_bound(laboratory):
    held = laboratory.commanded(PERIODIC, 0.17, 1, 120)
    assert (bound(held) - speed(held)).min() > -1e-6
    assert laboratory.commanded(DCBF, 0.17, 1, 120).excess > held.excess + 0.005
