"""Robots of random joint axes, offsets, masses, orders and welded parts, for comparison with Drake."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pdhocbf_drake.errors import ModelError
from pdhocbf_drake.robot import ROLES, SIDES, Biped, RobotConfig


def random_robot(folder: Path, seed: int, knee: str = "revolute") -> Biped:
    """A floating base with two chains of six joints; `knee` is the type of the knees."""
    random = np.random.default_rng(seed)
    parts = [_link(random, "base"), _link(random, "torso"), _joint(random, "chest", "fixed", "base", "torso")]
    for side in SIDES:
        above = "base"
        for role in random.permutation(ROLES).tolist():
            name = f"{side}_{role}"
            parts.append(_link(random, name))
            parts.append(_joint(random, f"{name}_joint", knee if role == "knee_pitch" else "revolute", above, name))
            if random.random() < 0.4:
                parts += [_link(random, f"{name}_cover")]
                parts += [_joint(random, f"{name}_weld", "fixed", name, f"{name}_cover")]
            above = name
        parts += [_link(random, f"{side}_foot"), _joint(random, f"{side}_toes", "fixed", above, f"{side}_foot")]
    path = folder / f"robot_{seed}.urdf"
    path.write_text(f'<robot name="random">{"".join(random.permutation(parts).tolist())}</robot>', encoding="utf-8")
    legs = [
        {
            "sole": {"link": f"{side}_foot", "xyz": tuple(random.normal(size=3).tolist()), "half_size": (0.1, 0.05)},
            "joints": {role: f"{side}_{role}_joint" for role in ROLES},
            "bent_knee": {"knee_pitch": 0.5},
        }
        for side in SIDES
    ]
    config = {
        "name": "random", "model": str(path), "base_link": "base", "torso_link": "torso", "com_height": 0.6,
        "stance_width": 0.2, "effort_limits": 100.0, "reflected_inertia": 0.02,
    }  # fmt: skip
    try:
        return Biped(RobotConfig(**config, left=legs[0], right=legs[1]), checked=False)
    except ModelError:  # left is where y is greater
        return Biped(RobotConfig(**config, left=legs[1], right=legs[0]), checked=False)


def _vector(values: np.ndarray) -> str:
    return " ".join(map(repr, values.tolist()))


def _link(random: np.random.Generator, name: str) -> str:
    xx, yy, zz = 0.05 + 0.02 * random.random(3)
    return (
        f'<link name="{name}"><inertial><mass value="{random.uniform(0.2, 5.0)}"/>'
        f'<origin xyz="{_vector(0.2 * random.normal(size=3))}" rpy="{_vector(random.normal(size=3))}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="0.003" ixz="-0.002" iyz="0.001"/></inertial></link>'
    )


def _joint(random: np.random.Generator, name: str, kind: str, parent: str, child: str) -> str:
    axis = random.normal(size=3) if random.random() < 0.7 else random.permutation([0.0, 0.0, -1.0])
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{_vector(0.3 * random.normal(size=3))}" rpy="{_vector(random.normal(size=3))}"/>'
        f'<axis xyz="{_vector(axis)}"/><limit lower="-3" upper="3" effort="100" velocity="10"/>'
        f'<dynamics damping="{random.uniform(0.0, 2.0)}"/></joint>'
    )
