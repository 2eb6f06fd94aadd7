"""Finds the two feet of a model and the moving joints that lead to them."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np
from pydrake.multibody.tree import Joint, RigidBody

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.robot.parsing import listed
from pdhocbf_drake.robot.per_joint import ROLES

FLAGS = "; name its feet with --left-foot and --right-foot"
"""What to do about feet that are not found."""

_SHOULDER = 0.35  # share of a limb's length that a hip is above the lowest of the body, at most
_LOW = 0.15  # of the base's height: links that reach so low stand on the ground


class Limb(NamedTuple):
    """What stands on the ground, and the moving joints that lead to it from the base, without those of the waist."""

    bodies: list[RigidBody]
    joints: tuple[Joint, ...]

    @property
    def name(self) -> str:
        """The name of its first body."""
        return str(self.bodies[0].name())


class Feet(NamedTuple):
    """Two limbs, and the joints that both hang from: the waist."""

    limbs: tuple[Limb, Limb]
    waist: tuple[Joint, ...]


def find_feet(model: ParsedModel, up: np.ndarray, named: tuple[str | None, str | None]) -> Feet:
    """The two feet: the end links that reach lowest, or those that are named.

    Args:
        model: the model. up: the direction up (3,).
        named: links of the left and right foot; None for those to be found.

    Raises:
        ModelError: a named link is not there, other than two limbs stand on the ground, or nothing has geometry.
    """
    ends = [_body(model, name) for name in named if name is not None]
    groups = [model.groups[_key(model, body)] for body in ends]
    if len(groups) < 2:
        groups = _standing(model, up)
    if len(groups) != 2:
        names = listed(bodies[0].name() for bodies in groups)
        stand = "1 limb stands" if len(groups) == 1 else f"{len(groups)} limbs stand"
        raise ModelError(f"{stand} on the ground, and a biped has two: {names}{FLAGS}")
    chains = [model.chain(bodies[0]) for bodies in groups]
    shared = 0
    while shared < min(map(len, chains)) and chains[0][shared].index() == chains[1][shared].index():
        shared += 1
    first, second = (Limb(bodies, chain[shared:]) for bodies, chain in zip(groups, chains, strict=True))
    return Feet((first, second), chains[0][:shared])


def _standing(model: ParsedModel, up: np.ndarray) -> list[list[RigidBody]]:
    """The end groups that reach lowest; of several in one limb that with the longest chain."""
    ends = {key: bodies for key, bodies in model.groups.items() if key and not _is_inner(model, key)}
    lowest = {key: _lowest(model, bodies, up) for key, bodies in ends.items()}
    ground = min(_lowest(model, bodies, up) for bodies in model.groups.values())
    low = [key for key in ends if lowest[key] < ground + _LOW * abs(ground)]
    if not low:
        raise ModelError(f"the model has no foot geometry: what reaches lowest is no end of a limb{FLAGS}")
    limbs: list[tuple[int, ...]] = []
    common = _shared(low)
    for key in sorted(low, key=len, reverse=True):
        if not any(key[: common + 1] == limb[: common + 1] for limb in limbs):
            limbs.append(key)
    return [ends[key] for key in sorted(limbs)]


def ways_up(model: ParsedModel) -> list[np.ndarray]:
    """For each two limbs of equally many joints, six or more, the unit vector from their last joints to their first."""
    ends = [key for key in model.groups if len(key) >= len(ROLES) and not _is_inner(model, key)]
    ways = []
    for first, other in combinations(ends, 2):
        if len(first) == len(other) and first[0] != other[0]:
            chains = [model.chain(model.groups[key][0]) for key in (first, other)]
            way = np.sum([model.place(chain[0]) - model.place(chain[-1]) for chain in chains], axis=0)
            if np.linalg.norm(way) > 1e-6:
                ways.append(way / np.linalg.norm(way))
    return ways


def are_arms(model: ParsedModel, feet: Feet, up: np.ndarray) -> bool:
    """Whether both limbs hang from high above the lowest of the body that they hang from, as arms do and legs don't."""
    highs = []
    for limb in feet.limbs:
        key = _key(model, limb.bodies[0])
        if not limb.joints or not key:
            return False
        first = model.place(limb.joints[0]) @ up
        held = len(key) - len(limb.joints)
        body = min(
            _lowest(model, bodies, up) for each, bodies in model.groups.items() if each == key[: len(each)][:held]
        )
        highs.append((first - body) / max(first - _lowest(model, limb.bodies, up), 1e-9))
    return min(highs) > _SHOULDER


def limb_centre(model: ParsedModel, limb: Limb) -> np.ndarray:
    """The mean of the points of a limb's geometry (3,) [m]; raises `ModelError` where it has none."""
    bodies = model.moved_by(limb.joints[0]) if limb.joints else limb.bodies
    points = model.points(bodies)
    if len(points) == 0:
        names = listed(body.name() for body in bodies)
        raise ModelError(f"the model has no foot geometry: nothing of {names} is drawn or collides")
    return np.asarray(points.mean(axis=0))


def _lowest(model: ParsedModel, bodies: list[RigidBody], up: np.ndarray) -> float:
    """The lowest height of the bodies' geometry, or where they have none of their origins [m]."""
    points = model.points(bodies)
    if len(points) == 0:
        origins = (model.plant.EvalBodyPoseInWorld(model.context, body).translation() for body in bodies)
        points = np.array(list(origins))
    return float((points @ up).min())


def _is_inner(model: ParsedModel, key: tuple[int, ...]) -> bool:
    """Whether other groups hang from this one."""
    return any(len(other) > len(key) and other[: len(key)] == key for other in model.groups)


def _shared(keys: list[tuple[int, ...]]) -> int:
    """The number of joints that all chains begin with."""
    count = 0
    while all(len(key) > count for key in keys) and len({key[count] for key in keys}) == 1:
        count += 1
    return count if len(keys) > 1 else 0


def _key(model: ParsedModel, body: RigidBody) -> tuple[int, ...]:
    return tuple(int(joint.index()) for joint in model.chain(body))


def _body(model: ParsedModel, name: str) -> RigidBody:
    for body in model.bodies:
        if body.name() == name:
            return body
    raise ModelError(f"the model has no link {name!r}; there are: {listed(body.name() for body in model.bodies)}")
