"""The whole-body program: against the closed form, against Drake in all unknowns, and its limits."""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.multibody.tree import JacobianWrtVariable
from pydrake.solvers import ClarabelSolver, MathematicalProgram, SolverOptions
from whole_body_ticks import NOWHERE, TICK, Body

from pdhocbf_drake.barriers import psi, record
from pdhocbf_drake.simulation.run_log import RunLog
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.simulation.simulate import simulate
from pdhocbf_drake.studies.limits.joints import random_postures, stop
from pdhocbf_drake.whole_body.columns import along_tasks, columns
from pdhocbf_drake.whole_body.joint_barriers import JointBarriers, angle_barrier, joint_system
from pdhocbf_drake.whole_body.layer import Moving
from pdhocbf_drake.whole_body.reason import Reason
from pdhocbf_drake.whole_body.solver import Program, solve_with_clarabel, solve_with_daqp

GAMMAS = (0.3, 0.3)
USABLE = 0.95  # of a joint's torque, by the plan
HEIGHT, TORSO, LEFT, RIGHT = [2], [3, 4, 5], [6, 7, 8], [12, 13, 14]  # among the tasks
LEFT_TURN, RIGHT_TURN = [9, 10, 11], [15, 16, 17]
PRICES = {2: 100.0, 3: 0.05, 4: 0.05, 5: 0.001} | dict.fromkeys([*LEFT, *RIGHT], 0.1)


@pytest.fixture(scope="module")
def log() -> RunLog:
    """Two steps of the packaged walk, the standing start before them included."""
    return simulate(load_scenario("walking_nobarrier", "{duration: 1.3}"))


def peaks(log: RunLog) -> np.ndarray:
    return np.abs(np.array([moving.torque.tau for moving in Body().ticks(log)])).max(axis=0)


def test_where_no_limit_is_near_the_program_gives_the_closed_form(log: RunLog) -> None:
    body = Body()
    always, auto = body.layer(kind="qp"), body.layer(kind="auto")
    for moving in body.ticks(log):
        for kept in (always(moving, NOWHERE), auto(moving, NOWHERE)):
            assert kept.reason == Reason.INSIDE
            np.testing.assert_allclose(kept.vdot, moving.vdot, atol=1e-9)
            np.testing.assert_allclose(np.concatenate(kept.torque), np.concatenate(moving.torque), atol=1e-9)
            assert not kept.given.any()


@pytest.mark.parametrize("share", [0.0, 0.4, 1.0])
def test_columns_are_differences_of_inverse_dynamics(share: float) -> None:
    body, rng = Body(), np.random.default_rng(1)
    q, v, vdot = body.biped.bent_knee, rng.normal(size=18), rng.normal(size=18)
    before = body.dynamics(q, v, vdot, share)
    tasks = np.array([2, 3, 4, 5, 6, 7, 8])
    directions = along_tasks(body.ik.task_space, tasks)
    assert directions is not None
    change = columns(body.biped, body.ik.task_space, q, directions, share)
    decisions = rng.normal(size=change.tau.shape[1])
    moved = vdot + change.vdot @ decisions
    np.testing.assert_allclose(
        body.ik.task_space.jacobian() @ (moved - vdot), np.eye(18)[:, tasks] @ decisions[:7], atol=1e-9
    )
    if len(decisions) == 7:
        after = np.concatenate(body.dynamics(q, v, moved, share)) - np.concatenate(before)
        np.testing.assert_allclose(np.vstack([change.tau, change.wrenches]) @ decisions, after, atol=1e-8)
    else:  # what the load's share changes leaves the equations of motion as they are
        jacobian = body.ik.task_space.jacobian()
        forces = jacobian[6:12].T @ change.wrenches[:6] + jacobian[12:].T @ change.wrenches[6:]
        forces[body.biped.v_index] += change.tau
        mass = plant_at(body, q, v)[0]
        np.testing.assert_allclose(forces, mass @ change.vdot, atol=1e-8)


def plant_at(body: Body, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray, list[np.ndarray]]:
    """Mass matrix, bias less gravity and damping, and the soles' Jacobians [place; turn], by Drake."""
    plant, context = body.biped.plant, body.biped.context()
    plant.SetPositions(context, q)
    plant.SetVelocities(context, v)
    bias = plant.CalcBiasTerm(context) - plant.CalcGravityGeneralizedForces(context)
    world, soles = plant.world_frame(), []
    for sole in body.biped.soles.values():
        of = plant.CalcJacobianSpatialVelocity(
            context, JacobianWrtVariable.kV, sole.frame, np.zeros(3), world, world
        )  # fmt: skip
        soles.append(np.vstack([of[3:], of[:3]]))
    return plant.CalcMassMatrix(context), bias, soles


def in_all_unknowns(body: Body, moving: Moving) -> np.ndarray:
    """v̇ on one foot by Drake: accelerations, torques and the wrench as decisions, the equations of motion as rows."""
    biped, swing = body.biped, LEFT if moving.swing == "left" else RIGHT
    mass, bias, soles = plant_at(body, moving.q, moving.v)
    stands = 1 if moving.swing == "left" else 0
    prog = MathematicalProgram()
    vdot, tau, wrench = (prog.NewContinuousVariables(n) for n in (18, 12, 6))
    chosen = np.zeros((18, 12))
    chosen[biped.v_index] = np.eye(12)
    equation = np.hstack([mass, -chosen, -soles[stands].T])
    prog.AddLinearEqualityConstraint(equation, -bias, np.concatenate([vdot, tau, wrench]))
    body.ik.task_space.set_state(moving.q, moving.v)
    jacobian = body.ik.task_space.jacobian()
    free = [*HEIGHT, *TORSO, *swing]
    held = np.setdiff1d(np.arange(18), free)
    prog.AddLinearEqualityConstraint(jacobian[held], jacobian[held] @ moving.vdot, vdot)
    for task in free:
        row = jacobian[task]
        square = 2.0 * PRICES[task] * np.outer(row, row)
        prog.AddQuadraticCost(square, -square @ moving.vdot, 0.0, vdot, is_convex=True)
    effort = USABLE * biped.effort_limits
    prog.AddBoundingBoxConstraint(-effort, effort, tau)
    fx, fy, fz, mx, my, mz = wrench
    length, width = biped.soles["left"].half_size
    for i in range(8):
        way = i * np.pi / 4.0
        prog.AddLinearConstraint(np.cos(way) * fx + np.sin(way) * fy <= body.friction * fz)
    for value, most in ((my, length), (mx, width), (mz, body.friction * body.grip.radius)):
        prog.AddLinearConstraint(value <= most * fz)
        prog.AddLinearConstraint(value >= -most * fz)
    prog.AddLinearConstraint(fz >= 0.0)
    options = SolverOptions()
    for name in ("tol_gap_abs", "tol_gap_rel", "tol_feas"):
        options.SetOption(ClarabelSolver.id(), name, 1e-12)
    result = ClarabelSolver().Solve(prog, None, options)
    assert result.is_success()
    return result.GetSolution(vdot)


@pytest.mark.parametrize(("joint", "friction"), [(3, 0.8), (1, 0.8), (None, 0.08)])
def test_drake_finds_the_same_motion_in_all_unknowns(log: RunLog, joint: int | None, friction: float) -> None:
    effort = np.full(12, 1e3)
    if joint is not None:
        effort[[joint, joint + 6]] = 0.93 * peaks(log)[[joint, joint + 6]]
    body = Body(effort, friction)
    keep, changed = body.layer(kind="auto"), 0
    for moving in body.ticks(log):
        kept = keep(moving, NOWHERE)
        if (
            kept.reason != Reason.KEPT
            or 0.0 < moving.share < 1.0
            or abs(kept.given[2]) > 1.9
            or np.abs(kept.given[[3, 4]]).max() > 25.0
            or kept.given[[*LEFT_TURN, *RIGHT_TURN]].any()
        ):
            continue
        changed += 1
        expected = in_all_unknowns(body, moving)
        np.testing.assert_allclose(kept.vdot, expected, atol=1e-5 * np.abs(expected - moving.vdot).max() + 1e-7)
    assert changed >= 5


def recorded_programs(log: RunLog, body: Body) -> list[Program]:
    programs: list[Program] = []

    def recording(program: Program) -> np.ndarray | None:
        programs.append(program)
        return solve_with_daqp(program)

    keep = body.layer(kind="auto")
    keep.solve = recording
    for moving in body.ticks(log):
        keep(moving, NOWHERE)
    return programs


def test_clarabel_agrees_on_programs_of_a_walk(log: RunLog) -> None:
    programs = recorded_programs(log, Body(0.7 * peaks(log), 0.1))
    assert len(programs) > 50
    for program in programs:
        ours, theirs = solve_with_daqp(program), solve_with_clarabel(program)
        assert (ours is None) == (theirs is None)
        if ours is not None:
            np.testing.assert_allclose(ours, theirs, rtol=0.0, atol=1e-7)


def test_planned_torques_never_exceed_their_limits(log: RunLog) -> None:
    effort = 0.7 * peaks(log)
    body = Body(effort)
    keep, reasons = body.layer(kind="auto"), set()
    for moving in body.ticks(log):
        kept = keep(moving, NOWHERE)
        reasons.add(kept.reason)
        assert (np.abs(kept.torque.tau) <= effort).all()
        assert (kept.reason >= Reason.TORQUE) == (kept.miss > 1e-9)
    assert {Reason.INSIDE, Reason.KEPT} <= reasons


def test_the_torsos_yaw_gives_way_to_friction_about_the_vertical(log: RunLog) -> None:
    body = Body(friction=0.3)
    body.grip = body.grip._replace(radius=0.03)
    keep, most, given = body.layer(kind="auto"), 0.3 * 0.03, []
    for moving in body.ticks(log):
        kept = keep(moving, NOWHERE)
        if kept.reason == Reason.KEPT and not 0.0 < moving.share < 1.0:
            sole = kept.torque.left if moving.share == 1.0 else kept.torque.right
            assert abs(sole[5]) <= most * sole[2] * (1.0 + 1e-9)
            given.append(np.abs(kept.given))
    assert len(given) > 5
    height, roll, pitch, yaw = np.max(given, axis=0)[2:6]
    assert yaw > 10.0 * max(height, roll, pitch)


def test_a_foot_at_its_ankles_stop_turns_before_and_after_it_leaves_the_ground(log: RunLog) -> None:
    body, seen = Body(), set()
    for moving in body.ticks(log):
        load = moving.share if moving.swing == "left" else 1.0 - moving.share
        ankle, turn = (5, LEFT_TURN) if moving.swing == "left" else (11, RIGHT_TURN)
        angle, speed = moving.q[body.biped.q_index[ankle]], moving.v[body.biped.v_index[ankle]]
        if moving.swing is None or load > 0.4 or abs(speed) < 0.05:
            continue
        body.biped.position_limits = np.tile([-10.0, 10.0], (12, 1))
        body.biped.position_limits[ankle, int(speed > 0.0)] = angle + TICK * speed
        kept = body.layer(kind="auto")(moving, NOWHERE)
        assert kept.reason == Reason.KEPT
        given = np.abs(kept.given)
        assert given[turn].max() > 10.0 * given[[*HEIGHT, *TORSO]].max()
        seen.add(load > 0.0)
    assert seen == {True, False}


def test_no_joint_leaves_its_limits_from_within_the_viable_set() -> None:
    found = random_postures(load_scenario("walking"), 1000)
    assert found.beyond <= 1e-6
    assert Reason.NOT_OPTIMAL not in found.reasons
    assert {Reason.KEPT, Reason.JOINTS} <= set(found.reasons)


@pytest.mark.parametrize("tick", [0.01, 0.1, 0.15])
def test_at_large_ticks_a_barrier_of_continuous_time_is_overrun_and_this_one_is_not(tick: float) -> None:
    own, other, clamp = (stop(kind, tick) for kind in ("barrier", "continuous", "clamp"))
    assert own.beyond <= 1e-6
    assert (other.beyond > 0.2) == (tick > 0.05)
    assert clamp.beyond <= 0.0
    assert clamp.acceleration > 2.0 * own.acceleration


def test_along_a_stop_the_recursion_holds() -> None:
    barriers = JointBarriers.of(np.array([-0.5]), np.array([0.5]), np.array([np.inf]), GAMMAS, TICK)
    states = [np.zeros(2)]
    for _ in range(100):
        q, v = states[-1]
        a = min(40.0, barriers.interval(np.array([q]), np.array([v]))[1][0])
        states.append(np.array([q + TICK * v, v + TICK * a]))
    found = record(angle_barrier(0.5, 1, GAMMAS), states)
    assert found.violations == 0
    assert found.psi_min == pytest.approx(0.0, abs=1e-12)


def test_an_angles_barrier_is_the_recursion() -> None:
    rng = np.random.default_rng(2)
    lower, upper, speed = rng.uniform(-2.0, -0.1, 5), rng.uniform(0.1, 2.0, 5), np.full(5, 1e3)
    barriers = JointBarriers.of(lower, upper, speed, GAMMAS, TICK)
    q, v = rng.uniform(lower, upper), rng.normal(size=5)
    for bounds, limits, sign in ((barriers.interval(q, v)[1], upper, 1), (barriers.interval(q, v)[0], lower, -1)):
        for i in range(5):
            barrier = angle_barrier(limits[i], sign, GAMMAS)
            found = psi(barrier, joint_system(TICK), 0, [q[i], v[i]], [[bounds[i]]])
            assert found[2] == pytest.approx(0.0, abs=1e-12)
            inside = psi(barrier, joint_system(TICK), 0, [q[i], v[i]], [[bounds[i] - sign]])
            assert inside[2] > 0.0
