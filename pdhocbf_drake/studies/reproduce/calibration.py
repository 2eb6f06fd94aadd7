"""The calibration of the parameters that the paper does not report to its eq. (38); the script prints the fit.

The paper prints two margins and their ratio, and neither stride, Δ_z, ε nor the bounds. Chosen: a stride of
0.15 m, ε = 1e4 1/s² a foothold, the literal gait (no double support, no standing start), α₁ = 1, and one rule for
both bounds: each clears the nominal velocity by the same margin where it comes closest. Then two numbers are fitted to
two numbers: Δ_z, which sets the ripple of the velocity, and the margin.

    h̄_P = margin,    h̄_DCBF = margin + (peak − mean of the velocity),    so that M = margin/(margin + ripple).

Run it with `python -m pdhocbf_drake.studies.reproduce.calibration`.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.mpc.controller import PeriodicMpc
from pdhocbf_drake.mpc.loop import walk_template
from pdhocbf_drake.mpc.memory import Memory
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario

PAPER_DCBF, PAPER_PERIODIC = 0.0226, 0.0073  # [m/s], eq. (38)
WINDOW = slice(201, 401)  # ticks of eq. (38)

CHOSEN: dict[str, Any] = {
    "gait": {"stride": 0.15, "double_support_ticks": 0, "start_steps": 0},
    "mpc": {"foothold_weight": 1e4},
}
SETTLED = 1200  # ticks after which the walk repeats to some 0.1 mm/s
_TOLERANCE = 1e-6  # [m/s]


class Calibration(NamedTuple):
    """The fit.

    Attributes:
        amplitude: Δ_z of eq. (24) [m].
        margin: by which both bounds clear the nominal velocity [m/s].
        ripple: peak less mean of the nominal velocity [m/s].
        walks: number of simulated walks.
    """

    amplitude: float
    margin: float
    ripple: float
    walks: int


def free_walk(gait: dict[str, Any], mpc: dict[str, Any], ticks: int = SETTLED) -> NDArray[np.float64]:
    """Forward CoM velocity of the template without barriers from a stand on, (ticks,) [m/s]."""
    walk = build_walk(Scenario.from_dict({"system": "vhip", "gait": gait, "mpc": mpc}, "calibration"))
    return forward_speed(walk.mpc, ticks)


def forward_speed(mpc: PeriodicMpc, ticks: int) -> NDArray[np.float64]:
    """Forward CoM velocity of the template from a stand on, (ticks,) [m/s].

    Raises:
        InputError: there is no plan at some tick.
    """
    speed = np.empty(ticks)
    for row in walk_template(mpc, Memory.standing(mpc), 0, ticks):
        if row.plan.fallbacks:
            raise InputError(f"the walk with gait {mpc.gait.config} can't be planned at tick {row.tick}")
        speed[row.tick] = row.state[0, 1]
    return speed


def measure(amplitude: float) -> tuple[float, float]:
    """(settled peak, settled mean), both less the mean over the window [m/s]."""
    speed = free_walk({**CHOSEN["gait"], "com_height_amplitude": amplitude}, CHOSEN["mpc"])
    orbit = speed[-40:]
    return float(orbit.max() - speed[WINDOW].mean()), float(orbit.mean() - speed[WINDOW].mean())


def calibrate(low: float = 0.015, high: float = 0.022) -> Calibration:
    """Solves both margins of (38) for Δ_z (by the secant rule) and the margin.

    Raises:
        InputError: it does not converge in 20 walks.
    """
    # h̄_P = margin + offset and h̄_DCBF = margin + ripple on the window.
    wanted = PAPER_DCBF - PAPER_PERIODIC
    error = [ripple - offset - wanted for ripple, offset in (measure(low), measure(high))]
    points = [low, high]
    for walks in range(3, 21):
        slope = (error[-1] - error[-2]) / (points[-1] - points[-2])
        points.append(points[-1] - error[-1] / slope)
        ripple, offset = measure(points[-1])
        error.append(ripple - offset - wanted)
        if abs(error[-1]) < _TOLERANCE:
            return Calibration(points[-1], PAPER_PERIODIC - offset, ripple, walks)
    raise InputError(f"the calibration did not converge: {error[-1]:.2e} m/s are left after {len(points)} walks")


def statement(fit: Calibration) -> str:
    """The chosen and the fitted values, in words."""
    gait, mpc = CHOSEN["gait"], CHOSEN["mpc"]
    return (
        f"Calibrated, since the paper does not give it: chosen stride {gait['stride']} m, epsilon "
        f"{mpc['foothold_weight']:g} 1/s^2 per foothold, no double support, no standing start, gamma 1, one margin "
        f"for both bounds; fitted in {fit.walks} walks to the two margins of (38): Delta_z = "
        f"{1e3 * fit.amplitude:.2f} mm and margin = {1e3 * fit.margin:.2f} mm/s. The velocity then rises "
        f"{1e3 * fit.ripple:.2f} mm/s over its mean."
    )


if __name__ == "__main__":
    print(statement(calibrate()))
