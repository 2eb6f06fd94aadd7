"""Reads the legs of a model: which joints and soles are theirs, and where the robot looks."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.importing.directions import NAMES, facing, side_to_side, word
from pdhocbf_drake.importing.feet import FLAGS, Feet, are_arms, find_feet, limb_centre, ways_up
from pdhocbf_drake.importing.given import Given
from pdhocbf_drake.importing.inferred import Inferred, Sure, listed
from pdhocbf_drake.importing.parsed import ParsedModel
from pdhocbf_drake.importing.robot_file import Legs, leg_length
from pdhocbf_drake.importing.roles import find_leg
from pdhocbf_drake.importing.soles import find_sole, made_alike
from pdhocbf_drake.robot import SIDES


def read_legs(model: ParsedModel, given: Given) -> tuple[Legs, list[Inferred]]:
    """Both legs of a model, and what was inferred.

    The base's z axis is up, unless it is a biped with another one of its axes up, or with the way from the feet to
    the hips up, and not with z.

    Raises:
        ModelError: it is no biped with six joints a leg that this can read; the message names the flag that helps.
    """
    if given.up is not None:
        return _read(model, given, np.array(NAMES[given.up], dtype=float), "--up", "given")
    try:
        return _read(model, given, np.array(NAMES["z"], dtype=float), "the base's own axes", "certain")
    except ModelError as error:
        others = [np.array(NAMES[name], dtype=float) for name in ("-z", "x", "-x", "y", "-y")]
        for up in [*others, *ways_up(model)]:
            try:
                return _read(model, given, up, "the way up in which it is a biped", "likely")
            except ModelError:
                continue
        raise _without_legs(model, given) or error from None


def _without_legs(model: ParsedModel, given: Given) -> ModelError | None:
    """What to say of a model that can't be read where its lowest limbs are arms."""
    if given.left_foot or given.right_foot or given.left_joints or given.right_joints:
        return None
    up = np.array(NAMES["z"], dtype=float)
    try:
        feet = find_feet(model, up, (None, None))
    except ModelError:
        return None
    if not are_arms(model, feet, up):
        return None
    names = " and ".join(limb.name for limb in feet.limbs)
    return ModelError(
        f"no legs were found: the limbs that reach lowest, to {names}, hang from high on the body, as arms do{FLAGS}"
    )


def _read(model: ParsedModel, given: Given, up: np.ndarray, source: str, sure: Sure) -> tuple[Legs, list[Inferred]]:
    feet = find_feet(model, up, (given.left_foot, given.right_foot))
    axes = side_to_side(model, feet.limbs, up)
    limbs = feet.limbs
    names: tuple[Sequence[str] | None, Sequence[str] | None] = (None, None)
    if given.left_joints is not None and given.right_joints is not None:
        names = given.left_joints, given.right_joints
        if given.left_joints[0] not in [joint.name() for joint in limbs[0].joints]:
            limbs = limbs[1], limbs[0]
    first, other = (find_leg(model, limb, axes, six) for limb, six in zip(limbs, names, strict=True))
    faces = facing(model, (first, other), axes, given.forward, given.left_foot)
    axes = axes._replace(ahead=faces.ahead, left=np.cross(up, faces.ahead))
    if limb_centre(model, first.limb) @ axes.left < limb_centre(model, other.limb) @ axes.left:
        first, other = other, first
    soles = made_alike(find_sole(model, first, axes), find_sole(model, other, axes))
    found = Legs((first, other), soles, axes, leg_length(model, first))
    upward = Inferred("up", f"{word(up)} of the base", source, sure)
    return found, [*_facts(model, found, feet, given), upward, faces.fact]


def _facts(model: ParsedModel, found: Legs, feet: Feet, given: Given) -> Iterator[Inferred]:
    yield Inferred("base", model.base.name(), "--base" if given.base else "the one floating link")
    yield Inferred("mass", f"{model.mass:.4g} kg", "the model")
    links = ", ".join(sole.link.name() for sole in found.soles)
    yield Inferred("feet", links, "the ends of the limbs that reach lowest")
    yield Inferred("leg", f"{found.length:.3g} m", "from hip pitch over knee to ankle")
    if feet.waist:
        names = listed(joint.name() for joint in feet.waist)
        yield Inferred("waist", names, "both legs hang from it; it is fixed")
    for side, leg, sole in zip(SIDES, found.legs, found.soles, strict=True):
        roles = ", ".join(f"{role} {joint.name()}" for role, joint in leg.joints.items())
        source, sure = f"axes, which are {leg.alignment:.2f} along their roles'", _sure(leg.alignment > 0.95)
        if given.left_joints is not None and given.right_joints is not None:
            source, sure = "--left-joints, --right-joints", "given"
        yield Inferred(f"{side} leg", roles, source, sure)
        length, width = 2e3 * sole.half_size
        tilt = f", {np.rad2deg(sole.tilt):.1f}° from level" if sole.tilt > 0.01 else ""
        text = f"{length:.0f} x {width:.0f} mm on {sole.link.name()}{tilt}"
        source = f"largest rectangle under the foot's {sole.source}"
        yield Inferred(f"{side} sole", text, source, _sure(sole.source == "contact geometry"))


def _sure(good: bool) -> Sure:
    return "certain" if good else "likely"
