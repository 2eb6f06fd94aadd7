"""What a walk straight ahead with nothing edited has to keep, whichever robot walks it."""

from __future__ import annotations

from pdhocbf_drake.analysis.metrics_schema import Metrics


def check_sound(found: Metrics) -> None:
    """No fall, the commanded way on its path, within soles, limits and bounds, and every tick planned as asked for."""
    assert not found.fell
    assert found.distance is not None
    assert found.distance_commanded is not None
    assert found.distance > 0.95 * found.distance_commanded
    assert found.lateral_drift is not None
    assert found.lateral_drift < 0.02 * found.distance
    assert found.yaw_drift_deg is not None
    assert found.yaw_drift_deg < 0.5  # some bases lie on their side
    assert found.zmp_outside_fraction is not None
    assert found.zmp_outside_fraction < 0.08
    assert found.torque_limit_hits == 0
    assert found.joint_speed_margin_min is not None
    assert found.joint_speed_margin_min > 0.0
    assert found.sole_gap_min is not None
    assert found.sole_gap_min > 0.0
    assert found.mpc is not None
    assert (found.mpc.fallbacks, found.mpc.degraded) == (0, {})
    h_min = found.barriers["forward_speed"].h_min
    assert h_min is not None
    assert h_min >= 0.0
