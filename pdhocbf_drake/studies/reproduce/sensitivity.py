"""M as evidence: the choices that it depends on, and the bound that the gait's own ripple sets."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import legend, panels
from pdhocbf_drake.barriers import margin_ratio
from pdhocbf_drake.simulation.build import build_walk
from pdhocbf_drake.simulation.scenario import Scenario
from pdhocbf_drake.simulation.scenario_file import load_scenario
from pdhocbf_drake.studies.reproduce.calibration import PAPER_DCBF, PAPER_PERIODIC, SETTLED, forward_speed, free_walk
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.shared.cases import DCBF, PERIODIC

_NAME = "forward_speed"
VARIED: dict[str, tuple[str, tuple[float, ...]]] = {
    "stride": ("stride [m]", (0.10, 0.12, 0.14, 0.15, 0.17)),
    "com_height_amplitude": ("Δz [m]", (0.0, 0.006, 0.012, 0.0198, 0.0220)),
    "ticks_per_step": ("step time [ticks]", (36, 40, 44)),
    "gamma": ("γ [1]", (0.05, 0.3, 1.0)),
    "margin": ("margin [m/s]", (0.0015, 0.003, 0.0073, 0.02, 0.06)),
}
"""Axis label and values of each choice that is varied."""
_GAITS = ("stride", "com_height_amplitude", "ticks_per_step")
_TOO_SMALL = 0.001  # a margin under which the periodic bound holds the walk back [m/s]
_STEPS = 10  # over which M is measured once the walk has settled


def sensitivity(runs: Runs) -> Section:
    """M measured over five of the choices that the paper does not report."""
    data = load_scenario("paper_vhip").to_dict()
    found: dict[str, np.ndarray] = {}
    orbits: dict[str, np.ndarray] = {}
    for key, (_, values) in VARIED.items():
        runs.report(f"M over {key}")
        found[key] = np.array([measured(data, key, value, orbits) for value in values])
    gaits = np.concatenate([found[key] for key in _GAITS])[:, 1]
    spread, slow = found["margin"][:, 1], found["gamma"][:, 1]
    implied = "ripple of the velocity that (38) implies, one margin for both"
    ripple = float(found["com_height_amplitude"][3, 0])
    law = off_the_law(found)
    tight, nominal = held_back(data, _TOO_SMALL)
    return Section(
        "The meaning of M",
        [
            "Both cases walk the same, so M = (mean of V̄_P − v̄)/(V̄_DCBF − v̄): a property of where the two bounds "
            "were drawn. A constant bound has to clear the peak of the velocity; if both clear the velocity by the "
            "same least distance m, M = m/(m + r), with r the ripple: peak less mean. The lines are that formula; "
            "the points are walks, measured over ten steps once they have settled. With γ = 1 they lie on the lines to "
            f"{law:.1g} percentage points. A margin can be too small to be one: {1e3 * _TOO_SMALL:g} mm/s above the "
            f"walk, the periodic bound holds it back, to {tight:.3f} m/s of {nominal:.3f} after 24 s.",
            f"With the gait fixed, the choice of the margin alone moves M from {spread.min():.0f} % to "
            f"{spread.max():.0f} %; with the margin fixed, stride, Δz and step time move it from {gaits.min():.0f} % "
            f"to {gaits.max():.0f} %. γ leaves it at {slow[-1]:.0f} % unless it is so small that the constant barrier "
            f"forbids the ripple itself: at γ = {VARIED['gamma'][1][0]:g} the walk slows down and M is {slow[0]:.0f} "
            "%. Any M between 0 and 100 % is possible, and a whole family of gaits has M = 32.3 %, so it "
            "identifies none of them.",
        ],
        [_figure(found), _law(found)],
        [],
        [
            Number("least M over margins of 1.5 to 60 mm/s, the same walk", None, float(spread.min()), "%"),
            Number("largest M over the same margins", None, float(spread.max()), "%"),
            Number(
                f"speed under a periodic bound {1e3 * _TOO_SMALL:g} mm/s above the walk, 24 to 28 s", None, tight, "m/s"
            ),
            Number(implied, PAPER_DCBF - PAPER_PERIODIC, ripple, "m/s", 0.0006, True),
        ],
        "M says how closely the two bounds were drawn around one trajectory, not how two controllers differ.",
    )


def measured(data: dict[str, Any], key: str, value: float, orbits: dict[str, np.ndarray]) -> tuple[float, float]:
    """The ripple [m/s] and M [%] of the paper's walk with one choice changed.

    Args:
        data: the paper's scenario.
        key, value: the choice, one of `VARIED`, and its value.
        orbits: forward CoM velocity over a step by gait, filled in as needed.
    """
    gait, mpc = dict(data["gait"]), dict(data["mpc"])
    gamma = value if key == "gamma" else 1.0
    margin = value if key == "margin" else PAPER_PERIODIC
    if key in _GAITS:
        gait[key] = value
    if key == "ticks_per_step":
        # A slower step at the same speed; Lemma 2 needs a horizon of two steps.
        gait[key] = int(value)
        gait["stride"] *= value / 40
        mpc["horizon"] = 2 * int(value)
    period = gait["ticks_per_step"]
    ticks = period * (-(-SETTLED // period) + _STEPS)  # whole steps, and the last ones are settled
    name = repr(sorted(gait.items()))
    if name not in orbits:
        orbits[name] = free_walk(gait, mpc, ticks)[-period:]
    orbit = orbits[name]
    h = {}
    for case, values in ((PERIODIC, orbit + margin), (DCBF, np.full(1, orbit.max() + margin))):
        h[case] = (np.resize(values, ticks) - _bounded(gait, mpc, values, gamma, ticks))[-_STEPS * period :]
    return float(orbit.max() - orbit.mean()), 100 * margin_ratio(h[PERIODIC], h[DCBF])


def _bounded(gait: dict[str, Any], mpc: dict[str, Any], bound: np.ndarray, gamma: float, ticks: int) -> np.ndarray:
    """Forward CoM velocity of the template from a stand on under a bound on it, given over a step, (ticks,) [m/s]."""
    tabulated = {"kind": "tabulated", "values": bound.tolist()}
    barriers = {_NAME: {"bound": tabulated, "gamma": [gamma], "relative_degree": 2}}
    scenario = Scenario.from_dict({"system": "vhip", "gait": gait, "mpc": mpc, "barriers": barriers}, _NAME)
    return forward_speed(build_walk(scenario).mpc, ticks)


def held_back(data: dict[str, Any], margin: float) -> tuple[float, float]:
    """Mean speed of the paper's walk from 24 to 28 s with a periodic bound `margin` above it, and without one [m/s]."""
    orbit = free_walk(data["gait"], data["mpc"])[-data["gait"]["ticks_per_step"] :]
    speed = _bounded(data["gait"], data["mpc"], orbit + margin, 1.0, 2800)
    return float(speed[2400:].mean()), float(orbit.mean())


def off_the_law(found: dict[str, np.ndarray]) -> float:
    """Largest difference between M of the walks with γ = 1 and m/(m + r) [percentage points]."""
    gaits, margins = np.concatenate([found[key] for key in _GAITS]), found["margin"]
    m = np.array([*[PAPER_PERIODIC] * len(gaits), *VARIED["margin"][1]])
    ripple, measured_m = np.vstack([gaits, margins]).T
    return float(np.abs(measured_m - 100.0 * m / (m + ripple)).max())


def _figure(found: dict[str, np.ndarray]) -> Picture:
    figure = Figure(figsize=(8.5, 5.4))
    axes = figure.subplots(2, 3).ravel()
    for axis, (key, (name, values)) in zip(axes, VARIED.items(), strict=False):
        axis.plot(values, found[key][:, 1], "o-", color=palette.CASES[PERIODIC])
        axis.axhline(32.3, color=palette.LIMIT, ls=":", lw=1.0)
        axis.set(ylim=(0, 100), xlabel=name, ylabel="M [%]")
    axes[-1].axis("off")
    axes[-1].text(
        0.0, 0.6, "dotted: the paper's 32.3 %\npoints: settled walks of the\ntemplate, ten steps from 12 s", va="top"
    )
    data: dict[str, ArrayLike] = {
        "varied": [key for key, (_, values) in VARIED.items() for _ in values],
        "value": [value for _, values in VARIED.values() for value in values],
        "M [%]": np.concatenate([found[key][:, 1] for key in VARIED]),
    }
    caption = "M over the choices that the paper does not report, one varied at a time."
    return Picture("sensitivity", caption, figure, data)


def _law(found: dict[str, np.ndarray]) -> Picture:
    figure, (axes,) = panels(1, height=3.3)
    ripple, green = np.linspace(0, 0.045, 200), palette.CASES[PERIODIC]
    for m, colour in ((0.003, palette.RUNS[5]), (PAPER_PERIODIC, green), (0.015, palette.RUNS[4])):
        axes.plot(1e3 * ripple, 100 * m / (m + ripple), color=colour, label=f"m/(m + r), m = {1e3 * m:g} mm/s")
    gaits, margins = np.concatenate([found[key] for key in _GAITS]), found["margin"]
    axes.plot(1e3 * gaits[:, 0], gaits[:, 1], "o", color=green, label="walks, m = 7.3 mm/s")
    axes.plot(1e3 * margins[:, 0], margins[:, 1], "x", color=palette.LIMIT, label="one walk, m from 1.5 to 60 mm/s")
    axes.axhline(32.3, color=palette.LIMIT, ls=":", lw=1.0, label="the paper's 32.3 %")
    axes.set(ylim=(0, 100), xlabel="ripple r of the CoM velocity [mm/s]", ylabel="M [%]")
    legend(axes, 3)
    data = {"ripple [m/s]": np.append(gaits[:, 0], margins[:, 0]), "M [%]": np.append(gaits[:, 1], margins[:, 1])}
    caption = "M is set by the ripple of the gait and by the margin that one allows oneself."
    return Picture("margin_law", caption, figure, data)
