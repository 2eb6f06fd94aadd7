"""Lemma 2: what (33), (34), both, and both as printed do to a settled walk of the template."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend
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
_BOTH, _ONE, _ETA = "(33) and (34), literal", "(33), matching", "(33), η for ω"
_MATCHING = "(33) and (34), matching"
_STYLES = {
    _ONE: (palette.MEASURED_COM, "-"),
    "(33), literal": (palette.RUNS[0], "--"),
    _BOTH: (palette.RUNS[1], "-."),
    _ETA: (palette.RUNS[3], ":"),
}


def lemma_2(runs: Runs) -> Section:
    """Equivalent under matching discretisation, contradictory under the literal one."""
    found = attempts(runs)
    base = found["adaptive"][_ONE]
    rows = []
    for name in VARIANTS:
        cells = [name]
        for feet in ("fixed", "adaptive"):
            tried = found[feet].get(name)
            cells.append("–" if tried is None else in_words(tried))
        adaptive = found["adaptive"].get(name)
        cells.append("–" if adaptive is None or not adaptive.planned else f"{1e3 * difference(adaptive, base):.2g}")
        rows.append(cells)
    walk = runs.walk(*FIXED)
    horizon, tick, eta = walk.mpc.config.horizon, walk.gait.config.tick, float(walk.vhip.eta[0])
    omega, time = math.sqrt(eta), horizon * tick
    matching = difference(found["adaptive"][_MATCHING], base)
    command = "pdhocbf reproduce --only lemma2"
    return Section(
        "Lemma 2: (33) and (34) are one statement",
        [
            "With the divergent component of the discretised template, e_{k+1} = λ_k e_k − δu_k, both rows say "
            "e_{k+H} = e_k. Alone or together they ask for the same walk. As printed, (33) uses the exponentials of "
            "continuous time and (34) the Euler model (23): two rows that are almost, but not quite, parallel. Where "
            "the footholds may give way the QP can pay for the difference; where they are fixed it cannot.",
            f"The letter η stands for (z̈+g)/z ≈ {eta:.1f} 1/s² in (22) and for a rate in (28)–(34), which must be ω "
            f"= √η ≈ {omega:.1f} 1/s. Over the horizon the divergent component grows by e^(ωHδ) = "
            f"{math.exp(omega * time):.0f} (Euler: {(1 + omega * tick) ** horizon:.1f}); taken to the letter, e^(ηHδ) "
            f"= {math.exp(eta * time):.1e}.",
        ],
        [_figure(found["adaptive"])],
        [
            Table(
                f"A settled walk goes on for {_TICKS} ticks with these rows",
                ("rows", "fixed footholds", "adaptive footholds", "velocity differs by [mm/s]"),
                rows,
            )
        ],
        [
            Number(
                "(33) with (34), matching: largest difference in velocity from (33) alone",
                0.0,
                matching,
                "m/s",
                command,
                1e-5,
            ),
            Number(
                "(33) with (34), literal, footholds fixed: ticks until infeasible",
                None,
                found["fixed"][_BOTH].planned,
                "ticks",
                command,
            ),
            Number(
                "(33) with eta for omega: ticks until infeasible",
                None,
                found["adaptive"][_ETA].planned,
                "ticks",
                command,
            ),
        ],
        finding(found),
    )


def finding(found: Mapping[str, Mapping[str, Attempt]]) -> str:
    """What the second row does beside the first, discretised to match and as printed; `found` as from `attempts`."""
    matching, printed = found["adaptive"][_MATCHING], found["fixed"][_BOTH]
    change = 1e3 * difference(matching, found["adaptive"][_ONE])
    return (
        f"Discretised to match the model, (34) beside (33): {in_words(matching)}, with a velocity that differs by "
        f"{change:.2g} mm/s from that of (33) alone. Both as printed, with fixed footholds: {in_words(printed)}."
    )


def attempts(runs: Runs) -> dict[str, dict[str, Attempt]]:
    """Every variant with adaptive footholds, and those that differ with fixed ones."""
    few = (_ONE, _MATCHING, "(33), literal", _BOTH)
    return {"fixed": attempts_of(runs, FIXED, few), "adaptive": attempts_of(runs, FREE, tuple(VARIANTS))}


def the_letter(runs: Runs) -> tuple[Attempt, Attempt]:
    """η for ω in (33), and both rows as printed with fixed footholds."""
    return attempts_of(runs, FREE, (_ETA,))[_ETA], attempts_of(runs, FIXED, (_BOTH,))[_BOTH]


def attempts_of(runs: Runs, request: Request, names: Sequence[str]) -> dict[str, Attempt]:
    """These variants, each from the same settled walk on."""
    walk = runs.walk(*request)
    memory = settled(walk.mpc, _FIRST)
    found = {}
    for name in names:
        runs.report(f"Lemma 2 with {'fixed' if request == FIXED else 'adaptive'} footholds: {name}")
        found[name] = attempt(walk.mpc, memory, _FIRST, _TICKS, VARIANTS[name])
    return found


def difference(tried: Attempt, base: Attempt) -> float:
    """Largest difference in velocity while both walk [m/s]."""
    if not tried.planned:
        return float("nan")
    return float(np.abs(tried.speed - base.speed[: tried.planned]).max())


def in_words(tried: Attempt) -> str:
    """How far an attempt walked, in words."""
    if tried.reason == Reason.SOLVED:
        return "walks"
    if tried.planned == 0:
        return "no solution at the first tick"
    return f"no solution after {tried.planned} tick{'s' * (tried.planned != 1)}"


def _figure(found: dict[str, Attempt]) -> Picture:
    figure = Figure(figsize=(8.5, 3.4))
    axes = figure.subplots()
    data: dict[str, np.ndarray] = {"tick after the change": np.arange(_TICKS)}
    for name, (colour, style) in _STYLES.items():
        speed = np.full(_TICKS, np.nan)
        speed[: found[name].planned] = found[name].speed
        axes.plot(speed, color=colour, ls=style, label=name)
        data[f"CoM velocity, {name} [m/s]"] = speed
        if found[name].reason != Reason.SOLVED:
            last = max(0, found[name].planned - 1)
            speed[0] = found[_ONE].speed[0]  # where it begins
            axes.plot(last, speed[last], "X", color=colour, ms=9)
    axes.set_xlabel("time after these rows took over [ticks]")
    label(axes, "CoM velocity in x", "m/s")
    legend(axes, 4)
    caption = (
        "Lemma 2, adaptive footholds: the walk under each reading of the rows; a cross marks where no solution is left."
    )
    return Picture("lemma2", caption, figure, data)
