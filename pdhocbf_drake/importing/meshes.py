"""Meshes in formats that Drake reads, small enough for a replay: OBJ for contact and one colour, glTF for several."""

from __future__ import annotations

import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any, Final

import numpy as np

from pdhocbf_drake.errors import InputError, reason
from pdhocbf_drake.importing.mesh_axes import Y_UP, named_turn, to_z_up

MISSING: Final = (
    "meshes are converted with the packages 'trimesh', 'fast-simplification' and 'pycollada'; "
    "install them with pip install '.[import]' in this package's repository"
)
FOLDER: Final = "meshes"
_MOST_FACES = 60_000  # of all visual meshes together: 3 to 5 MB in a replay
_FEWEST_FACES = 200  # of a mesh that is simplified
_HULL_FACES = 2000  # the most of a convex hull
_AGGRESSION = 3  # of the simplification, from 0 to 10; low is slow and exact
_LINES = 4  # of progress
_PLAIN = {".stl", ".ply", ".off"}  # formats without materials

Report = Callable[[str], None]


class MeshFolder:
    """The meshes of a model on their way into the folder of its copy.

    Attributes:
        changes: what was simplified, in sentences.
    """

    def __init__(self, home: Path) -> None:
        self._home, self._wanted = home, dict[tuple[Path, bool], str]()
        self._as_stored = False
        self.changes: list[str] = []

    def add(self, source: Path, contact: bool) -> str:
        """The name, relative to the copy, that a mesh will have; as contact geometry it becomes its convex hull."""
        key = source.resolve(), contact
        if key not in self._wanted:
            ending = ".obj" if contact or _is_plain(source) else ".gltf"
            stem = f"{source.stem}_contact" if contact else source.stem
            taken, name, number = set(self._wanted.values()), f"{FOLDER}/{stem}{ending}", 1
            while name in taken:
                number += 1
                name = f"{FOLDER}/{stem}_{number}{ending}"
            self._wanted[key] = name
        return self._wanted[key]

    @property
    def turns(self) -> dict[str, np.ndarray]:
        """The rotation to axes with z up (3, 3), by the names of drawn meshes whose files name another axis."""
        drawn = {Path(name).name: named_turn(source) for (source, contact), name in self._wanted.items() if not contact}
        return {name: turn[:3, :3] for name, turn in drawn.items() if not np.array_equal(turn, np.eye(4))}

    def write_as_stored(self, report: Report) -> None:
        """Writes all meshes anew, without regard to the up axis that COLLADA files name."""
        self._as_stored = True
        report("meshes reach to the joints only without the up axis that their files name: writing them anew")
        self.changes = ["the up axis that mesh files name passed over: without it meshes reach to the joints"]
        self.write(report)

    def write(self, report: Report) -> None:
        """Writes all meshes.

        Raises:
            InputError: a library is missing, or a mesh can't be read.
        """
        if not self._wanted:
            return
        (self._home / FOLDER).mkdir(exist_ok=True)
        parts = {key: _parts(key[0], self._as_stored) for key in self._wanted}
        total = sum(len(part.faces) for (_, contact), mesh in parts.items() if not contact for part in mesh)
        share = min(1.0, _MOST_FACES / max(total, 1))
        said = set(np.linspace(1, len(self._wanted), _LINES).round().astype(int).tolist())
        for number, (key, name) in enumerate(self._wanted.items(), start=1):
            if number in said:
                report(f"mesh {number} of {len(self._wanted)}: {key[0].name}")
            if key[1]:
                _write_hull(parts[key], self._home / name)
            else:
                _write_visual([_simplified(part, share) for part in parts[key]], self._home / name)
        if share < 1.0:
            kept = sum(
                len(_simplified(part, share).faces) for key, mesh in parts.items() if not key[1] for part in mesh
            )
            self.changes.append(f"visual meshes simplified from {total} to {kept} triangles")


def triangles_of(path: Path) -> np.ndarray:
    """The triangles of a mesh that Drake reads, z up (n, 3, 3) [m]; none without the packages that convert meshes."""
    try:
        parts = _parts(path)
    except InputError:
        return np.empty((0, 3, 3))
    return np.vstack([np.asarray(part.triangles) for part in parts])


def _trimesh() -> Any:
    try:
        import collada  # noqa: F401
        import fast_simplification  # noqa: F401
        import trimesh
    except ImportError:
        raise InputError(MISSING) from None
    return trimesh


def _is_plain(source: Path) -> bool:
    """Whether a mesh has no colours of its own."""
    if source.suffix.lower() == ".obj":
        with source.open(encoding="utf-8", errors="replace") as file:
            return not any(line.startswith("mtllib") for line in file)
    return source.suffix.lower() in _PLAIN


def _parts(source: Path, as_stored: bool = False) -> list[Any]:
    """The triangle meshes of a file, in its own frame [m], z up by its axes or as it is stored."""
    trimesh = _trimesh()
    try:
        scene = trimesh.load_scene(str(source))
        if source.suffix.lower() == ".dae":
            scene = _with_all_parts(source, scene)
    except Exception as error:  # the loaders of many formats raise many types
        raise InputError(f"mesh {source} can't be read: {reason(error)}") from None
    factor = str(scene.units or "").partition(" *")[0]
    scale = float(factor) if " *" in str(scene.units or "") else 1.0  # "0.001 * meters" in COLLADA
    upright, parts = np.eye(4) if as_stored and source.suffix.lower() == ".dae" else to_z_up(source), []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh) and len(geometry.faces):
            parts.append(geometry.copy().apply_transform(upright @ transform).apply_scale(scale))
    if not parts:
        raise InputError(f"mesh {source} can't be read: it has no triangles")
    return parts


def _with_all_parts(source: Path, scene: Any) -> Any:
    """The scene of a COLLADA file, without colours if parts are missing, as where a material that they name is."""
    text = source.read_bytes()
    if len(scene.graph.nodes_geometry) >= text.count(b"<instance_geometry"):
        return scene
    plain = re.sub(rb"<bind_material>.*?</bind_material>", b"", text, flags=re.DOTALL)
    return _trimesh().load_scene(BytesIO(plain), file_type="dae")


def _simplified(part: Any, share: float) -> Any:
    wanted = max(_FEWEST_FACES, int(share * len(part.faces)))
    if wanted >= len(part.faces):
        return part
    smaller = part.copy()
    smaller.merge_vertices(merge_tex=True, merge_norm=True)
    smaller = smaller.simplify_quadric_decimation(face_count=wanted, aggression=_AGGRESSION)
    smaller.metadata["colour"] = _colour(part)
    return smaller


def _colour(part: Any) -> np.ndarray:
    """RGBA of a part in [0, 1]."""
    if "colour" in part.metadata:
        return np.asarray(part.metadata["colour"])
    material = getattr(part.visual, "material", None)
    colour = part.visual.main_color if material is None else material.main_color
    return np.asarray(colour, dtype=float) / 255.0


def _write_hull(parts: list[Any], path: Path) -> None:
    trimesh = _trimesh()
    vertices = np.vstack([part.vertices for part in parts])
    try:
        hull = trimesh.convex.convex_hull(vertices)
    except Exception as error:  # of a flat mesh; scipy's QhullError among others
        raise InputError(f"mesh {path.name} has no volume, and can't be contact geometry: {reason(error)}") from None
    if len(hull.faces) > _HULL_FACES:
        fewer = hull.simplify_quadric_decimation(face_count=_HULL_FACES, aggression=_AGGRESSION)
        hull = trimesh.convex.convex_hull(fewer.vertices)
    path.write_text(_obj([hull]), encoding="ascii")


def _write_visual(parts: list[Any], path: Path) -> None:
    if path.suffix == ".obj":
        path.write_text(_obj(parts), encoding="ascii")
        return
    trimesh = _trimesh()
    scene = trimesh.Scene()
    for part in parts:
        material = trimesh.visual.material.PBRMaterial(
            baseColorFactor=(255.0 * _colour(part)).astype(np.uint8), metallicFactor=0.1, roughnessFactor=0.6
        )
        plain = trimesh.Trimesh(part.vertices, part.faces, process=False).apply_transform(Y_UP.T)
        plain.visual = trimesh.visual.TextureVisuals(material=material)
        scene.add_geometry(plain)
    files = trimesh.exchange.gltf.export_gltf(scene, embed_buffers=True)
    path.write_bytes(files["model.gltf"])


def _obj(parts: list[Any]) -> str:
    """One OBJ of all parts, with coordinates to 10 µm."""
    lines, first = [], 1
    for part in parts:
        lines += ["v {:.5f} {:.5f} {:.5f}".format(*vertex) for vertex in part.vertices.tolist()]
        lines += ["f {} {} {}".format(*face) for face in (np.asarray(part.faces) + first).tolist()]
        first += len(part.vertices)
    return "\n".join(lines) + "\n"
