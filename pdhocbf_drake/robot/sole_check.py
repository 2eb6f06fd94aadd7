"""Check of a declared sole against the geometry of its foot."""

from __future__ import annotations

import numpy as np

from pdhocbf_drake.robot.foot_points import ground_layer

_TOLERANCE = 0.15  # of a declared sole, as a share of its shorter half side
_DIRECTIONS = np.deg2rad(np.arange(0.0, 360.0, 3.0))
_AROUND = np.column_stack([np.cos(_DIRECTIONS), np.sin(_DIRECTIONS)])
_CORNERS = np.array([[x, y] for x in (-1.0, 1.0) for y in (-1.0, 1.0)])


def sole_fault(points: np.ndarray, half_size: np.ndarray) -> str:
    """What is wrong with a declared sole, in whose frame the points (n, 3) of the foot are; "" if nothing is.

    A corner c lies  max_u (u·c − max_p u·p)  beyond the convex hull of the lowest points p, u being unit vectors.
    Points without area, of which nothing can be said, have no fault.
    """
    if len(points) == 0:
        return ""
    allowed, low = _TOLERANCE * float(min(half_size)), float(points[:, 2].min())
    if abs(low) > allowed:
        return f"its plane is {1e3 * abs(low):.0f} mm {'above' if low < 0 else 'below'} the foot's lowest point"
    extents = (ground_layer(points)[:, :2] @ _AROUND.T).max(axis=0)
    if (extents + np.roll(extents, len(extents) // 2)).min() < allowed:
        return ""
    beyond = float((_CORNERS * half_size @ _AROUND.T - extents).max())
    if beyond <= allowed:
        return ""
    from pdhocbf_drake.robot.sole_fit import largest_rectangle  # here, since it loads scipy

    text, fits = f"its rectangle reaches {1e3 * beyond:.0f} mm beyond the foot", largest_rectangle(points)
    if fits is not None:
        half, (x, y) = fits.half_size, 1e3 * fits.centre[:2] + 0.0
        text += f"; one of half_size [{half[0]:.3f}, {half[1]:.3f}] fits, with its centre {_moved(x, y)}"
    return text


def _moved(ahead: float, left: float) -> str:
    """Where another centre is, seen from the declared one [mm]."""
    along = f"{abs(ahead):.0f} mm {'ahead' if ahead > 0 else 'behind'}"
    return f"{along} and {abs(left):.0f} mm to the {'left' if left > 0 else 'right'}"
