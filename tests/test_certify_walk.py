"""Certified sets of the walking template, against a program that does not use them."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.barriers import AffineBarrier, constant, tabulated
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.studies.certify.certificate import certify_axis
from pdhocbf_drake.studies.certify.psi_rows import psi_system
from pdhocbf_drake.studies.certify.pushes import kick_range, push_range
from pdhocbf_drake.studies.certify.rescue import SAVED, Rescue
from pdhocbf_drake.studies.certify.starts import inside_starts, outside_starts
from pdhocbf_drake.studies.shared.stepping_template import area, stepping_template
from pdhocbf_drake.walking import GaitConfig

REACH = 0.23
MPC, FIXED = MpcConfig(), MpcConfig(step_tolerance=(0.0, 0.0))

# The same walk on a quarter of the ticks, where properties do not depend on how many there are.
COARSE = GaitConfig(tick=0.04, ticks_per_step=10, double_support_ticks=1)
COARSE_MPC = MpcConfig(horizon=20, freeze_ticks=2)
COARSE_FIXED = MpcConfig(horizon=20, freeze_ticks=2, step_tolerance=(0.0, 0.0))


def speed_limit(values, sign=1, gamma=(0.5, 0.5), name="speed"):
    bound = tabulated(values) if np.ndim(values) else constant(values)
    return AffineBarrier(name, [0.0, 1.0, 0.0], bound, sign, gamma)


def ripple(mean=0.4, peak=0.03, ticks=40):
    """A limit that breathes over the step, as the walk itself does."""
    return mean + peak * np.cos(2 * np.pi * np.arange(ticks) / ticks)


@pytest.fixture(scope="module")
def forward():
    template = stepping_template(GaitConfig(), MPC, 0, REACH)
    return certify_axis(template, [speed_limit(ripple())])


def test_each_bound_and_the_walk_without_it_get_their_sets(forward):
    assert forward.unbounded.enforceable
    assert forward.kept.enforceable
    assert forward.bounds[0].kept is forward.kept
    assert len(forward.kept.sets) == 40
    assert forward.kept.residual < 1e-8
    assert forward.kept.sweeps < 60
    for phase in range(40):
        inner, outer = forward.section(phase), forward.section(phase, forward.unbounded)
        assert outer.violation(inner.vertices).max() < 1e-7
        assert 0.0 < area(inner) < area(outer)


@pytest.mark.parametrize(("axis", "mpc"), [(0, MPC), (0, FIXED), (1, MPC)])
def test_an_independent_program_saves_states_inside_and_proves_those_outside_lost(axis, mpc):
    barriers = [speed_limit(ripple())] if axis == 0 else []
    template = stepping_template(GaitConfig(), mpc, axis, REACH)
    kept = certify_axis(template, barriers, with_rows=False).kept
    random = np.random.default_rng(axis)
    limits = template.with_barriers(barriers)
    inside, outside = inside_starts(kept, 4, random), outside_starts(limits, kept, 6, random)
    for start in inside:
        assert Rescue(template, barriers, REACH, start.phase).excess(start.state) <= SAVED
    for start in outside:
        assert Rescue(template, barriers, REACH, start.phase).excess(start.state) > 10 * SAVED


def test_edges_are_sharp(forward):
    # A hundredth of a millimetre beyond a vertex is lost, a hundredth before it is not.
    template, random = forward.template, np.random.default_rng(3)
    for phase in (2, 20, 36):
        part = forward.kept.sets[phase]
        program = Rescue(template, [forward.bounds[0].barrier], REACH, phase)
        vertex = part.vertices[random.integers(len(part.vertices))]
        outward = (vertex - part.centre) / np.linalg.norm(vertex - part.centre)
        assert program.excess(vertex - 1e-5 * outward) <= SAVED
        assert program.excess(vertex + 1e-3 * outward) > SAVED


def test_a_tighter_bound_never_enlarges_the_set():
    template = stepping_template(COARSE, COARSE_MPC, 0, REACH)
    areas = []
    for mean in (0.5, 0.4, 0.3, 0.2):
        kept = certify_axis(template, [speed_limit(ripple(mean, ticks=10))], with_rows=False).kept
        areas.append([part.volume() for part in kept.sets] if kept.enforceable else [0.0] * 10)
    assert np.all(np.diff(areas, axis=0) <= 1e-9)
    assert areas[0][0] > areas[1][0] > 0.0


def test_free_footholds_enlarge_the_set(forward):
    fixed = certify_axis(stepping_template(GaitConfig(), FIXED, 0, REACH), [speed_limit(ripple())], with_rows=False)
    for phase in range(40):
        assert forward.section(phase).violation(fixed.section(phase).vertices).max() < 1e-7


def test_a_bound_below_the_commanded_speed_is_not_enforceable_with_given_footholds():
    template = stepping_template(COARSE, COARSE_FIXED, 0, REACH)
    mean_speed = 0.15 / 0.4
    found = certify_axis(template, [speed_limit(0.8 * mean_speed)])
    assert found.unbounded.enforceable
    assert not found.kept.enforceable
    assert found.kept.first_failing_phase in range(10)
    assert found.section(0) is None
    assert not found.bounds[0].rows.enforceable
    # From below, the same bound is met by walking on.
    assert certify_axis(template, [speed_limit(0.8 * mean_speed, sign=-1)], with_rows=False).kept.enforceable


def test_bounds_that_cross_have_no_set_from_the_phase_where_they_cross():
    upper, lower = np.full(10, 0.5), np.full(10, 0.2)
    upper[7] = 0.15
    template = stepping_template(COARSE, COARSE_MPC, 0, REACH)
    found = certify_axis(template, [speed_limit(upper, name="upper"), speed_limit(lower, -1, name="lower")], False)
    assert not found.kept.enforceable
    assert found.kept.first_failing_phase == 7


def test_the_half_plane_alone_is_no_barrier_under_a_bounded_zmp(forward):
    # At h = 0 far ahead of the foot no ZMP in the box slows the CoM down.
    failing = forward.bounds[0].failing
    assert failing
    assert len(failing) <= 40
    template = stepping_template(COARSE, COARSE_MPC, 0, REACH)
    assert not certify_axis(template, [speed_limit(9.0)], with_rows=False).bounds[0].failing


def test_psi_rows_cost_more_the_smaller_gamma():
    template = stepping_template(COARSE, COARSE_FIXED, 0, REACH)
    limit = ripple(0.42, ticks=10)
    kept = certify_axis(template, [speed_limit(limit)], with_rows=False).kept
    areas = [[part.volume() for part in kept.sets]]
    for gamma in ((0.9, 0.9), (0.3, 0.3)):
        rows = certify_axis(template, [speed_limit(limit, gamma=gamma)]).bounds[0].rows
        shadows = [part.shadow(2) for part in rows.sets]
        assert all(outer.violation(s.vertices).max() < 1e-7 for s, outer in zip(shadows, kept.sets, strict=True))
        areas.append([shadow.volume() for shadow in shadows])
    assert np.all(np.diff(areas, axis=0) <= 1e-9)
    assert areas[2][0] < areas[0][0]


def test_the_psi_system_is_the_template_in_other_coordinates():
    gamma = (0.4, 0.7)
    template, barrier = stepping_template(GaitConfig(), FIXED, 0, REACH), speed_limit(ripple(), gamma=gamma)
    system, _, _ = psi_system(template, barrier)
    random = np.random.default_rng(0)
    for phase in range(40):
        state, zmp = random.normal(size=2), random.normal(size=2)
        after = template.system.step(phase, state, zmp[:1])
        later = template.system.step(phase + 1, after, zmp[1:])
        h = [barrier.h(phase + i, np.append(x, 0.0)) for i, x in enumerate((state, after, later))]
        psi = [h[i + 1] - (1 - gamma[0]) * h[i] for i in (0, 1)]
        found = system.step(phase, np.append(state, psi[0]), np.array([psi[1] - (1 - gamma[1]) * psi[0]]))
        assert found == pytest.approx(np.append(after, psi[1]))


def test_the_largest_kick_is_the_largest_that_can_be_saved(forward):
    template, barriers = forward.template, [forward.bounds[0].barrier]
    for phase in (5, 25, 34):
        part = forward.section(phase)
        state = part.centre
        kick = kick_range(template, forward.kept, phase, state)
        program = Rescue(template, barriers, REACH, phase)
        for change in kick:
            assert program.excess(template.state(phase, state[0], state[1] + 0.999 * change)) <= SAVED
            assert program.excess(template.state(phase, state[0], state[1] + change + 1e-3 * np.sign(change))) > SAVED
        push = push_range(template, forward.kept, phase, state, 1)
        assert push.low < 0.0 < push.high


def test_a_state_outside_has_no_admissible_kick(forward):
    assert np.all(np.isnan(kick_range(forward.template, forward.kept, 3, np.array([0.0, 2.0]))))
    assert np.all(np.isnan(push_range(forward.template, forward.kept, 3, np.array([0.0, 2.0]), 10)))


def test_the_sides_are_mirror_images():
    kept = certify_axis(stepping_template(GaitConfig(), MPC, 1, REACH), []).kept
    for phase in range(40):
        mirrored = -kept.sets[phase + 40].vertices
        assert kept.sets[phase].violation(mirrored).max() < 1e-7


def test_templates_that_can_not_be_certified_are_refused():
    with pytest.raises(InputError, match=r"the CoM's reach of 0\.05 m does not cover a step of 0\.15 m"):
        stepping_template(GaitConfig(), MPC, 0, 0.05)
    with pytest.raises(InputError, match="no foothold is allowed along y"):
        stepping_template(GaitConfig(), MpcConfig(stance_width_min=0.3), 1, REACH)
    with pytest.raises(InputError, match="leaves nothing of the ZMP box"):
        stepping_template(GaitConfig(), MpcConfig(zmp_margin=0.05), 0, REACH)
    on_the_zmp = AffineBarrier("zmp", [0.0, 0.0, 1.0], constant(1.0), 1, (0.5,))
    with pytest.raises(
        InputError, match='barrier "zmp": the ZMP is an input of the template, so that a bound on it is an input limit'
    ):
        stepping_template(GaitConfig(), MPC, 0, REACH).with_barriers([on_the_zmp])
