"""Searches, directions, phases and results of pushes, without a robot."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.push.results import document, table
from pdhocbf_drake.studies.shared import push_search
from pdhocbf_drake.studies.shared.cases import CASES, DCBF, NONE, PERIODIC, in_case, lent_barriers
from pdhocbf_drake.studies.shared.endings import soles_overlap
from pdhocbf_drake.studies.shared.events import force, parse_directions, parse_phases
from pdhocbf_drake.studies.shared.push_search import Impulse, Search, Settings, largest_survived, search_all

HALVES = np.array([[0.1, 0.06], [0.1, 0.06]])


@settings(max_examples=200, deadline=None)
@given(st.floats(0.0, 70.0), st.floats(0.1, 60.0), st.sampled_from([0.25, 0.5, 1.0, 2.0]))
def test_bisection_finds_the_last_survived_multiple_from_any_guess(edge: float, guess: float, tolerance: float) -> None:
    tried = []

    def survives(impulse: float) -> bool:
        tried.append(impulse)
        return impulse <= edge

    found = largest_survived(survives, guess, tolerance, 60.0)
    assert found <= max(edge, 0.0)
    assert found + tolerance > min(edge, 60.0)
    assert len(tried) == len(set(tried)), "no impulse is tried twice"
    assert all(0.0 < impulse <= 60.0 for impulse in tried)


def test_a_good_guess_needs_two_trials() -> None:
    tried: list[float] = []
    assert largest_survived(lambda j: tried.append(j) or j <= 15.0, 15.0, 1.0, 60.0) == 15.0  # type: ignore[func-returns-value]
    assert tried == [15.0, 16.0]


def test_searches_begin_where_a_mirrored_one_or_one_without_barriers_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each is made once; only those in the first step of the gait, or with nothing to begin from, guess by the mass."""
    made: list[Search] = []

    def search(work: Search) -> Impulse:
        made.append(work)
        return Impulse(work.barrier, work.direction, work.phase, 100.0 * len(made))

    monkeypatch.setattr(push_search, "search", search)
    scenario = load_scenario("walking", "")
    directions, phases = ("+x", "+y", "-y"), (0, 10, 40, 60)
    settings = Settings(1.0, 0.1, 3.2)
    found = {i[:3]: i.survived for many in search_all(scenario, CASES, directions, phases, settings, 1) for i in many}
    assert len(made) == len(found) == len(CASES) * len(directions) * len(phases)
    guesses = {(work.barrier, work.direction, work.phase): work.guess for work in made}
    likely = {"+x": 16.0, "+y": 8.0, "-y": 8.0}
    for (barrier, way, phase), guess in guesses.items():
        if barrier != NONE:
            assert guess == found[NONE, way, phase]
        elif phase == 40:
            assert guess == found[NONE, {"+x": "+x", "+y": "-y", "-y": "+y"}[way], 0]
        else:
            assert guess == likely[way]
    alone = [i for many in search_all(scenario, [DCBF], ["-y"], [0, 40], settings, 1) for i in many]
    assert len(alone) == 2


def test_directions_have_words_and_names() -> None:
    assert parse_directions("forward,-x, left") == ["+x", "-x", "+y"]
    with pytest.raises(InputError, match="forward"):
        parse_directions("up")
    with pytest.raises(InputError, match="--directions"):
        parse_directions("")


def test_phases_are_a_count_or_a_list() -> None:
    assert parse_phases("8", 80) == [0, 10, 20, 30, 40, 50, 60, 70]
    assert parse_phases("20,5", 80) == [5, 20]
    for wrong in ("0", "81", "0,80", "x", "-1,2"):
        with pytest.raises(InputError, match="--phases"):
            parse_phases(wrong, 80)


def test_force_times_duration_is_the_impulse() -> None:
    np.testing.assert_allclose(force("-y", 8.0, 0.1), [0.0, -80.0, 0.0])
    np.testing.assert_allclose(force("+x", 3.0, 0.2), [15.0, 0.0, 0.0])


def test_soles_overlap_where_they_share_ground() -> None:
    def poses(x: float, y: float, yaw: float = 0.0) -> np.ndarray:
        return np.array([[0.0, y, 0.0], [x, 0.0, yaw]])

    assert soles_overlap(poses(0.0, 0.119), HALVES)
    assert not soles_overlap(poses(0.0, 0.121), HALVES)
    assert not soles_overlap(poses(0.21, 0.0), HALVES)
    # A toe that is turned in reaches over.
    assert soles_overlap(poses(0.0, 0.14, 0.5), HALVES)
    assert not soles_overlap(poses(0.0, -0.13), HALVES)


def test_results_have_the_promised_shape() -> None:
    impulses = [Impulse(NONE, "+x", 0, 14.0), Impulse(NONE, "+x", 10, 17.0), Impulse(DCBF, "+x", 0, 13.0)]
    plain = json.loads(json.dumps(document(impulses)))
    assert plain["median"] == {"none": {"+x": 15.5}, "DCBF": {"+x": 13.0}}
    assert plain["impulse"][0] == {"barrier": "none", "direction": "+x", "phase": 0, "survived": 14.0, "unit": "N s"}
    assert "15.5" in table(impulses)


def test_cases_differ_in_their_barriers_alone() -> None:
    scenario = load_scenario("walking", "")
    kinds = {name: [b.bound.kind for b in in_case(scenario, name).barriers.values()] for name in CASES}
    assert kinds == {NONE: [], DCBF: ["orbit_peak"], PERIODIC: ["orbit"]}
    for name in CASES:
        assert in_case(scenario, name).model_copy(update={"barriers": scenario.barriers}) == scenario
    with pytest.raises(InputError, match="P-DHOCBF"):
        in_case(scenario, "CBF")


def test_a_constant_bound_clears_a_harmonic_and_a_tabulated_one() -> None:
    bound = "barriers: {forward_speed: {bound: {kind: %s}}}"
    harmonic = load_scenario("walking", bound % "harmonic, mean: 0.4, cosine: 0.03, sine: 0.04")
    assert in_case(harmonic, DCBF).barriers["forward_speed"].bound.value == pytest.approx(0.45)
    tabulated = load_scenario("walking", bound % "tabulated, values: [0.4, 0.5, 0.3]")
    assert in_case(tabulated, DCBF).barriers["forward_speed"].bound.value == 0.5


def test_gamma_is_replaced_in_every_barrier() -> None:
    changed = in_case(load_scenario("walking", ""), PERIODIC, 0.2)
    assert [barrier.gamma for barrier in changed.barriers.values()] == [(0.2, 0.2)]


def test_the_source_of_lent_barriers_is_stated() -> None:
    assert lent_barriers(load_scenario("walking", "")) == ""
    sentence = lent_barriers(load_scenario("walking_nobarrier", ""))
    (bound,) = [config.bound for config in in_case(load_scenario("walking_nobarrier", ""), PERIODIC).barriers.values()]
    assert sentence.startswith("walking_nobarrier has no barrier")
    assert f"{bound.margin:g} m/s" in sentence
