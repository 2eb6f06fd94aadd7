"""A certificate as data for `certify.json` and as lines for the terminal."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pdhocbf_drake.sets.disturbance import Largest
from pdhocbf_drake.sets.invariant_set import InvariantSet
from pdhocbf_drake.sets.user_system import LinearSystemConfig
from pdhocbf_drake.studies.certify.certificate import AxisCertificate, BoundCertificate
from pdhocbf_drake.studies.certify.disturbance_report import (
    disturbance_data,
    disturbance_lines,
    largest_data,
    sides_or_corners,
)
from pdhocbf_drake.studies.certify.pushes import kick_range, push_range
from pdhocbf_drake.studies.certify.scenario_certificate import ScenarioCertificate
from pdhocbf_drake.studies.certify.trial import Trial
from pdhocbf_drake.studies.shared.stepping_template import area

PUSH_SECONDS = 0.1  # as in `pdhocbf push`
_INPUT_LIMIT = "an input limit, since the ZMP is an input of the template: "
_COUNTED = "all sets here are those under it"
_LEFT_OUT = "left out, since in double support no ZMP keeps it for every step that may have been chosen"


def certificate_data(found: ScenarioCertificate, seconds: float, trial: Trial | None = None) -> dict[str, Any]:
    """The contents of `certify.json`: the main axis at the top level, both axes under `axes`."""
    axes = {name: _axis(found, axis) for axis, name in enumerate("xy")}
    main = axes["xy"[found.main_axis]]
    failing = [(name, data["first_failing_phase"]) for name, data in axes.items() if not data["enforceable"]]
    return {
        "schema": 1,
        "scenario": found.scenario.name,
        "axis": "xy"[found.main_axis],
        "reach": found.reach,
        "mass": found.mass,
        "push_seconds": PUSH_SECONDS,
        "units": {"area": "m²/s", "vertices": "m, m/s", "push": "N s", "kick": "m/s"},
        **main,
        "enforceable": not failing,
        "first_failing_phase": failing[0][1] if failing else None,
        "seconds": seconds,
        **disturbance_data(found),
        "axes": axes,
        "trial": None if trial is None else trial._asdict(),
    }


def _axis(found: ScenarioCertificate, axis: int) -> dict[str, Any]:
    certificate = found.axes[axis]
    phases = _phases(found, axis, certificate.kept)
    same = certificate.kept is certificate.unbounded
    return {
        **_result(certificate.kept),
        "orbit_inside": _orbit_inside(found, axis),
        "area_share": share(certificate, certificate.kept),
        "phases": phases,
        "residual": _number(certificate.kept.residual),
        "barriers": {bound.barrier.name: _bound(certificate, bound) for bound in certificate.bounds},
        "input_limits": {b.name: True for b in certificate.input_limits}
        | {b.name: False for b in certificate.left_out},
        "without_barriers": {
            **_result(certificate.unbounded),
            "phases": phases if same else _phases(found, axis, certificate.unbounded),
        },
    }


def _result(sets: InvariantSet) -> dict[str, Any]:
    return {
        "enforceable": sets.enforceable,
        "first_failing_phase": sets.first_failing_phase,
        "sweeps": sets.sweeps,
        "seconds": sets.seconds,
    }


def share(certificate: AxisCertificate, sets: InvariantSet) -> float | None:
    """Area of `sets` over that of the set without barriers, mean over the phases; None where the latter is empty.

    A state counts as kept by the ψ rows if it is in their set with some ψ_1, that is some ZMP.
    """
    phases = range(certificate.template.period)
    whole = [area(certificate.section(phase, certificate.unbounded)) for phase in phases]
    left = [area(certificate.section(phase, sets)) for phase in phases]
    return None if min(whole) == 0.0 else float(np.mean(np.array(left) / np.array(whole)))


def _bound(certificate: AxisCertificate, bound: BoundCertificate) -> dict[str, Any]:
    psi_rows = None
    if bound.rows is not None:
        gamma = [getattr(alpha, "gamma", None) for alpha in bound.barrier.class_k]
        psi_rows = {"gamma": gamma, **_result(bound.rows), "area_share": share(certificate, bound.rows)}
    return {
        **_result(bound.kept),
        "is_barrier": not bound.failing,
        "failing_phases": list(bound.failing),
        "area_share": share(certificate, bound.kept),
        "psi_rows": psi_rows,
    }


def _phases(found: ScenarioCertificate, axis: int, sets: InvariantSet) -> list[dict[str, Any]]:
    template = found.axes[axis].template
    ticks = max(1, round(PUSH_SECONDS / template.tick))
    listed = []
    for phase in range(template.period):
        part, state = template.section(sets, phase), found.orbit[axis, phase]
        push, kick = push_range(template, sets, phase, state, ticks), kick_range(template, sets, phase, state)
        listed.append({
            "phase": phase,
            "area": area(part),
            "vertices": [] if part is None else part.outline.tolist(),
            "push_max": _number(found.mass * push.high),
            "push_min": _number(found.mass * push.low),
            "kick_max": _number(kick.high),
            "kick_min": _number(kick.low),
        })  # fmt: skip
    return listed


def _orbit_inside(found: ScenarioCertificate, axis: int) -> bool:
    template, kept = found.axes[axis].template, found.axes[axis].kept
    parts = (template.section(kept, phase) for phase in range(template.period))
    pairs = zip(parts, found.orbit[axis, :, :2], strict=False)  # the orbit has two steps
    return all(part is not None and part.violation(state) <= 0.0 for part, state in pairs)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def system_data(
    config: LinearSystemConfig, found: InvariantSet, seconds: float, largest: Largest | None = None
) -> dict[str, Any]:
    """The contents of `certify.json` for a user's own system; pushes are for walks only, and null here."""
    phases = [
        {
            "phase": phase,
            "area": part.volume(),
            "free": part.free,
            "vertices": part.vertices.tolist(),
            "rows": part.A.tolist(),
            "bounds": part.b.tolist(),
            "push_max": None,
            "push_min": None,
        }
        for phase, part in enumerate(found.sets)
    ]
    data = {"schema": 1, "scenario": config.name, **_result(found), "phases": phases}
    data |= {"residual": _number(found.residual), "seconds": seconds}
    if largest is None:
        return data | largest_data(None, None)
    return data | largest_data(sides_or_corners(config.disturbances()), [("", (), None, largest.scale)])


def certificate_lines(data: dict[str, Any]) -> list[tuple[str, str]]:
    """The main results as (name, value)."""
    lines = []
    for name, axis in data["axes"].items():
        for barrier, bound in axis["barriers"].items():
            lines.append((f"{name}: {barrier}", _verdict(bound)))
            lines.append(("", f"{_percent(bound['area_share'])} of the area without it is left"))
            if bound["psi_rows"] is not None:
                rows = bound["psi_rows"]
                kept = f"{_percent(rows['area_share'])} is left" if rows["enforceable"] else "they can't be kept"
                lines.append(("", f"with its psi rows, gamma {rows['gamma']}: {kept}"))
        for barrier, counted in axis["input_limits"].items():
            lines.append((f"{name}: {barrier}", _INPUT_LIMIT + (_COUNTED if counted else _LEFT_OUT)))
        if len(axis["barriers"]) > 1:
            together = "can be kept together" if axis["enforceable"] else "can't be kept together"
            lines.append((f"{name}: all barriers", f"{together}; {_percent(axis['area_share'])} of the area is left"))
        lines.append((f"{name}: nominal orbit", "inside the set" if axis["orbit_inside"] else "not inside the set"))
        for what, phases in (("", axis["phases"]), (" without barriers", axis["without_barriers"]["phases"])):
            if what and not axis["barriers"]:
                continue
            forward, backward = ([p[key] for p in phases] for key in ("push_max", "push_min"))
            if None not in forward + backward:
                text = f"{_span(forward)} along +{name}, {_span(backward)} along -{name}"
                lines.append(
                    (f"{name}: push{what}", f"withstands {text}, by the phase at which it begins (0.1 s long)")
                )
    lines += disturbance_lines(data)
    lines.append(("time", f"{data['seconds']:.1f} s"))
    return lines


def _span(impulses: list[float]) -> str:
    """The least and the largest of signed impulses, as sizes."""
    sizes = sorted(abs(impulse) for impulse in impulses)
    return f"{sizes[0]:.3g} to {sizes[-1]:.3g} N s"


def _verdict(bound: dict[str, Any]) -> str:
    if not bound["enforceable"]:
        return f"not enforceable: going backward, no state is left at phase {bound['first_failing_phase']}"
    if bound["is_barrier"]:
        return "enforceable, and h >= 0 is a barrier by itself"
    count, first = len(bound["failing_phases"]), bound["failing_phases"][0]
    return (
        "enforceable: the bound can be kept for ever from the certified set, "
        f"and not from all of h >= 0 at {count} phases, first at {first}"
    )


def _percent(value: float | None) -> str:
    return "nothing" if value is None else f"{100 * value:.1f} %"
