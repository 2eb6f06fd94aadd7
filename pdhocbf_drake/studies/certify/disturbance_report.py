"""What a certificate says of disturbances, as data for `certify.json` and as lines for the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pdhocbf_drake.barriers import AffineBarrier
from pdhocbf_drake.sets.disturbance import TOLERANCE
from pdhocbf_drake.sets.polytope import Array
from pdhocbf_drake.studies.certify.certificate import ScenarioCertificate

Row = tuple[str, tuple[str, ...], tuple[float, ...] | None, float]
"""Axis, names of the barriers, γ where their ψ rows are to be kept, and the largest multiple."""


def disturbance_data(found: ScenarioCertificate) -> dict[str, Any]:
    """The keys of a walk; null and empty without a disturbance.

    The largest multiple is that of the sets which the MPC's terminal set is made of: with a hard barrier those of its ψ
    rows, with a soft one those of h ≥ 0, along both axes.
    """
    rows = [
        ("xy"[axis], row.barriers, row.gamma, row.found.scale)
        for axis, certificate in enumerate(found.axes)
        for row in certificate.largest
    ]
    given = [certificate.disturbance for certificate in found.axes if certificate.disturbance is not None]
    if not given or not rows:
        return largest_data(None, None)
    hard, counted = found.scenario.mpc.barrier == "hard", []
    for axis, certificate in enumerate(found.axes):
        of_axis = [row for row in rows if row[0] == "xy"[axis]]
        own = {bound.barrier.name: _gamma(bound.barrier) for bound in certificate.bounds}
        with_rows = [row for row in of_axis if row[2] is not None and row[2] == own[row[1][0]]]
        names = tuple(own)
        counted += with_rows if hard and with_rows else [r for r in of_axis if r[1] == names and r[2] is None]
    boxes = [[list(box) for box in part.boxes] for part in given]
    same = boxes[0] == boxes[1] and len(boxes[0]) == 1
    data = largest_data(boxes[0][0] if same else dict(zip("xy", boxes, strict=True)), rows)
    return {**data, "disturbance_max": min(row[3] for row in counted)}


def _gamma(barrier: AffineBarrier) -> tuple[float | None, ...]:
    return tuple(getattr(alpha, "gamma", None) for alpha in barrier.class_k)


def sides_or_corners(corners: Sequence[Array]) -> list[Any]:
    """The half-widths of W [unit of each state], or where it is no box its corners by phase."""
    sides = np.max([np.abs(part).max(axis=0) for part in corners], axis=0)
    is_box = all(len(part) == 2 ** np.count_nonzero(sides) for part in map(_unique, corners))
    is_box = is_box and all(np.all(np.abs(part) == sides) for part in corners)
    return sides.tolist() if is_box else [part.tolist() for part in corners]


def largest_data(given: Any, rows: Sequence[Row] | None) -> dict[str, Any]:
    """`disturbance` as given, and what is found of it; null and empty without rows."""
    table = [{"axis": axis or None, "barriers": list(names), "gamma": None if gamma is None else list(gamma),
              "disturbance_max": scale} for axis, names, gamma, scale in rows or ()]  # fmt: skip
    return {
        "disturbance": given,
        "disturbance_max": None if rows is None else min(row[3] for row in rows),
        "disturbance_tolerance": None if rows is None else TOLERANCE,
        "disturbance_table": table,
    }


def _unique(points: Array) -> Array:
    return np.unique(points, axis=0)


def disturbance_lines(data: dict[str, Any]) -> list[tuple[str, str]]:
    """The results as (name, value); none without a disturbance."""
    if data["disturbance"] is None:
        return []
    most, share = data["disturbance_max"], data["disturbance_tolerance"]
    of_given = f"{most:.4g} times the given one at most (within {100 * share:g} %)"
    lines = [("disturbance", of_given if most else "none leaves any set")]
    for row in data["disturbance_table"] if len(data["disturbance_table"]) > 1 else ():
        name = ", ".join(row["barriers"]) or "without a bound"
        rows = "" if row["gamma"] is None else f", with its psi rows, gamma {row['gamma']}"
        lines.append(("", f"{row['axis']}: {row['disturbance_max']:.4g} times, {name}{rows}"))
    return lines
