"""The page of an imported robot: its picture, what was inferred, what was changed, and its robot file."""

from __future__ import annotations

from pathlib import Path

from pdhocbf_drake.analysis.drawing import styled
from pdhocbf_drake.analysis.page import data_url, filled_page, png
from pdhocbf_drake.files.file import write_text
from pdhocbf_drake.importing.importer import ROBOT, Imported
from pdhocbf_drake.importing.picture import robot_picture


def write_page(imported: Imported, path: Path) -> None:
    """Writes the page, which loads nothing."""
    with styled():
        picture = png(robot_picture(imported.biped))
    html = filled_page(
        "importing",
        name=imported.biped.config.name,
        picture=data_url(picture),
        facts=imported.facts,
        changes=imported.changes,
        faults=imported.faults,
        robot=(path.parent / ROBOT).read_text(encoding="utf-8"),
    )
    write_text(path, html)
