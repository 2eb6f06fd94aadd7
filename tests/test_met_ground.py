"""What a standing sole is corrected to, on level ground, where the other foot stands, and elsewhere."""

from __future__ import annotations

import numpy as np
import pytest

from pdhocbf_drake.estimation.met_ground import meet

NEW = [np.nan] * 3


@pytest.mark.parametrize(
    ("own", "other", "seen", "met"),
    [
        (NEW, [0.0, 0.0, 0.0], [0.01, -0.01, 0.003], [0.0, 0.0, 0.0]),  # level, as far as can be seen
        (NEW, [0.05, 0.0, 0.2], [0.052, 0.0, 0.201], [0.05, 0.0, 0.2]),  # a slope, on which the other foot stands
        (NEW, [0.05, 0.0, 0.2], [0.001, 0.0, 0.201], [0.0, 0.0, 0.2]),  # level again
        (NEW, [0.0, 0.0, 0.2], [0.0, 0.0, 0.25], [0.0, 0.0, 0.25]),  # the next step of stairs
        (NEW, [0.0, 0.0, 0.004], [0.0, 0.0, 0.001], [0.0, 0.0, 0.0]),  # the nearer of both
        (NEW, NEW, [0.04, 0.0, 0.3], [0.04, 0.0, 0.3]),
        ([0.0, 0.0, 0.1], [0.0, 0.0, 0.1], [0.0, 0.014, 0.103], [0.0, 0.0, 0.1]),  # it stands
        ([0.0, 0.0, 0.1], [0.0, 0.0, 0.1], [0.0, 0.03, 0.103], [0.0, 0.03, 0.1]),  # it has come to lie on a tilt
    ],
)
def test_the_ground_under_a_foot(own: list[float], other: list[float], seen: list[float], met: list[float]) -> None:
    for side in (0, 1):
        ground = np.array([own, other] if side == 0 else [other, own])
        before = ground[1 - side].copy()
        assert meet(ground, side, np.array(seen)) == pytest.approx(np.array(met))
        assert ground[side] == pytest.approx(np.array(met))
        assert ground[1 - side] == pytest.approx(before, nan_ok=True)
