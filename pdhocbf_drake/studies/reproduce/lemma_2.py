"""Lemma 2: the walk of the settled template under (33), (34), both, and both as printed."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import legend, panels
from pdhocbf_drake.mpc.plan import Reason
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section, Table
from pdhocbf_drake.studies.reproduce.runs import Request, Runs
from pdhocbf_drake.studies.reproduce.stability import VARIANTS, Attempt, attempt
from pdhocbf_drake.studies.shared.template import settled

_FIRST, _TICKS = 800, 40  # one step of the settled walk
FIXED: Request = (
    "vhip_nobarrier",
    "{gait: {com_height_amplitude: 0.0}, mpc: {step_tolerance: [0.0, 0.0], stance_width_min: 0.0}}",
)
FREE: Request = ("vhip_nobarrier", "")
_ONE, _MATCHING, _PRINTED = "(33), matching", "(33) and (34), matching", "(33), literal"
_BOTH, _ETA = "(33) and (34), literal", "(33), η for ω"
_STYLES = {
    _ONE: (palette.MEASURED_COM, "-"),
    _PRINTED: (palette.RUNS[0], "--"),
    _BOTH: (palette.RUNS[1], "-."),
    _ETA: (palette.RUNS[3], ":"),
}


def lemma_2(runs: Runs) -> Section:
    """Equivalent under matching discretisation, contradictory under the literal one."""
    fixed = attempts(runs, FIXED, (_ONE, _MATCHING, _PRINTED, _BOTH))
    adaptive = attempts(runs, FREE, tuple(VARIANTS))
    rows = [
        {
            "rows": name,
            "fixed footholds": in_words(fixed[name]) if name in fixed else "–",
            "adaptive footholds": in_words(tried),
            "velocity differs by [mm/s]": f"{1e3 * difference(tried, adaptive[_ONE]):.2g}" if tried.planned else "–",
        }
        for name, tried in adaptive.items()
    ]
    walk = runs.walk(FIXED)
    horizon, tick, eta = walk.mpc.config.horizon, walk.gait.config.tick, float(walk.vhip.eta[0])
    omega, time = math.sqrt(eta), horizon * tick
    change, until = difference(adaptive[_MATCHING], adaptive[_ONE]), "ticks until infeasible"
    return Section(
        "Lemma 2: (33) and (34) are one statement",
        [
            "With the divergent component of the discretised template, e_{k+1} = λ_k e_k − δu_k, both rows say "
            "e_{k+H} = e_k. Alone or together they demand the same walk. As printed, (33) uses the exponentials of "
            "continuous time and (34) the Euler model (23): two rows that are almost, but not quite, parallel. Where "
            "the footholds may move, the QP can pay for the difference; where they are fixed, it cannot.",
            f"The letter η stands for (z̈+g)/z ≈ {eta:.1f} 1/s² in (22) and for a rate in (28)–(34), which must be ω "
            f"= √η ≈ {omega:.1f} 1/s. Over the horizon the divergent component grows by e^(ωHδ) = "
            f"{math.exp(omega * time):.0f} (Euler: {(1 + omega * tick) ** horizon:.1f}); taken to the letter, e^(ηHδ) "
            f"= {math.exp(eta * time):.1e}.",
        ],
        [_figure(adaptive)],
        [Table(f"A settled walk goes on for {_TICKS} ticks with these rows", rows)],
        [
            Number(
                "(33) with (34), matching: largest difference in velocity from (33) alone", 0.0, change, "m/s", 1e-5
            ),
            Number(f"(33) with (34), literal, footholds fixed: {until}", None, fixed[_BOTH].planned, "ticks"),
            Number(f"(33) with eta for omega: {until}", None, adaptive[_ETA].planned, "ticks"),
        ],
        finding(fixed, adaptive),
    )


def finding(fixed: Mapping[str, Attempt], adaptive: Mapping[str, Attempt]) -> str:
    """The effect of (34) beside (33), discretised to match and as printed, from the attempts by variant."""
    change = 1e3 * difference(adaptive[_MATCHING], adaptive[_ONE])
    return (
        f"Discretised to match the model, (34) beside (33): {in_words(adaptive[_MATCHING])}, with a velocity that "
        f"differs by {change:.2g} mm/s from that of (33) alone. Both as printed, with fixed footholds: "
        f"{in_words(fixed[_BOTH])}."
    )


def literal_attempts(runs: Runs) -> tuple[Attempt, Attempt]:
    """η for ω in (33), and both rows as printed with fixed footholds."""
    return attempts(runs, FREE, (_ETA,))[_ETA], attempts(runs, FIXED, (_BOTH,))[_BOTH]


def attempts(runs: Runs, request: Request, names: Sequence[str]) -> dict[str, Attempt]:
    """These variants, each from the same settled walk on."""
    mpc = runs.walk(request).mpc
    memory, found = settled(mpc, _FIRST), {}
    for name in names:
        runs.report(f"Lemma 2 with {'fixed' if request == FIXED else 'adaptive'} footholds: {name}")
        found[name] = attempt(mpc, memory, _FIRST, _TICKS, VARIANTS[name])
    return found


def difference(tried: Attempt, base: Attempt) -> float:
    """Largest difference in velocity while both walk [m/s]; NaN if the first one does not walk at all."""
    return float(np.abs(tried.speed - base.speed[: tried.planned]).max()) if tried.planned else float("nan")


def in_words(tried: Attempt) -> str:
    """How far an attempt walked, in words."""
    if tried.reason == Reason.SOLVED:
        return "walks"
    if tried.planned == 0:
        return "no solution at the first tick"
    return f"no solution after {tried.planned} tick{'s' * (tried.planned != 1)}"


def _figure(found: Mapping[str, Attempt]) -> Picture:
    figure, (axes,) = panels(1, height=2.9)
    data: dict[str, np.ndarray] = {"tick after the change": np.arange(_TICKS)}
    for name, (colour, style) in _STYLES.items():
        tried, speed = found[name], np.full(_TICKS, np.nan)
        speed[: tried.planned] = tried.speed
        axes.plot(speed, color=colour, ls=style, label=name)
        data[f"CoM velocity, {name} [m/s]"] = speed
        if tried.reason != Reason.SOLVED:
            last = max(0, tried.planned - 1)
            speed[0] = found[_ONE].speed[0]  # where it begins
            axes.plot(last, speed[last], "X", color=colour, ms=9)
    axes.set(xlabel="time after these rows took over [ticks]", ylabel="CoM velocity in x [m/s]")
    legend(axes, 4)
    caption = (
        "Lemma 2, adaptive footholds: the walk under each reading of the rows; a cross: no solution from there on."
    )
    return Picture("lemma2", caption, figure, data)
