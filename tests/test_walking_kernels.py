"""What a plan says of the next tick, as machine code, against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.walking.kernels import write_foot_plan
from pdhocbf_drake.walking.vhip import Vhip


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("tick", [0, 4, 12])
def test_references_are_the_following_state_and_its_accelerations(seed: int, tick: int) -> None:
    random = np.random.default_rng(seed)
    vhip, state, u = Vhip(random.uniform(10.0, 20.0, 5), 0.02), random.normal(size=(2, 3)), random.normal(size=2)
    following, references = vhip.references(tick, state, u)
    np.testing.assert_array_equal(following, vhip.step_axes(tick, state, u))
    (x, vx, x_zmp), (y, vy, y_zmp) = following
    eta = vhip.eta[(tick + 1) % 5]
    com = [x, vx, eta * (x - x_zmp), y, vy, eta * (y - y_zmp)]
    np.testing.assert_array_equal(references, [*com, x_zmp, u[0], y_zmp, u[1]])


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("swinging", [-1, 0, 1])
@pytest.mark.parametrize("stands_after", [False, True])
def test_the_plan_of_the_feet(seed: int, swinging: int, stands_after: bool) -> None:
    random, out = np.random.default_rng(seed), np.empty(16)
    stance, footholds, feet = random.normal(size=(2, 2)), random.normal(size=(2, 3)), random.normal(size=(2, 2))
    write_foot_plan(swinging, stands_after, stance, footholds, feet, out)
    np.testing.assert_array_equal(out[:8].reshape(4, 2), [*stance.T, *footholds.T[:2]])
    start, end = np.moveaxis(out[8:].reshape(2, 2, 2), 1, 0)
    np.testing.assert_array_equal(start, feet)
    standing = [foot for foot in (0, 1) if foot != swinging]
    np.testing.assert_array_equal(end[standing], feet[standing])
    if swinging >= 0:
        # Two feet that stand side by side have their centre between them.
        landed = (end[swinging] + stance[:, 1]) / 2.0 if stands_after else end[swinging]
        np.testing.assert_allclose(landed, footholds[:, 0], atol=1e-15)
