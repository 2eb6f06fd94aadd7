"""The safe copy of a model: only what Drake reads, with its meshes beside it."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from pdhocbf_drake.errors import InputError
from pdhocbf_drake.importing.copying import Copying
from pdhocbf_drake.importing.meshes import MeshFolder
from pdhocbf_drake.importing.mjcf import copy_mjcf
from pdhocbf_drake.importing.sdf import copy_sdf
from pdhocbf_drake.importing.urdf import copy_urdf
from pdhocbf_drake.robot.model_text import joint_texts, read_xml, write_xml

Report = Callable[[str], None]


@dataclass(frozen=True)
class ModelCopy:
    """The copy of a model.

    Attributes:
        path: its file. root: its tree, see `robot.model_text.read_xml`. meshes: its meshes.
        leaders: by the name of each joint that followed another one (mimic), that other one.
    """

    path: Path
    root: ET.Element
    meshes: MeshFolder
    leaders: dict[str, str]
    _changes: list[str]

    @property
    def changes(self) -> list[str]:
        """What it has other than the model, in sentences."""
        return [*self._changes, *self.meshes.changes]

    def save(self) -> None:
        """Writes the tree to the file."""
        self.path.write_text(write_xml(self.root), encoding="utf-8")


def copy_model(source: Path, folder: Path, packages: Mapping[str, Path], base: str | None, report: Report) -> ModelCopy:
    """Copies a URDF, SDF or MJCF file and its meshes into a folder.

    Raises:
        InputError: the file is no such model, a mesh can't be read, or the packages that convert meshes are missing.
    """
    kinds = {"robot": (copy_urdf, ".urdf"), "sdf": (copy_sdf, ".sdf"), "mujoco": (copy_mjcf, ".xml")}
    try:
        root = read_xml(source.read_text(encoding="utf-8", errors="replace"))
    except (ET.ParseError, OSError) as error:
        raise InputError(f"{source} can't be read: {error}") from None
    if root.tag not in kinds:
        raise InputError(f"{source} is no URDF, SDF or MJCF: its first tag is <{root.tag}>")
    copy, ending = kinds[root.tag]
    copying = Copying(source, packages, base, MeshFolder(folder))
    copy(root, copying)
    copying.note_missing()
    copying.meshes.write(report)
    leaders = {name: text.leader for name, text in joint_texts(source).items() if text.leader}
    made = ModelCopy(folder / f"model{ending}", root, copying.meshes, leaders, copying.changes)
    made.save()
    return made
