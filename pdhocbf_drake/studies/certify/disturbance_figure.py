"""How the safe tube shrinks under larger and larger disturbances."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pdhocbf_drake.analysis import palette
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.studies.certify.certificate import AxisCertificate
from pdhocbf_drake.studies.certify.disturbed import walk_sets
from pdhocbf_drake.studies.certify.phase_plots import phase_plots
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate

_SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)  # of the largest multiple


def disturbed_sections(found: ScenarioCertificate) -> Figure:
    """The sets in (c, v) at a few phases, for shares of the largest disturbance that leaves any."""
    axis = found.main_axis
    certificate = found.axes[axis]
    most, parts = _sets(certificate)
    shades = np.linspace(0.15, 0.9, len(_SHARES))

    def draw(plot: Axes, phase: int) -> None:
        for share, sets, shade in zip(_SHARES, parts, shades, strict=True):
            part = None if sets is None else certificate.section(phase, sets)
            if part is not None:
                named = f"{share * most:.3g} times" if share else "no disturbance"
                plot.fill(*part.outline.T, facecolor=palette.SAFE, alpha=shade, lw=0, label=named)
        plot.plot(*found.orbit[axis, phase, :2], "ko", ms=4, label="nominal orbit, here")

    return phase_plots(axis, certificate.template.period, draw, columns=6)


def _sets(certificate: AxisCertificate) -> tuple[float, list[InvariantSet | None]]:
    """The largest multiple for all barriers together, and the sets at each share of it; None where there are none."""
    names = tuple(bound.barrier.name for bound in certificate.bounds)
    most = next(row.found for row in certificate.largest if row.barriers == names and row.gamma is None)
    barriers, disturbance = [bound.barrier for bound in certificate.bounds], certificate.disturbance
    sets: list[InvariantSet | None] = [walk_sets(certificate.template, barriers)]
    for share in _SHARES[1:-1]:
        given = None if disturbance is None else disturbance.times(share * most.scale)
        before = sets[-1]
        within = before.sets if before is not None and before.enforceable else ()
        sets.append(walk_sets(certificate.template, barriers, given, within) if most.scale else None)
    return most.scale, [*sets, most.sets]
