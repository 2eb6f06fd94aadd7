"""Draws the robot's shells and writes one glTF per link into meshes/: `python build_meshes.py` (needs trimesh).

Shapes are in the links' own frames (see build_urdf.py), in m. They carry no mass and touch nothing. The left
leg is blue and the right one orange, so that the feet can be told apart in side views, in print and by
colour-blind readers.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from shapes import Section, cylinder, ellipsoid, loft, torus
from trimesh.exchange.gltf import export_gltf
from trimesh.visual.material import PBRMaterial

Part = tuple[str, trimesh.Trimesh]  # material, shape

# sRGB colour, metalness, roughness, glow
MATERIALS = {
    "shell": ("#eef0f3", 0.0, 0.35, 0.0),
    "graphite": ("#2b2f36", 0.3, 0.55, 0.0),
    "metal": ("#9aa1ab", 0.7, 0.35, 0.0),
    "rubber": ("#1b1c1f", 0.0, 0.9, 0.0),
    "visor": ("#0b0d12", 0.1, 0.12, 0.0),
    "light": ("#6fe3ff", 0.0, 0.4, 1.0),
    "left": ("#1f6fd1", 0.0, 0.35, 0.0),
    "right": ("#f07b16", 0.0, 0.35, 0.0),
}


def torso() -> list[Part]:
    """Pelvis, waist, chest, shoulder caps, neck and head."""
    parts = [
        ("graphite", loft([Section(0.075, 0.05, 0.085), Section(0.10, 0.062, 0.115), Section(0.125, 0.05, 0.08)], 3.5)),
        ("graphite", loft([Section(0.12, 0.042, 0.06), Section(0.17, 0.045, 0.065)], 2.5)),
        ("shell", loft([
            Section(0.165, 0.058, 0.075, 0.0), Section(0.21, 0.078, 0.105, 0.006), Section(0.30, 0.095, 0.142, 0.012),
            Section(0.37, 0.09, 0.148, 0.006), Section(0.415, 0.062, 0.105, -0.004)], 2.8, 0.6)),
        ("graphite", loft([Section(0.20, 0.03, 0.07, -0.078), Section(0.28, 0.04, 0.088, -0.09),
                           Section(0.37, 0.032, 0.078, -0.08)], 4.0)),
        ("graphite", loft([Section(0.235, 0.02, 0.05, 0.083), Section(0.285, 0.02, 0.066, 0.095),
                           Section(0.325, 0.02, 0.06, 0.092)], 3.5)),
        ("light", torus(0.021, 0.0042, (0.116, 0.0, 0.285))),
        ("metal", cylinder(0.015, 0.008, (0.114, 0.0, 0.285), "x", 0.002)),
        ("graphite", cylinder(0.032, 0.07, (-0.004, 0.0, 0.445), "z")),
        ("shell", ellipsoid((0.082, 0.074, 0.078), (0.0, 0.0, 0.535), 2.5)),
        ("visor", ellipsoid((0.062, 0.066, 0.042), (0.031, 0.0, 0.54), 2.7)),
    ]  # fmt: skip
    for y in (-1, 1):
        side = "left" if y > 0 else "right"
        parts += [
            ("graphite", cylinder(0.046, 0.05, (0.0, 0.152 * y, 0.345), "y")),
            (side, ellipsoid((0.05, 0.024, 0.05), (0.0, 0.172 * y, 0.345), 2.3)),
            ("light", ellipsoid((0.008, 0.010, 0.013), (0.0885, 0.026 * y, 0.545))),
            ("graphite", cylinder(0.022, 0.016, (-0.004, 0.074 * y, 0.535), "y", 0.004)),
            ("metal", cylinder(0.012, 0.006, (-0.004, 0.084 * y, 0.535), "y", 0.002)),
            ("shell", cylinder(0.044, 0.05, (0.0, 0.08 * y, 0.082), "z", 0.012)),
        ]
    return parts


def leg(side: str) -> dict[str, list[Part]]:
    """The six links of a leg; `out` points away from the body."""
    out = 1.0 if side == "left" else -1.0
    return {
        "hip_yaw": [
            ("graphite", cylinder(0.036, 0.03, (0.0, 0.0, 0.048), "z")),
            ("graphite", loft([Section(-0.025, 0.012, 0.026, -0.068), Section(0.02, 0.014, 0.03, -0.066),
                               Section(0.045, 0.03, 0.032, -0.045)], 3.5)),
        ],
        "hip_roll": [
            ("metal", cylinder(0.034, 0.036, (-0.052, 0.0, 0.0), "x")),
            ("graphite", cylinder(0.04, 0.02, (-0.032, 0.0, 0.0), "x")),
            ("graphite", cylinder(0.032, 0.052, (0.0, -0.004 * out, 0.0), "y")),
        ],
        "thigh": [
            ("graphite", cylinder(0.05, 0.036, (0.0, 0.032 * out, 0.0), "y", 0.009)),
            (side, cylinder(0.032, 0.010, (0.0, 0.052 * out, 0.0), "y", 0.004)),
            ("shell", loft([
                Section(-0.262, 0.034, 0.034, 0.002), Section(-0.20, 0.043, 0.038, 0.004),
                Section(-0.11, 0.054, 0.044, 0.006, 0.004 * out),
                Section(-0.045, 0.05, 0.04, 0.002, 0.01 * out)], 2.7, 0.6)),
            ("graphite", loft([Section(-0.305, 0.026, 0.022), Section(-0.24, 0.03, 0.026)], 3.0)),
            ("graphite", cylinder(0.043, 0.05, (0.0, 0.0, -0.30), "y", 0.008)),
        ],
        "shank": [
            (side, cylinder(0.036, 0.074, (0.0, 0.0, 0.0), "y", 0.007)),
            ("metal", cylinder(0.016, 0.082, (0.0, 0.0, 0.0), "y", 0.003)),
            ("shell", loft([
                Section(-0.235, 0.024, 0.024, 0.0), Section(-0.17, 0.034, 0.031, -0.004),
                Section(-0.095, 0.046, 0.038, -0.008), Section(-0.035, 0.038, 0.034, 0.0)], 2.6, 0.6)),
            (side, loft([Section(-0.205, 0.006, 0.009, 0.0255), Section(-0.13, 0.006, 0.013, 0.0345),
                         Section(-0.06, 0.006, 0.014, 0.034)], 2.5)),
            ("graphite", loft([Section(-0.30, 0.017, 0.017), Section(-0.23, 0.02, 0.02)], 2.5)),
        ],
        "ankle": [
            ("metal", cylinder(0.024, 0.058, (0.0, 0.0, 0.0), "y", 0.004)),
            ("graphite", cylinder(0.017, 0.062, (0.0, 0.0, 0.0), "x", 0.004)),
        ],
        "foot": [
            ("rubber", loft([Section(-0.0535, 0.107, 0.065, 0.02), Section(-0.044, 0.110, 0.068, 0.02),
                             Section(-0.038, 0.107, 0.065, 0.02)], 7.0, 0.03)),
            (side, loft([Section(-0.038, 0.103, 0.061, 0.02), Section(-0.028, 0.098, 0.057, 0.017),
                         Section(-0.018, 0.076, 0.048, 0.006), Section(-0.010, 0.048, 0.038, -0.004)], 3.4, 0.4)),
            ("shell", loft([Section(-0.036, 0.028, 0.05, 0.097), Section(-0.025, 0.022, 0.044, 0.094)], 3.0, 0.5)),
            ("graphite", loft([Section(-0.015, 0.014, 0.026, 0.033), Section(0.008, 0.009, 0.02, 0.033)], 3.5)),
            ("graphite", loft([Section(-0.015, 0.014, 0.026, -0.033), Section(0.008, 0.009, 0.02, -0.033)], 3.5)),
        ],
    }  # fmt: skip


def linear(colour: str) -> np.ndarray:
    """glTF wants linear light; `colour` is sRGB as in CSS."""
    value = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def write(name: str, parts: list[Part], folder: Path) -> None:
    """One self-contained glTF, y up as that format wants it, one mesh per material."""
    scene = trimesh.Scene()
    for material in dict.fromkeys(name for name, _ in parts):
        colour, metalness, roughness, glow = MATERIALS[material]
        mesh = trimesh.util.concatenate([shape for kind, shape in parts if kind == material])
        mesh.visual = trimesh.visual.TextureVisuals(
            material=PBRMaterial(
                name=material,
                baseColorFactor=[*(255 * linear(colour)).round().astype(int), 255],
                metallicFactor=metalness,
                roughnessFactor=roughness,
                emissiveFactor=glow * linear(colour),
            )
        )
        scene.add_geometry(mesh, geom_name=material)
    scene.apply_transform(trimesh.transformations.euler_matrix(-np.pi / 2, 0, 0))
    files = export_gltf(scene, include_normals=True, merge_buffers=True, embed_buffers=True)
    folder.mkdir(exist_ok=True)
    (folder / f"{name}.gltf").write_bytes(files["model.gltf"])


if __name__ == "__main__":
    meshes = Path(__file__).with_name("meshes")
    write("torso", torso(), meshes)
    for side in ("left", "right"):
        for link, parts in leg(side).items():
            write(f"{side}_{link}", parts, meshes)
