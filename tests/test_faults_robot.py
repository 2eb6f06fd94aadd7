"""What goes wrong around a walking robot: lost, frozen and late measurements, a failing solver, ice, a heavy torso."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from pydrake.systems.framework import BasicVector, Context

from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.qp import QpResult, QpSolver
from pdhocbf_drake.robot import Biped
from pdhocbf_drake.simulation import biped_diagram
from pdhocbf_drake.simulation.run_log import FELL, FINISHED, RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.shared.endings import DID_NOT_WALK_ON, SURVIVED
from pdhocbf_drake.studies.shared.pushing import PushedWalk, Trial
from pdhocbf_drake.systems.block import Block, weakly
from pdhocbf_drake.systems.state_estimator import StateEstimator

Lie = Callable[[int, np.ndarray], np.ndarray]
COARSE = "plant: {time_step: 0.005}"
WATCHED = 2.0  # [s], two and a half gaits
NOBODY = np.zeros(3)


class FaultyEstimator(Block):
    """A `StateEstimator` whose lip_state a test can change, as a function of time and true value."""

    fault: Callable[[float, np.ndarray], np.ndarray] | None = None

    def __init__(self, biped: Biped, uneven: bool = False) -> None:
        super().__init__()
        self._true = StateEstimator(biped, uneven)
        self._context = self._true.CreateDefaultContext()
        self.parts = self._true.parts
        ports = map(self._true.get_input_port, range(self._true.num_input_ports()))
        self._inputs = [self.DeclareVectorInputPort(port.get_name(), port.size()) for port in ports]
        size, changes = self._true.get_output_port().size(), {port.ticket() for port in self._inputs}
        self.DeclareVectorOutputPort("estimate", size, weakly(self._calc), changes)

    def _calc(self, context: Context, output: BasicVector) -> None:
        for i, port in enumerate(self._inputs):
            self._true.get_input_port(i).FixValue(self._context, port.Eval(context))
        estimate = np.array(self._true.get_output_port().Eval(self._context))
        if FaultyEstimator.fault is not None:
            estimate[:6] = FaultyEstimator.fault(context.get_time(), estimate[:6])
        output.SetFromVector(estimate)


@pytest.fixture(scope="module")
def pushed() -> Iterator[PushedWalk]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(biped_diagram, "StateEstimator", FaultyEstimator)
        yield PushedWalk(load_scenario("walking", COARSE), [10])


@pytest.fixture(scope="module")
def undisturbed(pushed: PushedWalk) -> Trial:
    return pushed.trial(10, NOBODY, watch=WATCHED)


@pytest.fixture
def walk_with(pushed: PushedWalk, undisturbed: Trial, monkeypatch: pytest.MonkeyPatch) -> Callable[[Lie], Trial]:
    """Walks under a controller that measures `lie(tick from the start, true state)`."""
    start = undisturbed.log.time[0]

    def walk(lie: Lie) -> Trial:
        monkeypatch.setattr(
            FaultyEstimator, "fault", staticmethod(lambda time, state: lie(round((time - start) / 0.01), state))
        )
        return pushed.trial(10, NOBODY, watch=WATCHED)

    return walk


def reasons(log: RunLog) -> list[Reason]:
    """Of the ticks watched; row k shows what was solved at tick k − 1."""
    return [Reason(round(number)) for number in log.element("solver_status", "reason")]


def astray(trial: Trial, undisturbed: Trial) -> float:
    """How far anything of the robot is from where it is without the fault, at most [m, rad]."""
    return float(np.abs(trial.log["robot_state"] - undisturbed.log["robot_state"])[:, :19].max())


@pytest.mark.parametrize(("ticks", "apart"), [(1, 5e-4), (10, 5e-3)])
def test_a_state_that_is_no_number_is_walked_through(
    walk_with: Callable[[Lie], Trial], undisturbed: Trial, ticks: int, apart: float
) -> None:
    trial = walk_with(lambda tick, state: np.full(6, np.nan) if 50 <= tick < 50 + ticks else state)
    assert trial.ending == SURVIVED
    seen = reasons(trial.log)
    assert [k for k, reason in enumerate(seen) if reason == Reason.BAD_MEASUREMENT] == list(range(51, 51 + ticks))
    assert set(seen) == {Reason.SOLVED, Reason.BAD_MEASUREMENT}
    assert 0.0 < astray(trial, undisturbed) < apart
    assert np.all(np.isfinite(trial.log["actuation"]))


def test_a_frozen_measurement_is_noticed_and_walked_through(
    walk_with: Callable[[Lie], Trial], undisturbed: Trial
) -> None:
    last: list[np.ndarray] = []

    def frozen(tick: int, state: np.ndarray) -> np.ndarray:
        if tick < 50:
            last[:] = [state]
        return last[0] if 50 <= tick < 60 else state

    trial = walk_with(frozen)
    assert trial.ending == SURVIVED
    stale = [k for k, reason in enumerate(reasons(trial.log)) if reason == Reason.STALE_MEASUREMENT]
    assert set(range(52, 61)) <= set(stale) <= set(range(51, 61))
    assert astray(trial, undisturbed) < 5e-3


def test_a_measurement_that_stays_away_ends_in_a_stand(walk_with: Callable[[Lie], Trial], undisturbed: Trial) -> None:
    trial = walk_with(lambda tick, state: np.full(6, np.nan) if 20 <= tick < 45 else state)
    log = trial.log
    assert trial.ending == DID_NOT_WALK_ON
    assert reasons(log)[-1] == Reason.STOPPING  # stopped, which is not walking on
    assert log.element("com_z", "z").min() > 0.55
    # The CoM's height goes on as in (24); nothing else moves.
    assert np.abs(log["lip_state"][-10:, [1, 4]]).max() < 0.02
    assert np.ptp(log["foot_state"][-10:], axis=0).max() < 1e-3
    left, right = log["foot_state"][-1].reshape(2, 6)[:, 0]
    assert abs(left - right) < 0.01  # side by side


@pytest.mark.parametrize("second", [True, False], ids=["second solver answers", "none answers"])
def test_a_solver_that_fails_every_fifth_tick_is_walked_with(
    pushed: PushedWalk, undisturbed: Trial, monkeypatch: pytest.MonkeyPatch, second: bool
) -> None:
    class Fails:
        def __init__(self, inner: QpSolver) -> None:
            self.inner = inner

        def solve(self, theta: np.ndarray, guess: np.ndarray | None = None) -> QpResult:
            return self.inner.solve(theta, guess)._replace(ok=False, infeasible=False)

    mpc = pushed.controller.mpc
    failing = [[Fails(solver) if phase % 5 == 0 else solver for phase, solver in enumerate(a)] for a in mpc.solvers]
    monkeypatch.setattr(mpc, "solvers", failing)
    if not second:
        monkeypatch.setattr(mpc, "rungs", [])
    trial = pushed.trial(10, NOBODY, watch=WATCHED)
    assert trial.ending == SURVIVED
    wanted = Reason.CROSS_SOLVED if second else Reason.NOT_OPTIMAL
    assert [k for k, reason in enumerate(reasons(trial.log)) if reason != Reason.SOLVED] == list(range(1, 201, 5))
    assert set(reasons(trial.log)) == {Reason.SOLVED, wanted}
    assert trial.log.element("solver_status", "fallbacks").max() == (0 if second else 1)
    assert astray(trial, undisturbed) < (1e-5 if second else 0.02)


def test_ice_that_is_not_expected_ends_in_a_fall_that_is_logged_to_its_end() -> None:
    log = simulate(load_scenario("walking", f"friction: 0.1\nfriction_belief: 0.8\nduration: 8.0\n{COARSE}"))
    assert log.ending == FELL
    assert not log.complete
    assert 2.0 < log.time[-1] < 8.0
    np.testing.assert_allclose(np.diff(log.time), 0.01, atol=1e-9)
    assert all(np.all(np.isfinite(table)) for table in log.signals.values())
    assert log.element("com_z", "z")[-1] < 0.5 < log.element("com_z", "z")[-60]
    assert Reason.RECOVERING in reasons(log)  # it was noticed, and something was tried


@pytest.mark.parametrize(
    ("fault", "kept"),
    [
        ("model_error: {torso_mass: 1.3}", True),
        ("measurement: {delay_ticks: 4}, wind: [0.0, 10.0]", True),
        ("measurement: {delay_ticks: 2}, mpc: {delay: 3}", None),
        ("model_error: {torso_mass: 1.3}, mpc: {disturbance: null}, biped: {learns_torque: false}", False),
    ],
)
def test_a_heavy_torso_and_a_late_measurement_cost_no_speed_where_they_are_expected(
    fault: str, kept: bool | None
) -> None:
    log = simulate(load_scenario("walking", f"{{{fault}, duration: 6.0, {COARSE}}}"))
    assert log.ending == FINISHED
    assert np.all(log.element("solver_status", "fallbacks") == 0)
    assert log.element("com_z", "z").min() > 0.55
    gait = log.time > 4.4 - 1e-9  # the last two
    commanded, speed = 0.15 / 0.4, log.element("lip_state", "vx")[gait].mean()
    assert kept is None or (0.98 * commanded < speed < 1.02 * commanded) == kept
    learned = "torque_bias" in log and bool(log["torque_bias"].any())
    assert learned == ("torso" in fault) or kept is not True
    if learned and kept:  # the knees' PD carries none of the load any more, which takes 5 N m of the one that stands
        carried = (log["actuation"] - log["feedforward"] - log["torque_bias"])[gait].reshape(-1, 2, 6)[:, :, 3]
        assert np.abs(carried.mean(axis=0)).max() < 1.0
    if kept:
        assert set(reasons(log)) == {Reason.SOLVED}
        assert log["h"][log.time >= 2.0].min() > 0.0
