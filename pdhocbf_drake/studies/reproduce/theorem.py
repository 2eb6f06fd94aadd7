"""Lemma 1 and Theorem 1: the counterexample, the corrected statement, and a numerical demonstration of each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import legend, panels
from pdhocbf_drake.barriers import Barrier
from pdhocbf_drake.errors import InputError
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section, Table
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.shared.cases import PERIODIC

RATES = (0.3, 1.0, 1.5, 2.0, 2.5)  # γ of α(s) = γ s; the last three are class K too, and above s
_SEQUENCES, _TICKS = 10_000, 60


def theorem_1(runs: Runs) -> Section:
    """False for α(s) = 2s, true for α(s) ≤ s."""
    runs.report("Lemma 1 and Theorem 1 on random sequences")
    least = {gamma: (least_of_lemma(gamma), least_of_theorem(gamma)) for gamma in RATES}
    violation = max(0.0, -min(min(lowest) for gamma, lowest in least.items() if gamma <= 1))
    rows = [
        {
            "γ": f"{gamma:g}",
            "α(s) ≤ s": "yes" if gamma <= 1 else "no",
            "least b (Lemma 1)": f"{b:.4f}",
            "least h (Theorem 1)": f"{h:.4f}",
            "": "holds" if min(b, h) > -1e-12 else "violated",
        }
        for gamma, (b, h) in least.items()
    ]
    return Section(
        "Lemma 1 and Theorem 1",
        [
            "Lemma 1 as printed allows any class-K function. It is false: α(s) = 2s is one, and b(1) = b(0) − 2b(0) "
            "= −b(0) satisfies b(1) − b(0) ≥ −α(b(0)). It needs α(s) ≤ s for s ≥ 0; for α(s) = γs, 0 < γ ≤ "
            "1. Then ψ_{i−1}(k+1) = ψ_i(k) + (id − α_i)(ψ_{i−1}(k)) ≥ 0, and induction runs from ψ_m down to h.",
            "Corrected Theorem 1: if ψ_i(0) ≥ 0 for all i < m, ψ_m(k) ≥ 0 for all k, and every α_i(s) ≤ s on s ≥ 0, "
            "then h(k) ≥ 0 for all k. Neither a periodic trajectory (7) nor a periodic controller is used; (7) would "
            "even exclude the paper's own transient of 0–2 s. Only the functions h(k, ·) are periodic.",
            f"This library refuses such a function when a barrier is made: “{refusal()}”.",
        ],
        [_figure()],
        [Table(f"Least value over {_SEQUENCES:,} random sequences with ψ_m, ψ_i(0) ≥ 0 (Theorem 1 with m = 2)", rows)],
        [
            Number("Lemma 1 with alpha(s) = 2s: b(1)/b(0), claimed at least", 0.0, counterexample()[1], "1"),
            Number(
                "largest violation of h >= 0 under the corrected Lemma 1 and Theorem 1 (gamma <= 1)",
                0.0,
                violation,
                "1",
                1e-12,
            ),
        ],
        "True with one more hypothesis, α(s) ≤ s, and one fewer: the trajectory need not be periodic.",
    )


def counterexample(gamma: float = 2.0, ticks: int = 12) -> NDArray[np.float64]:
    """b with b(k+1) − b(k) = −γ b(k) from b(0) = 1: Lemma 1's inequality holds with equality."""
    return np.asarray((1.0 - gamma) ** np.arange(ticks), dtype=float)


def least_of_lemma(gamma: float) -> float:
    """Least b(k) over random sequences with b(0) ≥ 0 and b(k+1) − b(k) + γ b(k) = ψ(k) ≥ 0."""
    random = np.random.default_rng(1)
    b = random.exponential(size=_SEQUENCES)
    lowest = b.min()
    for _ in range(_TICKS):
        b = np.clip((1 - gamma) * b + _sparse(random), -1e6, 1e6)
        lowest = min(lowest, b.min())
    return float(max(lowest, -999.0))


def least_of_theorem(gamma: float) -> float:
    """Least h(k) for m = 2: random ψ_2 ≥ 0, ψ_1(0) ≥ 0, h(0) ≥ 0."""
    random = np.random.default_rng(2)
    h, psi_1 = random.exponential(size=(2, _SEQUENCES))
    lowest = h.min()
    for _ in range(_TICKS):
        h, psi_1 = (1 - gamma) * h + psi_1, (1 - gamma) * psi_1 + _sparse(random)
        h, psi_1 = np.clip([h, psi_1], -1e6, 1e6)
        lowest = min(lowest, h.min())
    return float(max(lowest, -999.0))


def refusal() -> str:
    """The error message for a barrier with α(s) = 2s; empty if it is accepted."""
    try:
        Barrier("demo", lambda k, x: x[0], 1, [lambda s: 2.0 * s])
    except InputError as error:
        return str(error)
    return ""


def _sparse(random: np.random.Generator) -> NDArray[np.float64]:
    """Values ≥ 0 for every sequence, most of them 0, since equality is the worst case."""
    return random.exponential(size=_SEQUENCES) * (random.uniform(size=_SEQUENCES) < 0.2)


def _figure() -> Picture:
    figure, (axes,) = panels(1, height=2.7)
    data: dict[str, np.ndarray] = {"k [ticks]": np.arange(12)}
    styles = {0.3: (palette.CASES[PERIODIC], "-"), 1.0: (palette.RUNS[0], "-."), 1.5: (palette.RUNS[4], "--")}
    for gamma, (colour, style) in {**styles, 2.0: (palette.RUNS[1], ":")}.items():
        b = data[f"b, gamma = {gamma:g}"] = counterexample(gamma)
        axes.plot(b, "o", ls=style, color=colour, label=f"α(s) = {gamma:g}s", ms=4)
    axes.axhline(0.0, color=palette.LIMIT, lw=1.0)
    axes.set(xlabel="k [ticks]", ylabel="b [1]")
    legend(axes, 4)
    caption = "Lemma 1 with equality, b(k+1) = b(k) − α(b(k)): b becomes negative as soon as α(s) > s."
    return Picture("lemma1", caption, figure, data)
