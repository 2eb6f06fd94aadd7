"""The bounded quantities of a walk, and how a user chooses one and describes its bound."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

from pdhocbf_drake.barriers import AffineBarrier, check_relative_degree, constant
from pdhocbf_drake.config import parse_config
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.config import MpcConfig
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import build_walk, nominal_walk_of
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.walking import CosineHeight, Gait, GaitConfig
from pdhocbf_drake.walking.barrier_config import WalkBarrierConfig, WalkBoundConfig
from pdhocbf_drake.walking.divergent import DivergentComponent
from pdhocbf_drake.walking.quantities import QUANTITIES, SPEEDS, Quantity
from pdhocbf_drake.walking.vhip import Vhip

GAIT = GaitConfig()
VHIP = Vhip(CosineHeight(GAIT).eta(), GAIT.tick)
STATES = np.random.default_rng(0).normal(size=(200, 3))
TICKS = np.arange(17, 217)


def divergent() -> Quantity:
    """ξ_k = c + v/ω_k along y, whose normal varies with the phase."""

    def normals(vhip: Vhip) -> np.ndarray:
        ones = np.ones(vhip.period)
        return np.column_stack([ones, ones / DivergentComponent(vhip).omega, 0.0 * ones])

    return dataclasses.replace(QUANTITIES["lateral_speed"], name="dcm_y", normals=normals, unit="m")


@pytest.mark.parametrize("quantity", [*QUANTITIES.values(), divergent()], ids=lambda quantity: quantity.name)
def test_a_quantity_is_its_normal_times_the_state(quantity: Quantity) -> None:
    normals = quantity.normals(VHIP)
    expected = [normals[k % len(normals)] @ state for k, state in zip(TICKS, STATES, strict=True)]
    np.testing.assert_allclose(quantity.values(STATES, TICKS, VHIP, GAIT), expected, rtol=1e-14)


@pytest.mark.parametrize("name", QUANTITIES)
def test_a_normal_s_period_divides_a_step(name: str) -> None:
    assert VHIP.period % len(QUANTITIES[name].normals(VHIP)) == 0


@pytest.mark.parametrize("axis", [0, 1])
def test_speeds_are_the_velocity_of_their_axis_bit_for_bit(axis: int) -> None:
    assert SPEEDS[axis].axis == axis
    np.testing.assert_array_equal(SPEEDS[axis].values(STATES, TICKS, VHIP, GAIT), STATES[:, 1])


@pytest.mark.parametrize("axis", [0, 1])
def test_an_orbit_is_one_period_of_the_nominal_walk(axis: int) -> None:
    walk = np.random.default_rng(1).normal(size=(2, 2 * VHIP.period, 3))
    np.testing.assert_array_equal(SPEEDS[axis].orbit(walk, VHIP, GAIT), walk[axis, : (axis + 1) * VHIP.period, 1])


def test_each_speed_repeats_after_its_number_of_steps_and_no_sooner() -> None:
    first, second = np.split(nominal_walk_of(load_scenario("vhip"), 0.15)[:, :, 1], 2, axis=1)
    np.testing.assert_allclose(second[0], first[0], atol=1e-7)
    assert np.abs(second[1] - first[1]).max() > 0.01


def test_a_position_in_the_world_has_no_orbit() -> None:
    walk = np.zeros((2, 2 * VHIP.period, 3))
    assert divergent().orbit(walk, VHIP, GAIT) is None


def test_the_mpc_keeps_a_quantity_whose_normal_varies_with_the_phase() -> None:
    ticks, quantity, gait = np.arange(480), divergent(), Gait(GAIT)

    def walked(*barriers: AffineBarrier) -> tuple[np.ndarray, float]:
        mpc = PeriodicMpc(gait, VHIP, MpcConfig(), ([], list(barriers)))
        rows = list(walk_template(mpc, Memory.standing(mpc), 0, len(ticks)))
        states = np.array([row.state[quantity.axis] for row in rows])
        return quantity.values(states, ticks, VHIP, GAIT), max(row.plan.slack for row in rows)

    limit = walked()[0].max() - 0.002
    barrier = AffineBarrier("dcm", quantity.normals(VHIP), constant(limit), 1, [0.5, 0.5], quantity.unit)
    assert set(check_relative_degree(barrier, VHIP.system)) == {2}
    values, slack = walked(barrier)
    assert values.max() <= limit
    assert slack == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("axis", "name"), [("x", "forward_speed"), ("y", "lateral_speed")])
def test_a_barrier_s_axis_chooses_the_speed_along_it(axis: str, name: str) -> None:
    config = parse_config(WalkBarrierConfig, {"axis": axis, "bound": {"kind": "orbit"}}, "barriers.v")
    assert config.bounded == QUANTITIES[name]
    assert config.unit == config.bounded.unit


@pytest.mark.parametrize(("axis", "steps"), [("x", 1), ("y", 2)])
def test_a_walk_s_barrier_has_the_normal_and_the_period_of_its_quantity(axis: str, steps: int) -> None:
    text = f"barriers: {{forward_speed: {{axis: {axis}, bound: {{margin: 0.5}}}}}}"
    walk = build_walk(load_scenario("vhip", text))
    (barrier,) = walk.barriers
    assert walk.axes == ("xy".index(axis),)
    assert barrier.period == steps * walk.gait.period
    np.testing.assert_array_equal(barrier.normal, [0.0, 1.0, 0.0])


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"kind": "orbit", "value": 1.0}, 'a bound of kind "orbit" does not use value; it takes: margin, stride'),
        ({"kind": "constant", "value": 1.0, "stride": 0.1},
         'a bound of kind "constant" does not use stride; it takes: value'),
        ({"kind": "square"}, "must be 'constant', 'harmonic', 'tabulated', 'orbit' or 'orbit_peak'"),
    ],
)  # fmt: skip
def test_wrong_bounds_of_a_walk_are_refused_with_a_sentence(keys: dict, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        parse_config(WalkBoundConfig, keys, "bound")


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"axis": "z"}, "barriers.v.axis: must be 'x' or 'y' (given: 'z')"),
        ({"gama": [0.5]}, "barriers.v.gama: unknown key; allowed here: axis, bound, class_k, class_k_scale, gamma, "),
        ({"class_k": "saturating", "class_k_scale": 0.1}, 'barriers.v: class_k is "linear" in a scenario, because'),
    ],
)
def test_wrong_barriers_of_a_walk_are_refused_with_a_sentence(keys: dict, text: str) -> None:
    with pytest.raises(InputError, match=re.escape(text)):
        parse_config(WalkBarrierConfig, {"bound": {"kind": "orbit"}, **keys}, "barriers.v")
