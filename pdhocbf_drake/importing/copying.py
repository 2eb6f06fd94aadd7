"""A model on its way into the folder of its copy: where its files are, and what has been changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from pdhocbf_drake.importing.meshes import MeshFolder
from pdhocbf_drake.importing.resolving import resolved


@dataclass
class Copying:
    """A model on its way into the folder of its copy.

    Attributes:
        source: the model's file. packages: folders of `package://` names.
        base: the link that is to float though the model fixes it to the world; None for what the model says.
        meshes: those that the copy needs.
        changes: what the copy has other than the model, in sentences.
    """

    source: Path
    packages: Mapping[str, Path]
    base: str | None
    meshes: MeshFolder
    changes: list[str] = field(default_factory=list)
    _missing: list[str] = field(default_factory=list)

    def mesh(self, name: str, contact: bool) -> str | None:
        """The copy's name of a mesh; None, which is noted, where there is no such file."""
        found = resolved(name, self.source, self.packages)
        if found is None:
            self._missing.append(name)
            return None
        return self.meshes.add(found, contact)

    def note(self, names: list[str], one: str) -> None:
        """A change that concerns these names, if any; `one` is the sentence's beginning."""
        if names:
            self.changes.append(f"{one}: {', '.join(names)}")

    def note_missing(self) -> None:
        """Notes the meshes that were not found."""
        self.note(sorted(set(self._missing)), "meshes that are not there left out")
