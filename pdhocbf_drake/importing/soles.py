"""The soles of a model: the largest rectangle under each foot, on its lowest points or on its largest flat side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from pydrake.geometry import Role
from pydrake.math import RigidTransform, RollPitchYaw, RotationMatrix
from pydrake.multibody.tree import RigidBody
from scipy.spatial import ConvexHull, QhullError

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.roles import Axes, Leg
from pdhocbf_drake.robot.sole_fit import largest_rectangle

_MILLIMETRE = 1e-3
_FLAT = 0.3  # of a foot's footprint, which a level sole covers at least
_STEEPEST = np.cos(np.deg2rad(40.0))  # of a sole with all joints at zero


class SoleFound(NamedTuple):
    """A sole.

    Attributes:
        link: the body that it is seen in. pose: of its centre in that body, x ahead, z up.
        half_size: half length and half width (2,) [m]. source: what it was found from.
        tilt: of the sole with all joints at zero [rad].
    """

    link: RigidBody
    pose: RigidTransform
    half_size: np.ndarray
    source: str
    tilt: float

    @property
    def entries(self) -> dict[str, object]:
        """Its keys in a robot file."""
        angles = np.clip(np.round(RollPitchYaw(self.pose.rotation()).vector(), 9) + 0.0, -np.pi, np.pi)
        entries: dict[str, object] = {
            "link": self.link.name(),
            "xyz": (np.round(self.pose.translation(), 4) + 0.0).tolist(),
        }
        if abs(angles).max() > 1e-6:
            entries["rpy"] = angles.tolist()
        return entries | {"half_size": self.half_size.tolist()}


def find_sole(model: ParsedModel, leg: Leg, axes: Axes) -> SoleFound:
    """The sole of a leg; its half size is rounded down to half millimetres.

    Raises:
        ModelError: the foot has no geometry, or none with a flat side below.
    """
    last = max((joint for joint in leg.joints.values()), key=lambda joint: len(model.chain(joint.child_body())))
    foot = last.child_body()
    bodies = model.moved_by(last)
    level = RotationMatrix(np.column_stack([axes.ahead, axes.left, axes.up]))
    geometry = False
    for role, source in ((Role.kProximity, "contact geometry"), (Role.kIllustration, "visual geometry")):
        points = model.points(bodies, (role,), RigidTransform(level, np.zeros(3)))
        geometry = geometry or len(points) > 0
        for turn in (level, _turned(points, level)):
            found = None if turn is None else _fitted(model, foot, points, turn)
            if turn is not None and found is not None:
                tilt = float(np.arccos(np.clip(turn.matrix()[:, 2] @ axes.up, -1.0, 1.0)))
                return SoleFound(foot, *found, source, tilt)
    what = "none that is flat below" if geometry else "none"
    raise ModelError(f"the model has no foot geometry: of {foot.name()} and what hangs from it there is {what}")


def _fitted(
    model: ParsedModel, foot: RigidBody, points: np.ndarray, turn: RotationMatrix
) -> tuple[RigidTransform, np.ndarray] | None:
    """Pose in the foot and half size of the sole with that orientation, if it covers enough of the footprint."""
    if len(points) < 3:
        return None
    seen = points @ turn.matrix()
    rectangle = largest_rectangle(seen)
    if rectangle is None or 4.0 * np.prod(rectangle.half_size) < _FLAT * np.prod(np.ptp(seen[:, :2], axis=0)):
        return None
    there = RigidTransform(turn, turn.matrix() @ rectangle.centre)
    half = np.floor(2.0 * rectangle.half_size / _MILLIMETRE + 1e-3) * _MILLIMETRE / 2.0
    if not half.min() > 0.0:
        return None
    return model.plant.EvalBodyPoseInWorld(model.context, foot).inverse() @ there, np.round(half, 4)


def _turned(points: np.ndarray, level: RotationMatrix) -> RotationMatrix | None:
    """The orientation in which the largest side of the points' hull that looks down lies on the ground."""
    try:
        hull = ConvexHull(points)
    except (QhullError, ValueError):
        return None
    up = level.matrix()[:, 2]
    corners = hull.points[hull.simplices]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2.0
    sides: dict[tuple[float, ...], float] = {}
    for equation, area in zip(hull.equations.round(4), areas, strict=True):
        if -equation[:3] @ up > _STEEPEST:
            sides[tuple(equation)] = sides.get(tuple(equation), 0.0) + float(area)
    if not sides:
        return None
    z = -np.array(max(sides, key=lambda side: sides[side])[:3])
    z /= np.linalg.norm(z)
    x = level.matrix()[:, 0] - level.matrix()[:, 0] @ z * z
    x /= np.linalg.norm(x)
    return RotationMatrix(np.column_stack([x, np.cross(z, x), z]))


def made_alike(left: SoleFound, right: SoleFound) -> tuple[SoleFound, SoleFound]:
    """Both soles with the smaller half size, where the two differ by less than a tenth."""
    least = np.minimum(left.half_size, right.half_size)
    if (np.maximum(left.half_size, right.half_size) < 1.1 * least).all():
        return left._replace(half_size=least), right._replace(half_size=least)
    return left, right
