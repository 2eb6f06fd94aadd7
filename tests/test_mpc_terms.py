"""The terms of problem (36): what each one promises, and that a term is all that has to be added for one."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
import pytest
from walks import make_mpc, predicted, speed_limit, start, walk

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import RecoveryConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.mpc.terms import TERMS, constraints_of
from pdhocbf_drake.mpc.terms.program import AxisProgram
from pdhocbf_drake.mpc.terms.stability import Stability
from pdhocbf_drake.mpc.terms.term import RowKind, Term, Tick
from pdhocbf_drake.mpc.terms.zmp_velocity import least_zmp_velocity
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario_file import load_scenario


def test_every_row_of_every_program_belongs_to_a_term() -> None:
    mpc = make_mpc(
        mpc={"zmp_velocity_max": (2.0, 2.0), "zmp_centre_weight": 30.0, "barrier": "hard"},
        barriers=(speed_limit(0.5),),
    )
    for problem, qps in zip(mpc.problems, mpc.qps, strict=True):
        declared = {name for term in problem.terms for name in term.row_kinds}
        assert set(problem.row_kinds) == declared
        for qp in qps:
            assert set(qp.names) <= declared


@pytest.mark.parametrize("tick", [0, 95, 160, 163, 199])
def test_filled_parameters_lie_side_by_side_and_fill_theta(tick: int) -> None:
    mpc = make_mpc(barriers=(speed_limit(0.385),))
    for problem in mpc.problems:
        covered = np.zeros(problem.size, dtype=int)
        for place in problem.places.values():
            covered[place] += 1
        np.testing.assert_array_equal(covered, 1)


def test_theta_of_a_tick_does_not_depend_on_what_was_asked_before() -> None:
    mpc, fresh = make_mpc(barriers=(speed_limit(0.385),)), make_mpc(barriers=(speed_limit(0.385),))
    memory = start(mpc)
    for tick, state, stance, _ in walk(mpc, 250, memory):
        bounds = mpc.bounds(tick)
        for axis in (0, 1):
            again = fresh.problems[axis].theta(fresh.given(tick, state, stance, bounds, None, None))
            asked = mpc.problems[axis].theta(mpc.given(tick, state, stance, bounds, None, None))
            np.testing.assert_array_equal(again, asked)


@pytest.mark.parametrize("phase", range(40))
def test_rows_of_the_phase_before_are_about_the_same_instant(phase: int) -> None:
    """A row's coefficient on the inputs from tick k on is that of its partner, a tick ago, on the same inputs."""
    mpc = make_mpc(barriers=(speed_limit(0.385),))
    problem, qps = mpc.problems[0], mpc.qps[0]
    rows, names = problem.guess_rows(qps, phase), np.array(qps[phase].names)
    before = qps[phase - 1]
    assert all(before.names[row] == name for row, name in zip(rows, names, strict=True))
    for row in np.flatnonzero(names == "zmp_box_lower")[:-1]:
        np.testing.assert_allclose(qps[phase].A[row, :79], before.A[rows[row], 1:80], atol=1e-12)


# A bound on the ZMP's velocity.


def test_the_zmp_keeps_its_velocity_limit_in_every_prediction() -> None:
    free = make_mpc()
    fastest = max(np.abs(plan.inputs[1]).max() for *_, plan in walk(free, 400))
    limit = 1.14
    assert fastest > limit
    mpc = make_mpc(mpc={"zmp_velocity_max": (5.0, limit)})
    for *_, plan in walk(mpc, 400):
        assert plan.reason == Reason.SOLVED
        assert np.abs(plan.inputs[1]).max() <= limit + 1e-9


def test_a_limit_that_is_not_reached_changes_nothing() -> None:
    plain = [plan.inputs for *_, plan in walk(make_mpc(), 300)]
    loose = [plan.inputs for *_, plan in walk(make_mpc(mpc={"zmp_velocity_max": (50.0, 50.0)}), 300)]
    np.testing.assert_allclose(loose, plain, atol=1e-9)


def test_a_limit_below_what_the_moving_box_demands_is_refused_with_the_least_possible_one() -> None:
    with pytest.raises(InputError) as refused:
        build_walk(load_scenario("vhip", "mpc: {zmp_velocity_max: [5.0, 0.5]}"))
    message = str(refused.value)
    assert message.startswith("mpc.zmp_velocity_max: the ZMP box moves from foot to foot at up to [")
    assert message.endswith("m/s in x and y, which is the least that is possible (given: [5.0, 0.5])")
    least = [float(word) for word in message.split("[")[1].split("]")[0].split(",")]
    assert 1.05 < least[1] < 1.15
    barely = f"mpc: {{zmp_velocity_max: {least}}}"
    mpc = build_walk(load_scenario("vhip", barely)).mpc
    reasons = {plan.reason for *_, plan in walk(mpc, 600)}
    assert reasons == {Reason.SOLVED}
    for axis in (0, 1):
        below = [5.0, 5.0]
        below[axis] = least[axis] - 2e-3
        with pytest.raises(InputError, match="zmp_velocity_max"):
            build_walk(load_scenario("vhip", f"mpc: {{zmp_velocity_max: {below}}}"))


@pytest.mark.parametrize("given", ["[0.0, 1.0]", "[-1.0, 2.0]", "[.nan, 2.0]", "[1.0]", "fast"])
def test_a_limit_that_is_no_speed_is_refused(given: str) -> None:
    with pytest.raises(InputError, match=r"mpc\.zmp_velocity_max"):
        load_scenario("vhip", f"mpc: {{zmp_velocity_max: {given}}}")


def test_a_missed_velocity_limit_is_named_in_its_own_unit() -> None:
    limits = {"zmp_velocity_max": (1.3, 1.3)}
    assert constraints_of(make_mpc(mpc=limits).config) == {
        "stability": "m", "zmp_box": "m", "step": "m", "zmp_velocity": "m/s",
    }  # fmt: skip
    mpc = make_mpc({"stride": 0.1}, limits | {"recovery": RecoveryConfig(zmp_box=(0.18, 0.11))})
    memory = start(mpc)
    list(walk(mpc, 225, memory))
    state = memory.state + np.array([[0.0, 0.6, 0.0], [0.0, 0.0, 0.0]])
    plan = mpc.solve(225, state, memory.stance, {}, None, memory.plan)
    assert plan.reason == Reason.NO_STEADY_PLAN
    assert plan.unmet.shape == (2, 4)


def test_the_least_speed_in_a_moving_interval_agrees_with_a_linear_program() -> None:
    from scipy.optimize import linprog

    random = np.random.default_rng(3)
    for _ in range(20):
        low = np.cumsum(random.normal(size=(12, 2)), axis=0)
        boxes = np.stack([low, low + random.uniform(0.1, 1.5, size=(12, 2))], axis=-1)
        for axis in (0, 1):
            # p_0 … p_11 and the speed: |p_{i+1} − p_i| ≤ speed · δ.
            steps = np.hstack([np.eye(11, 12, 1) - np.eye(11, 12), np.full((11, 1), -0.1)])
            both = np.vstack([steps, steps * [*[-1.0] * 12, 1.0]])
            limits = [*map(tuple, boxes[:, axis]), (0.0, None)]
            best = linprog([0.0] * 12 + [1.0], both, np.zeros(22), bounds=limits)
            np.testing.assert_allclose(least_zmp_velocity(boxes, 0.1)[axis], best.fun, atol=1e-9)


# A tail that couples the axes.


@pytest.mark.parametrize("turn", [0.3, -1.0])
def test_the_coupled_tail_ends_where_the_rotation_puts_it(turn: float) -> None:
    """e_{k+H} = R e_k by brute force, from a state that is no fixed point of anything."""
    straight = make_mpc()
    memory = start(straight)
    list(walk(straight, 205, memory))
    mpc = PeriodicMpc(straight.gait, straight.vhip, straight.config, straight.barriers, turn=turn)
    state = memory.state + np.array([[0.001, 0.02, 0.0], [0.002, -0.01, 0.0]])
    plan = mpc.solve(205, state, memory.stance, {}, None, memory.plan)
    assert plan.reason == Reason.SOLVED
    future = predicted(mpc, state, plan)
    before = future[:, 0] @ mpc.divergent.offset_row(205)
    after = future[:, -1] @ mpc.divergent.offset_row(205 + 80)
    rotation = np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(after, rotation @ before, atol=1e-9)
    assert not np.allclose(after, before, atol=1e-3)


def test_a_turn_changes_no_matrix_of_the_compiled_programs() -> None:
    straight = make_mpc()
    turning = PeriodicMpc(straight.gait, straight.vhip, straight.config, straight.barriers, turn=0.4)
    for one, other in zip(straight.qps, turning.qps, strict=True):
        for qp, same in zip(one, other, strict=True):
            np.testing.assert_array_equal(qp.P, same.P)
            np.testing.assert_array_equal(qp.A, same.A)
            np.testing.assert_array_equal(qp.lower.matrix, same.lower.matrix)


def test_without_a_turn_the_tail_is_the_periodic_one() -> None:
    mpc = make_mpc()
    kinds = [type(term) for term in mpc.problems[0].terms]
    assert Stability in kinds
    assert len(kinds) == len(set(kinds))


# A term of one's own.


class FirstFoothold(Term):
    """Holds the first coming foothold on x at a given place, by a parameter that every tick fills."""

    rows: ClassVar = {"first foothold": RowKind("step", missed_as="first foothold")}

    @property
    def sizes(self) -> dict[str, int]:
        return {"wish": 1} if self.axis == 0 else {}

    def write(self, program: AxisProgram) -> None:
        if self.axis == 0:
            variables = np.concatenate([program.f[:1], program.part["wish"]])
            program.equal_zero(np.array([[1.0, -1.0]]), variables, "first foothold")

    def fill_tick(self, tick: Tick, theta: np.ndarray) -> None:
        if self.axis == 0:
            theta[self.places["wish"]] = tick.stance[0, 1] + 0.17


def test_a_term_of_ones_own_is_one_class_and_one_entry_of_the_list() -> None:
    plain = make_mpc()
    mpc = PeriodicMpc(plain.gait, plain.vhip, plain.config, plain.barriers, kinds=[*TERMS, FirstFoothold])
    memory = start(mpc)
    list(walk(mpc, 190, memory))
    plan = mpc.solve(190, memory.state, memory.stance, {}, None, memory.plan)
    assert plan.footholds[0, 0] - memory.stance[0, 1] == pytest.approx(0.17)
    assert "first foothold" in mpc.constraints
