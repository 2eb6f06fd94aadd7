"""Places of files that a model names: package://, model:// and file:// URLs, and paths relative to the model."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import unquote, urlparse

_NAME = re.compile(r"<name>\s*([^<\s]+)\s*</name>")


def resolved(text: str, model: Path, packages: Mapping[str, Path]) -> Path | None:
    """The file that a model at `model` means; None where it can't be found.

    A package is one of `packages`, a folder of that name or with a package.xml of that name on the way up from the
    model, or one in ROS_PACKAGE_PATH.
    """
    url = urlparse(text.strip())
    if url.scheme not in ("package", "model", "file"):
        path = model.parent / text.strip()
        return path if path.is_file() else None
    rest = unquote(url.path).lstrip("/")
    if url.scheme == "file":
        path = Path("/" + rest)
        return path if path.is_file() else None
    for folder in _folders(url.netloc, model, packages):
        if (folder / rest).is_file():
            return folder / rest
    return None


def _folders(package: str, model: Path, packages: Mapping[str, Path]) -> list[Path]:
    """Where a package may be, the likeliest first."""
    if package in packages:
        return [packages[package]]
    above = list(model.resolve().parents)
    named = [folder for folder in above if folder.name == package or _package_name(folder) == package]
    roots = [Path(root) for root in os.environ.get("ROS_PACKAGE_PATH", "").split(":") if root]
    inside = [folder / package for folder in [*above, *roots] if (folder / package).is_dir()]
    return [*named, *inside, *above[:4]]


def _package_name(folder: Path) -> str:
    try:
        found = _NAME.search((folder / "package.xml").read_text(encoding="utf-8", errors="replace"))
    except OSError:
        return ""
    return found[1] if found else ""
