"""Fig. 1: the Van der Pol oscillator with and without barriers, β = 0 as in the paper, and β = 1 beyond it."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.analysis.drawing import label, legend, panels, time_axis
from pdhocbf_drake.barriers import check_relative_degree, input_interval
from pdhocbf_drake.oscillator.config import VanDerPolConfig
from pdhocbf_drake.oscillator.van_der_pol_tube import Run, VanDerPolTube
from pdhocbf_drake.studies.reproduce.report import Number, Picture, Section, Table
from pdhocbf_drake.studies.reproduce.runs import Runs
from pdhocbf_drake.studies.shared.cases import NONE, PERIODIC

HARMONIC = VanDerPolConfig(tube=(0.05, 0.05))
LIMIT_CYCLE = VanDerPolConfig(beta=1.0, ticks_per_period=666, initial_state=(2.0, 0.0), tube=(0.2, 0.2))
_TICKS = 3000
_UNITS = ("1", "1/s")


def figure_1(runs: Runs) -> Section:
    """Both oscillators, their tubes, the input, and the room that the four barriers leave it."""
    pictures, rows = [], []
    growth, degrees = np.nan, [0, 0, 0, 0]
    for name, config in (("fig1", HARMONIC), ("fig1_limit_cycle", LIMIT_CYCLE)):
        runs.report(f"Van der Pol with beta = {config.beta:g}")
        tube = VanDerPolTube(config)
        wanted = np.zeros(_TICKS) if config.beta == 0 else 0.6 * np.cos(config.tick * np.arange(_TICKS))
        held, free = tube.run(_TICKS, wanted=wanted), tube.run(_TICKS, filtered=False, wanted=wanted)
        room = np.array([input_interval(tube.system, tube.barriers, k, x) for k, x in enumerate(held.states[:-1])])
        pictures.append(_picture(name, tube, held, free, room))
        h = np.array([[b.h(k, x) for b in tube.barriers] for k, x in enumerate(held.states)])
        outside = np.array([min(b.h(k, x) for b in tube.barriers) < 0 for k, x in enumerate(free.states)])
        rows.append({
            "β": f"{config.beta:g}",
            "period [ticks]": f"{config.ticks_per_period}",
            "least h with barriers": f"{h.min():.4f}",
            "leaves the tube without": f"{np.argmax(outside) * config.tick:.2f} s" if outside.any() else "never",
            "least room in the tube [1/s²]": f"{tube.worst.width:.3f}",
            "least room on the way [1/s²]": f"{np.ptp(room, axis=1).min():.2f}",
            "largest |u| [1/s²]": f"{np.abs(held.inputs).max():.3f}",
        })  # fmt: skip
        if config.beta == 0:
            radius = np.linalg.norm(free.states, axis=1)
            degrees = [check_relative_degree(barrier, tube.system)[0] or 0 for barrier in tube.barriers]
            growth = 100 * (radius[round(2 * np.pi / config.tick)] / radius[0] - 1)
    exact = 100 * ((1 + HARMONIC.tick**2) ** (np.pi / HARMONIC.tick) - 1)
    return Section(
        "Fig. 1: the Van der Pol oscillator",
        [
            "Equation (17) does not hold for the discretisation (16): Euler multiplies the amplitude by √(1+δ²) a "
            f"tick, {exact:.2f} % a revolution, and 2π/δ = 628.3 is no whole number. Left alone, the oscillation "
            "leaves any tube; the barriers hold it in one whose period is a whole number of ticks.",
            "The x₁ barriers have relative degree 2 and the x₂ barriers 1, computed from the dynamics, as the paper "
            "says. All four share one input. That they can be kept together is not automatic: it is a linear program "
            "per phase over the whole safe set, and here some room is left everywhere (“least room in the tube”).",
        ],
        pictures,
        [Table("Four barriers, one input", rows)],
        [
            Number("growth of (16) per revolution with beta = 0, (17) says", 0.0, float(growth), "%"),
            Number("relative degree of the x1 barriers, (18)", 2, degrees[0], "1", 0.0),
            Number("relative degree of the x2 barriers, (18)", 1, degrees[2], "1", 0.0),
        ],
        "The barriers hold the state as in Fig. 1; they counteract the drift of the paper's own discretisation.",
    )


def _picture(name: str, tube: VanDerPolTube, held: Run, free: Run, room: np.ndarray) -> Picture:
    """Both states and the input; `room` holds the least and the largest input that the barriers allow, (T, 2)."""
    figure, axes = panels(3, height=2.1)
    beta, green = tube.config.beta, palette.CASES[PERIODIC]
    time = tube.config.tick * np.arange(_TICKS + 1)
    data = {"time [s]": time[:-1]}
    for i, unit in enumerate(_UNITS):
        centre, half = np.resize(tube.orbit[:, i], _TICKS + 1), tube.config.tube[i]
        axes[i].fill_between(time, centre - half, centre + half, color=palette.BOX, alpha=0.6, lw=0, label="tube (18)")
        axes[i].plot(time, free.states[:, i], color=palette.CASES[NONE], lw=1.2, ls="--", label="without barriers")
        axes[i].plot(time, held.states[:, i], color=green, label="with P-DHOCBF")
        label(axes[i], f"x{i + 1}", unit)
        data[f"x{i + 1} with [{unit}]"] = held.states[:-1, i]
        data[f"x{i + 1} without [{unit}]"] = free.states[:-1, i]
        data[f"x{i + 1} tube centre [{unit}]"] = centre[:-1]
    lower, upper = room.T
    axes[2].fill_between(time[:-1], lower, upper, color=green, alpha=0.25, lw=0, label="inputs that all four allow")
    axes[2].plot(time[:-1], held.inputs, color=palette.LIMIT, lw=1.0, label="input applied")
    reach = 2.5 * max(0.1, float(np.abs(held.inputs).max()))
    axes[2].set_ylim(-reach, reach)
    label(axes[2], "u", "1/s²")
    legend(axes[0], 3)
    legend(axes[2], 2)
    time_axis(axes)
    data |= {"u with [1/s²]": held.inputs, "u least [1/s²]": lower, "u largest [1/s²]": upper}
    given = "no input" if beta == 0 else "a wanted input of 0.6 cos(t)"
    caption = f"Fig. 1, β = {beta:g}: with P-DHOCBF and without ({given}); below, the input and the room for it."
    return Picture(name, caption, figure, data)
